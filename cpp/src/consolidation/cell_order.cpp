// The curve: Hamilton and Rau-Chaplin, "Compact Hilbert indices: space-filling curves for domains with unequal side
// lengths", Information Processing Letters 105(5), 2008, in three dimensions, as a table.
#include "consolidation/cell_order.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <utility>

#include "base/parallel.hpp"
#include "base/statistics.hpp"

namespace nacre {
namespace {

// A state of the curve is the corner (0 to 7) at which it enters a cube and the direction (0 to 2) along which it
// leaves. For a state and an octant of the cube: 8 times the state in the octant, plus the octant's place on the curve.
using HilbertTable = std::array<std::uint8_t, 24 * 8>;

constexpr unsigned rotate_left(unsigned three_bits, unsigned by) {
  return ((three_bits << by) | (three_bits >> (3 - by))) & 7U;
}

constexpr unsigned trailing_ones(unsigned i) {
  unsigned count = 0;
  for (; (i & 1U) != 0; i >>= 1U) ++count;
  return count;
}

constexpr HilbertTable make_hilbert_table() {
  HilbertTable table{};
  for (unsigned corner = 0; corner < 8; ++corner) {
    for (unsigned direction = 0; direction < 3; ++direction) {
      for (unsigned octant = 0; octant < 8; ++octant) {
        const unsigned by = (direction + 1) % 3;
        const unsigned gray = rotate_left(octant ^ corner, (3 - by) % 3);
        const unsigned place = gray ^ (gray >> 1U) ^ (gray >> 2U);
        const unsigned before = place == 0 ? 0 : 2 * ((place - 1) / 2);
        const unsigned entry = before ^ (before >> 1U);
        const unsigned turn = place == 0 ? 0 : trailing_ones(place % 2 == 0 ? place - 1 : place) % 3;
        const unsigned next_corner = corner ^ rotate_left(entry, by), next_direction = (direction + turn + 1) % 3;
        table[8 * (3 * corner + direction) + octant] =
            static_cast<std::uint8_t>(8 * (3 * next_corner + next_direction) + place);
      }
    }
  }
  return table;
}

// Two levels at once: for a state and an octant of an octant, 64 times the state there, plus the place on the curve.
using DoubleTable = std::array<std::uint16_t, 24 * 64>;

constexpr DoubleTable make_double_table(const HilbertTable& table) {
  DoubleTable twice{};
  for (unsigned state = 0; state < 24; ++state) {
    for (unsigned octants = 0; octants < 64; ++octants) {
      const unsigned outer = table[8 * state + octants / 8], inner = table[(outer & ~7U) + octants % 8];
      twice[64 * state + octants] = static_cast<std::uint16_t>(64 * (inner / 8) + 8 * (outer % 8) + inner % 8);
    }
  }
  return twice;
}

constexpr HilbertTable hilbert_table = make_hilbert_table();
constexpr DoubleTable double_table = make_double_table(hilbert_table);
constexpr int most_bits = 21;
constexpr int cube_bits = 5;  // of a coordinate within a cube
constexpr std::int64_t least_chunk = 4096;

struct Chunks {
  std::int64_t size, count;

  explicit Chunks(std::int64_t num_rows)
      : size(std::max(least_chunk, (num_rows + 63) / 64)), count((num_rows + size - 1) / size) {}
};

struct Extent {
  Eigen::Array3d lower = Eigen::Array3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Array3d upper = -lower;
};

template <class Scalar>
struct Rows {
  const Scalar* data;
  std::int64_t stride, count;

