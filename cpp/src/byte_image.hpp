#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace nacre {

// One byte a pixel, with a border of zeros, so that small windows need no bounds checks.
class ByteImage {
 public:
  static constexpr int kBorder = 2;

  ByteImage(int width, int height)
      : width_(width),
        height_(height),
        values_(static_cast<std::size_t>(stride()) * static_cast<std::size_t>(height + 2 * kBorder)) {}

  int width() const { return width_; }
  int height() const { return height_; }
  std::ptrdiff_t stride() const { return width_ + 2 * kBorder; }
  std::uint8_t* row(std::int64_t v) { return values_.data() + (v + kBorder) * stride() + kBorder; }
  const std::uint8_t* row(std::int64_t v) const { return values_.data() + (v + kBorder) * stride() + kBorder; }

 private:
  int width_, height_;
  std::vector<std::uint8_t> values_;
};

}  // namespace nacre
