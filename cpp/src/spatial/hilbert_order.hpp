// Points in the order of a Hilbert curve, so that neighbours in space become neighbours in memory.
#pragma once

#include <cstdint>
#include <vector>

#include "base/buffer.hpp"
#include "base/parallel.hpp"
#include "simd/tree_hilbert_keys.hpp"

namespace nacre {

// The rows of the points whose coordinates are finite, along the curve. Where many points share a cell of the curve
// they are ordered along a smaller one, and so on, so that outliers and clusters do no harm. Points in one place are in
// the order of their rows.
//
// The order comes in stretches, so that several threads can sort them and use them while they are in the cache.
template <class T>
class SpatialOrder {
 public:
  // A row and, above it, its key.
  using Entry = std::uint64_t;
  static std::uint32_t row(Entry entry) { return static_cast<std::uint32_t>(entry); }

  SpatialOrder(const T* points, std::int64_t count, int num_threads);

  std::int64_t size() const { return stretches_.back(); }   // points that are finite
  const simd::CurveCube<T>& cube() const { return cube_; }  // of the curve

  // use(first, entries, count) for each stretch, `first` being how many points come before it.
  template <class Use>
  void for_each_stretch(int num_threads, Use&& use) {
    parallel_for(static_cast<std::int64_t>(stretches_.size()) - 1, 1, num_threads, [&](std::int64_t stretch) {
      const std::int64_t first = stretches_[static_cast<std::size_t>(stretch)];
      const std::int64_t count = stretches_[static_cast<std::size_t>(stretch) + 1] - first;
      Entry* entries = entries_.data() + first;
      sort_entries(entries, count, free_bits_);
      use(first, static_cast<const Entry*>(entries), count);
    });
  }

 private:
  void sort_entries(Entry* entries, std::int64_t count, int bits);
  void sort_smaller(Entry* entries, std::int64_t count);

  const T* points_;
  simd::CurveCube<T> cube_ = {};
  int free_bits_;  // of the keys, that differ within a stretch
  Buffer<Entry> entries_;
  std::vector<std::int64_t> stretches_;  // where each begins, and the end
};

// The rows of the whole order.
template <class T>
Buffer<std::uint32_t> spatial_order(const T* points, std::int64_t count, int num_threads);

}  // namespace nacre