  const Scalar* operator[](std::int64_t row) const { return data + row * stride; }
};

template <class Scalar>
bool is_finite(const Scalar* point) {
  return point[0] * Scalar{0} + point[1] * Scalar{0} + point[2] * Scalar{0} == Scalar{0};
}

template <class Cloud>
Rows<typename Cloud::Scalar> scalar_rows(const Cloud& points) {
  return {points.data(), points.outerStride(), points.rows()};
}

template <class Scalar>
Extent extent_of(const Rows<Scalar>& rows, std::int64_t begin, std::int64_t end) {
  constexpr Scalar infinity = std::numeric_limits<Scalar>::infinity();
  Scalar lower[3] = {infinity, infinity, infinity}, upper[3] = {-infinity, -infinity, -infinity};
  for (std::int64_t row = begin; row < end; ++row) {
    const Scalar* const point = rows[row];
    if (!is_finite(point)) continue;
    for (int axis = 0; axis < 3; ++axis) {
      lower[axis] = std::min(lower[axis], point[axis]);
      upper[axis] = std::max(upper[axis], point[axis]);
    }
  }
  Extent extent;
  for (int axis = 0; axis < 3; ++axis) {
    extent.lower[axis] = static_cast<double>(lower[axis]);
    extent.upper[axis] = static_cast<double>(upper[axis]);
  }
  return extent;
}

// The middle of most points, wherever a few strays are.
template <class Scalar>
Eigen::Array3d median(const Rows<Scalar>& rows) {
  std::array<std::vector<double>, 3> samples;
  for (std::int64_t row = 0; row < rows.count; row += std::max<std::int64_t>(1, rows.count / 1000)) {
    const Scalar* const point = rows[row];
    if (!is_finite(point)) continue;
    for (std::size_t axis = 0; axis < 3; ++axis) samples[axis].push_back(static_cast<double>(point[axis]));
  }
  Eigen::Array3d middle = Eigen::Array3d::Zero();
  for (std::size_t axis = 0; axis < 3 && !samples[axis].empty(); ++axis) {
    middle[static_cast<Eigen::Index>(axis)] = median_of(std::move(samples[axis]));
  }
  return middle;
}

template <class Scalar>
std::uint64_t key_of(const Scalar* point, const CellLattice& lattice) {
  const double most = static_cast<double>((1 << lattice.num_bits) - 1);
  std::uint32_t cell[3];
  for (int axis = 0; axis < 3; ++axis) {
    const double place = (static_cast<double>(point[axis]) - lattice.origin[axis]) * lattice.cells_per_length;
    cell[axis] = static_cast<std::uint32_t>(std::min(std::max(place, 0.0), most));
  }
  return hilbert_index(cell, lattice.num_bits);
}

// The lowest 21 bits, with two zeros above each.
std::uint64_t every_third(std::uint64_t bits) {
  bits &= 0x1FFFFFU;
  bits = (bits | (bits << 32U)) & 0x001F00000000FFFFU;
  bits = (bits | (bits << 16U)) & 0x001F0000FF0000FFU;
  bits = (bits | (bits << 8U)) & 0x100F00F00F00F00FU;
  bits = (bits | (bits << 4U)) & 0x10C30C30C30C30C3U;
  return (bits | (bits << 2U)) & 0x1249249249249249U;
}

// A row with its place on the curve: in one word where that suffices.
struct ShortItem {
  std::uint64_t bits;

  ShortItem() = default;
  ShortItem(std::uint64_t key, std::uint32_t row) : bits((key << 32U) | row) {}
  std::uint64_t key() const { return bits >> 32U; }
  std::uint32_t row() const { return static_cast<std::uint32_t>(bits); }
};

struct LongItem {
  std::uint64_t key_bits;
  std::uint32_t row_bits;

