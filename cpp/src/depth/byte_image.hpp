#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "base/scratch.hpp"

namespace nacre {

// One byte a pixel, not initialised, with a border of zeros, so that small windows need no bounds checks.
class ByteImage {
 public:
  static constexpr int kBorder = 3;

  ByteImage(int width, int height)
      : width_(width),
        height_(height),
        values_(static_cast<std::size_t>(stride()) * static_cast<std::size_t>(height + 2 * kBorder)) {
    std::fill(row(-kBorder) - kBorder, row(0), std::uint8_t{0});
    for (int v = 0; v < height; ++v) std::fill(row(v) + width, row(v + 1), std::uint8_t{0});
    std::fill(row(height), row(height + kBorder) - kBorder, std::uint8_t{0});
  }

  int width() const { return width_; }
  int height() const { return height_; }
  std::ptrdiff_t stride() const { return width_ + 2 * kBorder; }
  std::uint8_t* row(std::int64_t v) { return values_.data() + (v + kBorder) * stride() + kBorder; }
  const std::uint8_t* row(std::int64_t v) const { return values_.data() + (v + kBorder) * stride() + kBorder; }

 private:
  int width_, height_;
  Scratch<std::uint8_t> values_;
};

}  // namespace nacre
