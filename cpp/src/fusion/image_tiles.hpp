// Some of the square tiles that an image is cut into.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "fusion/limits.hpp"

namespace nacre {

// Where a pixel is: in a tile of the set, beside one, or neither.
enum class InTiles : std::uint8_t { no, beside, yes };

class ImageTiles {
 public:
  // In a row of so many pixels.
  static int tiles_in(int pixels) { return (pixels + fusion_limits::tile_side - 1) / fusion_limits::tile_side; }
  static int squares_in(int pixels) { return (pixels + fusion_limits::known_square - 1) / fusion_limits::known_square; }

  // All of an image.
  ImageTiles() = default;
  // Those that `is_member` holds for, row by row; so many pixels around count as beside them.
  ImageTiles(int width, int height, const std::vector<std::uint8_t>& is_member, int border)
      : across_(squares_in(width)),
        squares_(static_cast<std::size_t>(across_) * static_cast<std::size_t>(squares_in(height))) {
    const int down = squares_in(height), reach = squares_in(border);
    for (int y = 0; y < down; ++y) {
      for (int x = 0; x < across_; ++x) {
        const int tile_x = x * fusion_limits::known_square / fusion_limits::tile_side;
        const int tile_y = y * fusion_limits::known_square / fusion_limits::tile_side;
        if (is_member[static_cast<std::size_t>(tile_y * tiles_in(width) + tile_x)] == 0) continue;
        at(x, y) = InTiles::yes;
        for (int v = std::max(0, y - reach); v <= std::min(down - 1, y + reach); ++v) {
          for (int u = std::max(0, x - reach); u <= std::min(across_ - 1, x + reach); ++u) {
            at(u, v) = std::max(at(u, v), InTiles::beside);
          }
        }
      }
    }
  }

  InTiles operator()(int u, int v) const {
    if (squares_.empty()) return InTiles::yes;
    const int x = u / fusion_limits::known_square, y = v / fusion_limits::known_square;
    return squares_[static_cast<std::size_t>(y * across_ + x)];
  }

 private:
  InTiles& at(int x, int y) { return squares_[static_cast<std::size_t>(y * across_ + x)]; }

  int across_ = 0;
  std::vector<InTiles> squares_;
};

}  // namespace nacre