  LongItem() = default;
  LongItem(std::uint64_t key, std::uint32_t row) : key_bits(key), row_bits(row) {}
  std::uint64_t key() const { return key_bits; }
  std::uint32_t row() const { return row_bits; }
};

// Memory that is not filled first.
template <class Item>
using Buffer = std::unique_ptr<Item[]>;

// Sorts by the lowest num_bits bits of the keys: one stable counting sort a digit, lowest digit first.
template <class Item>
void radix_sort(Buffer<Item>& items, std::int64_t count, int num_bits, int num_threads) {
  const int num_digits = (num_bits + 10) / 11, digit_bits = (num_bits + num_digits - 1) / num_digits;
  const std::int64_t num_bins = std::int64_t{1} << digit_bits;
  const Chunks chunks(count);
  Buffer<Item> sorted(new Item[static_cast<std::size_t>(count)]);
  std::vector<std::int64_t> starts(static_cast<std::size_t>(num_bins * chunks.count));  // of a bin, chunk by chunk
  for (int digit = 0; digit < num_digits; ++digit) {
    const auto bin_of = [&](const Item& item) {
      return static_cast<std::int64_t>(item.key() >> static_cast<unsigned>(digit * digit_bits)) & (num_bins - 1);
    };
    parallel_blocks(count, chunks.size, num_threads, [&](std::int64_t chunk, std::int64_t begin, std::int64_t end) {
      std::int64_t* const counts = starts.data() + chunk * num_bins;
      std::fill(counts, counts + num_bins, 0);
      for (std::int64_t i = begin; i < end; ++i) ++counts[bin_of(items[static_cast<std::size_t>(i)])];
    });
    std::vector<std::int64_t> place(static_cast<std::size_t>(num_bins), 0);  // where a bin of the next chunk starts
    const auto for_counts = [&](auto&& body) {
      for (std::int64_t chunk = 0; chunk < chunks.count; ++chunk) {
        for (std::int64_t bin = 0; bin < num_bins; ++bin) {
          body(starts[static_cast<std::size_t>(chunk * num_bins + bin)], place[static_cast<std::size_t>(bin)]);
        }
      }
    };
    for_counts([](std::int64_t& start, std::int64_t& total) { total += start; });
    std::exclusive_scan(place.begin(), place.end(), place.begin(), std::int64_t{0});
    for_counts([](std::int64_t& start, std::int64_t& next) { next += std::exchange(start, next); });
    parallel_blocks(count, chunks.size, num_threads, [&](std::int64_t chunk, std::int64_t begin, std::int64_t end) {
      std::int64_t* const next = starts.data() + chunk * num_bins;
      for (std::int64_t i = begin; i < end; ++i) {
        const Item& item = items[static_cast<std::size_t>(i)];
        sorted[static_cast<std::size_t>(next[bin_of(item)]++)] = item;
      }
    });
    std::swap(items, sorted);
  }
}

template <class Item, class Scalar>
CellOrder order_rows(const Rows<Scalar>& rows, const CellLattice& lattice, int num_threads) {
  const Chunks chunks(rows.count);
  std::vector<std::int64_t> starts(static_cast<std::size_t>(chunks.count) + 1, 0);
  parallel_blocks(rows.count, chunks.size, num_threads, [&](std::int64_t chunk, std::int64_t begin, std::int64_t end) {
    std::int64_t num_finite = 0;
    for (std::int64_t row = begin; row < end; ++row) num_finite += is_finite(rows[row]) ? 1 : 0;
    starts[static_cast<std::size_t>(chunk) + 1] = num_finite;
  });
  std::partial_sum(starts.begin(), starts.end(), starts.begin());
  const std::int64_t count = starts.back();
  Buffer<Item> items(new Item[static_cast<std::size_t>(count)]);
  parallel_blocks(rows.count, chunks.size, num_threads, [&](std::int64_t chunk, std::int64_t begin, std::int64_t end) {
    Item* next = items.get() + starts[static_cast<std::size_t>(chunk)];
    for (std::int64_t row = begin; row < end; ++row) {
      if (is_finite(rows[row])) *next++ = Item(key_of(rows[row], lattice), static_cast<std::uint32_t>(row));
    }
  });
  radix_sort(items, count, 3 * lattice.num_bits, num_threads);

  CellOrder order;
  order.rows.resize(static_cast<std::size_t>(count));
  order.cubes.resize(static_cast<std::size_t>(count));
  parallel_for(count, Chunks(count).size, num_threads, [&](std::int64_t i) {
    const Item& item = items[static_cast<std::size_t>(i)];
    const std::uint64_t cube = item.key() >> (3 * cube_bits);
    order.rows[static_cast<std::size_t>(i)] = item.row();
    order.cubes[static_cast<std::size_t>(i)] = static_cast<std::uint32_t>(cube ^ (cube >> 32U));
  });
  return order;
}

struct Place {
  float point[3];
  std::uint32_t row;
};

// Halves along the longest side of the box, over and over, into blocks of at most so many; all but the last are full.
void halve(Place* first, Place* last, std::int64_t block_size) {
  const std::int64_t num_blocks = (last - first + block_size - 1) / block_size;
  if (num_blocks <= 1) return;
  int longest = 0;
  float length = -1.0F;
  for (int axis = 0; axis < 3; ++axis) {
    const auto less = [axis](const Place& a, const Place& b) { return a.point[axis] < b.point[axis]; };
    const auto ends = std::minmax_element(first, last, less);
    if (!(ends.second->point[axis] - ends.first->point[axis] > length)) continue;
    length = ends.second->point[axis] - ends.first->point[axis];
    longest = axis;
  }
  Place* const middle = first + num_blocks / 2 * block_size;
  std::nth_element(first, middle, last,
                   [longest](const Place& a, const Place& b) { return a.point[longest] < b.point[longest]; });
  halve(first, middle, block_size);
  halve(middle, last, block_size);
}

}  // namespace

std::uint64_t hilbert_index(const std::uint32_t (&cell)[3], int num_bits) {
  const std::uint64_t octants = every_third(cell[0]) | (every_third(cell[1]) << 1U) | (every_third(cell[2]) << 2U);
  std::uint64_t index = 0;
  unsigned state = 0, shift = 3 * static_cast<unsigned>(num_bits);
  if (num_bits % 2 != 0) {
    shift -= 3;
    const unsigned entry = hilbert_table[(octants >> shift) & 7U];
    index = entry & 7U;
    state = entry / 8 * 64;
  }
  while (shift > 0) {
    shift -= 6;
    const unsigned entry = double_table[state + ((octants >> shift) & 63U)];
    index = (index << 6U) | (entry & 63U);
    state = entry & ~63U;
  }
  return index;
}

template <class Cloud>
CellLattice cell_lattice(std::initializer_list<const Cloud*> clouds, double cell, int num_threads) {
  Extent whole;
  for (const Cloud* cloud : clouds) {
    const auto rows = scalar_rows(*cloud);
    const Chunks chunks(rows.count);
    std::vector<Extent> extents(static_cast<std::size_t>(chunks.count));
    parallel_blocks(rows.count, chunks.size, num_threads,
                    [&](std::int64_t chunk, std::int64_t begin, std::int64_t end) {
                      extents[static_cast<std::size_t>(chunk)] = extent_of(rows, begin, end);
                    });
    for (const Extent& extent : extents) {
      whole.lower = whole.lower.min(extent.lower);
      whole.upper = whole.upper.max(extent.upper);
    }
  }
  CellLattice lattice;
  if (!(whole.lower <= whole.upper).all()) return lattice;  // no point
  const double half = static_cast<double>(1 << (most_bits - 1)) * cell;
  lattice.cells_per_length = 1.0 / cell;
  lattice.origin = whole.lower;
  lattice.center = 0.5 * whole.lower + 0.5 * whole.upper;
  if ((whole.upper - whole.lower).maxCoeff() >= 2.0 * half) {
    lattice.center = median(scalar_rows(**clouds.begin()));
    lattice.origin = lattice.center - half;
  }
  lattice.reach =
      (whole.upper - lattice.center).max(lattice.center - whole.lower).maxCoeff() * lattice.cells_per_length;
  const double cells = (whole.upper - lattice.origin).maxCoeff() * lattice.cells_per_length;
  while (lattice.num_bits < most_bits && static_cast<double>(1 << lattice.num_bits) <= cells) ++lattice.num_bits;
  return lattice;
}

template <class Cloud>
CellOrder cell_order(const Cloud& points, const CellLattice& lattice, int num_threads) {
  const auto rows = scalar_rows(points);
  return 3 * lattice.num_bits <= 32 ? order_rows<ShortItem>(rows, lattice, num_threads)
                                    : order_rows<LongItem>(rows, lattice, num_threads);
}

template <class Cloud>
void halve_cubes(const Cloud& points, CellOrder& order, std::int64_t block_size, int num_threads) {
  std::vector<std::size_t> starts;
  for (std::size_t i = 0; i < order.rows.size(); ++i) {
    if (i == 0 || order.cubes[i] != order.cubes[i - 1]) starts.push_back(i);
  }
  const auto num_cubes = static_cast<std::int64_t>(starts.size());
  starts.push_back(order.rows.size());
  const auto rows = scalar_rows(points);
  parallel_blocks(num_cubes, 8, num_threads, [&](std::int64_t, std::int64_t begin, std::int64_t end) {
    std::vector<Place> places;
    for (std::int64_t cube = begin; cube < end; ++cube) {
      const std::size_t first = starts[static_cast<std::size_t>(cube)],
                        last = starts[static_cast<std::size_t>(cube) + 1];
      places.clear();
      for (std::size_t i = first; i < last; ++i) {
        const auto* const point = rows[order.rows[i]];
        const auto* const corner = rows[order.rows[first]];
        places.push_back({{static_cast<float>(point[0] - corner[0]), static_cast<float>(point[1] - corner[1]),
                           static_cast<float>(point[2] - corner[2])},
                          order.rows[i]});
      }
      halve(places.data(), places.data() + places.size(), block_size);
      for (std::size_t i = first; i < last; ++i) order.rows[i] = places[i - first].row;
    }
  });
}

template CellLattice cell_lattice(std::initializer_list<const PointsRef*>, double, int);
template CellLattice cell_lattice(std::initializer_list<const PointsDoubleRef*>, double, int);
template CellOrder cell_order(const PointsRef&, const CellLattice&, int);
template CellOrder cell_order(const PointsDoubleRef&, const CellLattice&, int);
template void halve_cubes(const PointsRef&, CellOrder&, std::int64_t, int);
template void halve_cubes(const PointsDoubleRef&, CellOrder&, std::int64_t, int);

}  // namespace nacre
