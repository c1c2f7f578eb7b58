// Some of the square tiles that an image is cut into.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace nacre {

// Where a pixel is: in a tile of the set, beside one, or neither.
enum class InTiles : std::uint8_t { no, beside, yes };

class ImageTiles {
 public:
  // All of an image.
  ImageTiles() = default;
  // Those that `is_member` holds for, row by row; so many pixels around count as beside them.
  ImageTiles(int width, int height, int side, const std::vector<std::uint8_t>& is_member, int border)
      : across_((width + square - 1) / square),
        squares_(static_cast<std::size_t>(across_) * static_cast<std::size_t>((height + square - 1) / square)) {
    const int down = static_cast<int>(squares_.size()) / across_, reach = (border + square - 1) / square;
    const int tiles_across = (width + side - 1) / side;
    const auto in_tile = [&](int x, int y) {
      return is_member[static_cast<std::size_t>(y * square / side * tiles_across + x * square / side)] != 0;
    };
    for (int y = 0; y < down; ++y) {
      for (int x = 0; x < across_; ++x) {
        if (in_tile(x, y)) at(x, y) = InTiles::yes;
        if (!in_tile(x, y)) continue;
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
    return squares_[static_cast<std::size_t>(v / square * across_ + u / square)];
  }

 private:
  static constexpr int square = 16;  // [pixels] tiles are a multiple of it
  InTiles& at(int x, int y) { return squares_[static_cast<std::size_t>(y * across_ + x)]; }

  int across_ = 0;
  std::vector<InTiles> squares_;
};

}  // namespace nacre
