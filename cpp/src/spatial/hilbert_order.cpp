#include "spatial/hilbert_order.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "base/numbers.hpp"

namespace nacre {
namespace {

using simd::CurveBox;
using simd::CurveCube;

constexpr std::int64_t points_per_stretch = 512;  // if every cell had points: of surfaces, most have none
constexpr int most_stretch_bits = 12;
constexpr std::int64_t most_points_per_cell = 32;

void widen_box(const float* points, std::int64_t count, CurveBox<float>& box) {
  simd::widen_box_f32()(points, count, box);
}
void widen_box(const double* points, std::int64_t count, CurveBox<double>& box) {
  simd::widen_box_f64()(points, count, box);
}
void curve_keys(const float* points, std::int64_t count, const CurveCube<float>& cube, std::uint32_t* keys) {
  simd::curve_keys_f32()(points, count, cube, keys);
}
void curve_keys(const double* points, std::int64_t count, const CurveCube<double>& cube, std::uint32_t* keys) {
  simd::curve_keys_f64()(points, count, cube, keys);
}

template <class T>
CurveBox<T> empty_box() {
  constexpr T inf = infinity<T>;
  return {{inf, inf, inf}, {-inf, -inf, -inf}};
}

template <class T>
CurveCube<T> cube_around(const CurveBox<T>& box) {
  double side = 0;
  for (int axis = 0; axis < 3; ++axis) {
    side = std::max(side, static_cast<double>(box.hi[axis]) - static_cast<double>(box.lo[axis]));
  }
  constexpr double cells = (1 << simd::curve_bits / 3) - 0.5, most = 0.25 * std::numeric_limits<T>::max();
  return {{box.lo[0], box.lo[1], box.lo[2]}, static_cast<T>(side > 0 ? std::min(cells / side, most) : 0.0)};
}

std::uint32_t key(std::uint64_t entry) { return static_cast<std::uint32_t>(entry >> 32); }

// Sorts entries whose keys differ in the lowest bits only; equal keys keep their order.
void radix_sort(std::uint64_t* entries, std::int64_t count, int bits) {
  const int passes = (bits + 9) / 10, digit_bits = (bits + passes - 1) / passes;
  const std::uint32_t num_digits = 1U << digit_bits;
  Buffer<std::uint64_t> other(static_cast<std::size_t>(count));
  std::uint64_t *from = entries, *to = other.data();
  for (int pass = 0; pass < passes; ++pass) {
    const int shift = 32 + pass * digit_bits;
    const auto digit = [=](std::uint64_t entry) {
      return static_cast<std::uint32_t>(entry >> shift) & (num_digits - 1);
    };
    std::uint32_t place[1 << 10] = {};
    for (std::int64_t i = 0; i < count; ++i) ++place[digit(from[i])];
    std::uint32_t before = 0;
    for (std::uint32_t d = 0; d < num_digits; ++d) before += std::exchange(place[d], before);
    for (std::int64_t i = 0; i < count; ++i) to[place[digit(from[i])]++] = from[i];
    std::swap(from, to);
  }
  if (from != entries) std::copy(from, from + count, entries);
}

}  // namespace

template <class T>
SpatialOrder<T>::SpatialOrder(const T* points, std::int64_t count, int num_threads) : points_(points) {
  const std::int64_t chunk_size = std::max<std::int64_t>(16384, count / 32);
  const auto num_chunks = static_cast<std::size_t>((count + chunk_size - 1) / chunk_size);
  std::vector<CurveBox<T>> boxes(num_chunks, empty_box<T>());
  parallel_blocks(count, chunk_size, num_threads, [&](std::int64_t chunk, std::int64_t begin, std::int64_t end) {
    widen_box(points + 3 * begin, end - begin, boxes[static_cast<std::size_t>(chunk)]);
  });
  CurveBox<T> box = empty_box<T>();
  for (const CurveBox<T>& part : boxes) widen_box(part.lo, 2, box);  // by two corners
  cube_ = cube_around(box);

  int stretch_bits = 0;
  while (stretch_bits < most_stretch_bits && (count >> stretch_bits) >= 2 * points_per_stretch) ++stretch_bits;
  free_bits_ = simd::curve_bits - stretch_bits;
  const std::size_t num_stretches = std::size_t{1} << stretch_bits;

  // places: how many entries a chunk has in a stretch, then where they begin.
  Buffer<std::uint32_t> keys(static_cast<std::size_t>(count));
  std::vector<std::int64_t> places(num_chunks * num_stretches, 0);
  parallel_blocks(count, chunk_size, num_threads, [&](std::int64_t chunk, std::int64_t begin, std::int64_t end) {
    std::int64_t* place = places.data() + static_cast<std::size_t>(chunk) * num_stretches;
    curve_keys(points + 3 * begin, end - begin, cube_, keys.data() + begin);
    for (std::int64_t i = begin; i < end; ++i) {
      const std::uint32_t key = keys[static_cast<std::size_t>(i)];
      if (key != simd::no_key) ++place[key >> free_bits_];
    }
  });
  std::int64_t before = 0;
  stretches_.push_back(0);
  for (std::size_t stretch = 0; stretch < num_stretches; ++stretch) {
    for (std::size_t chunk = 0; chunk < num_chunks; ++chunk) {
      before += std::exchange(places[chunk * num_stretches + stretch], before);
    }
    if (before != stretches_.back()) stretches_.push_back(before);
  }
  entries_ = Buffer<Entry>(static_cast<std::size_t>(before));
  parallel_blocks(count, chunk_size, num_threads, [&](std::int64_t chunk, std::int64_t begin, std::int64_t end) {
    std::int64_t* place = places.data() + static_cast<std::size_t>(chunk) * num_stretches;
    for (std::int64_t i = begin; i < end; ++i) {
      const std::uint32_t key = keys[static_cast<std::size_t>(i)];
      if (key == simd::no_key) continue;
      entries_[static_cast<std::size_t>(place[key >> free_bits_]++)] = Entry{key} << 32 | static_cast<std::uint32_t>(i);
    }
  });
}

template <class T>
void SpatialOrder<T>::sort_entries(Entry* entries, std::int64_t count, int bits) {
  if (count < 512) {
    std::sort(entries, entries + count);
  } else {
    radix_sort(entries, count, bits);
  }
  for (std::int64_t begin = 0; begin + most_points_per_cell < count;) {
    if (key(entries[begin]) != key(entries[begin + most_points_per_cell])) {
      ++begin;
      continue;
    }
    std::int64_t end = begin + most_points_per_cell;
    while (end < count && key(entries[end]) == key(entries[begin])) ++end;
    sort_smaller(entries + begin, end - begin);
    begin = end;
  }
}

// Sorts entries of one cell along a curve through their own box.
template <class T>
void SpatialOrder<T>::sort_smaller(Entry* entries, std::int64_t count) {
  Buffer<T> points(static_cast<std::size_t>(3 * count));
  for (std::int64_t i = 0; i < count; ++i) {
    std::copy_n(points_ + 3 * static_cast<std::int64_t>(row(entries[i])), 3, points.data() + 3 * i);
  }
  CurveBox<T> box = empty_box<T>();
  widen_box(points.data(), count, box);
  Buffer<std::uint32_t> keys(static_cast<std::size_t>(count));
  curve_keys(points.data(), count, cube_around(box), keys.data());
  bool all_equal = true;
  for (std::int64_t i = 0; i < count; ++i) {
    const std::uint32_t key = keys[static_cast<std::size_t>(i)];
    entries[i] = Entry{key} << 32 | row(entries[i]);
    all_equal = all_equal && key == keys[0];
  }
  if (!all_equal) sort_entries(entries, count, simd::curve_bits);
}

template <class T>
Buffer<std::uint32_t> spatial_order(const T* points, std::int64_t count, int num_threads) {
  SpatialOrder<T> order(points, count, num_threads);
  Buffer<std::uint32_t> rows(static_cast<std::size_t>(order.size()));
  order.for_each_stretch(num_threads, [&](std::int64_t first, const std::uint64_t* entries, std::int64_t size) {
    std::transform(entries, entries + size, rows.data() + first, SpatialOrder<T>::row);
  });
  return rows;
}

template class SpatialOrder<float>;
template class SpatialOrder<double>;
template Buffer<std::uint32_t> spatial_order(const float*, std::int64_t, int);
template Buffer<std::uint32_t> spatial_order(const double*, std::int64_t, int);

}  // namespace nacre
