// What is where in an image: sets of pixels, and points by the pixels that they project to.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "fusion/observer.hpp"

namespace nacre {

// A set of pixels.
class PixelSet {
 public:
  PixelSet(int width, int height)
      : height_(height),
        words_(static_cast<std::size_t>(width + 2 * border) / 64 + 2),
        bits_(words_ * static_cast<std::size_t>(height), 0) {}

  void insert(const PixelWindow& window) {
    const auto shift = static_cast<std::size_t>(window.first_u + border);
    for (int row = std::max(0, -window.first_v); row < window.num_rows && window.first_v + row < height_; ++row) {
      const std::uint64_t pixels = window.rows[row];
      std::uint64_t* const words = &bits_[static_cast<std::size_t>(window.first_v + row) * words_ + shift / 64];
      words[0] |= pixels << (shift % 64);
      words[1] |= (pixels >> 1) >> (63 - shift % 64);
    }
  }
  bool contains(int u, int v) const {
    const auto bit = static_cast<std::size_t>(u + border);
    return (bits_[static_cast<std::size_t>(v) * words_ + bit / 64] >> (bit % 64) & 1U) != 0;
  }

 private:
  static constexpr int border = simd::largest_window;  // windows may begin left of the image
  int height_;
  std::size_t words_;  // per row
  std::vector<std::uint64_t> bits_;
};

// Which points are at the pixels of an image, in squares of so many pixels a side.
class PixelIndex {
 public:
  PixelIndex(int width, int height, int side)
      : width_(width),
        side_(side),
        columns_((width + side - 1) / side),
        rows_((height + side - 1) / side),
        newest_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), nobody) {}

  void reserve(std::size_t num_points) { entries_.reserve(num_points); }

  void add(std::int32_t pixel, std::size_t point) {
    std::int32_t& newest = newest_at(pixel % width_ / side_, pixel / width_ / side_);
    entries_.push_back({point, newest});
    newest = static_cast<std::int32_t>(entries_.size()) - 1;
  }

  // Whether test(point) holds for a point of a square that has a pixel at most `reach` from one.
  template <class Test>
  bool any_near(std::int32_t pixel, int reach, Test&& test) const {
    const int u = pixel % width_, v = pixel / width_;
    for (int y = std::max(0, v - reach) / side_; y <= std::min(rows_ - 1, (v + reach) / side_); ++y) {
      for (int x = std::max(0, u - reach) / side_; x <= std::min(columns_ - 1, (u + reach) / side_); ++x) {
        for (std::int32_t i = newest_at(x, y); i != nobody; i = entries_[static_cast<std::size_t>(i)].older) {
          if (test(entries_[static_cast<std::size_t>(i)].point)) return true;
        }
      }
    }
    return false;
  }

 private:
  static constexpr std::int32_t nobody = -1;
  struct Entry {
    std::size_t point;
    std::int32_t older;  // entry of the same square
  };
  std::int32_t& newest_at(int x, int y) { return newest_[static_cast<std::size_t>(y * columns_ + x)]; }
  std::int32_t newest_at(int x, int y) const { return newest_[static_cast<std::size_t>(y * columns_ + x)]; }

  int width_, side_, columns_, rows_;
  std::vector<std::int32_t> newest_;
  std::vector<Entry> entries_;
};

}  // namespace nacre
