#include "nacre/cubes.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "base/check.hpp"
#include "base/parallel.hpp"
#include "base/point_rows.hpp"
#include "base/random.hpp"

namespace nacre {
namespace {

// Budgets of a thread's work at a time; no result depends on them.
constexpr std::int64_t points_per_hash_block = 1 << 14;
constexpr std::int64_t stretches_per_hash_block = 16;

template <class T>
std::vector<std::uint64_t> hashes_of(const Rows<T>& points, std::uint64_t seed, int num_threads) {
  std::vector<std::uint64_t> hashes(static_cast<std::size_t>(points.size()));
  parallel_for(points.size(), points_per_hash_block, num_threads, [&](std::int64_t row) {
    std::uint64_t hash = seed;
    for (int axis = 0; axis < 3; ++axis) {
      const double coordinate = static_cast<double>(points[row][axis]) + 0.0;
      std::uint64_t bits;
      std::memcpy(&bits, &coordinate, sizeof bits);
      hash = mix64(hash ^ bits);
    }
    hashes[static_cast<std::size_t>(row)] = hash;
  });
  return hashes;
}

template <class T>
std::vector<std::int64_t> numbers_of(const Rows<T>& points, const CubeGrid& grid, int num_threads) {
  require(grid.side > 0, "side", "positive", grid.side);
  double num_cubes = 1;
  for (const std::int64_t size : grid.shape) {
    require(size >= 1, "shape", "at least 1", size);
    num_cubes *= static_cast<double>(size);
  }
  require(num_cubes <= 0x1p62, "shape", "at most 2^62 cubes", num_cubes);
  std::vector<std::int64_t> numbers(static_cast<std::size_t>(points.size()));
  parallel_for(points.size(), points_per_hash_block, num_threads, [&](std::int64_t row) {
    std::int64_t number = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const std::int64_t size = grid.shape[static_cast<std::size_t>(axis)];
      const double along = (static_cast<double>(points[row][axis]) - grid.origin[axis]) / grid.side;
      const double inside = along > 0 ? std::min(along, static_cast<double>(size - 1)) : 0.0;
      number = number * size + static_cast<std::int64_t>(inside);
    }
    numbers[static_cast<std::size_t>(row)] = number;
  });
  return numbers;
}

// Numbers in the order in which they are first seen, in a table of open addresses.
class SeenNumbers {
 public:
  SeenNumbers() : slots_(1024, -1) {}

  std::int64_t place_of(std::int64_t number) {
    std::size_t slot = slot_of(number);
    while (slots_[slot] >= 0) {
      if (numbers_[static_cast<std::size_t>(slots_[slot])] == number) return slots_[slot];
      slot = (slot + 1) & (slots_.size() - 1);
    }
    slots_[slot] = static_cast<std::int64_t>(numbers_.size());
    numbers_.push_back(number);
    if (2 * numbers_.size() > slots_.size()) grow();
    return static_cast<std::int64_t>(numbers_.size()) - 1;
  }

  const std::vector<std::int64_t>& numbers() const { return numbers_; }

 private:
  std::size_t slot_of(std::int64_t number) const {
    return static_cast<std::size_t>(mix64(static_cast<std::uint64_t>(number))) & (slots_.size() - 1);
  }
  void grow() {
    slots_.assign(2 * slots_.size(), -1);
    for (std::size_t place = 0; place < numbers_.size(); ++place) {
      std::size_t slot = slot_of(numbers_[place]);
      while (slots_[slot] >= 0) slot = (slot + 1) & (slots_.size() - 1);
      slots_[slot] = static_cast<std::int64_t>(place);
    }
  }

  std::vector<std::int64_t> slots_, numbers_;
};

struct HashedRow {
  std::uint64_t hash;
  std::int64_t row;
  bool operator<(const HashedRow& other) const { return hash != other.hash ? hash < other.hash : row < other.row; }
};

// Hashes are evenly spread: as many buckets as there are rows, by the leading bits, have one or two each.
void sort_stretch(const std::uint64_t* hashes, std::int64_t first, std::int64_t count, HashOrder& sorted,
                  std::vector<HashedRow>& rows, std::vector<std::int64_t>& ends) {
  int bits = 0;
  while (bits < 20 && (std::int64_t{1} << (bits + 1)) <= count) ++bits;
  const auto bucket_of = [&](std::uint64_t hash) {
    return bits == 0 ? std::size_t{0} : static_cast<std::size_t>(hash >> (64 - bits));
  };
  ends.assign((std::size_t{1} << bits) + 1, 0);
  for (std::int64_t i = 0; i < count; ++i) ++ends[bucket_of(hashes[first + i]) + 1];
  std::partial_sum(ends.begin(), ends.end(), ends.begin());
  rows.resize(static_cast<std::size_t>(count));
  for (std::int64_t i = 0; i < count; ++i) {
    const std::uint64_t hash = hashes[first + i];
    rows[static_cast<std::size_t>(ends[bucket_of(hash)]++)] = {hash, first + i};
  }
  std::int64_t begin = 0;
  for (std::size_t bucket = 0; bucket + 1 < ends.size(); ++bucket) {
    if (ends[bucket] - begin > 1) std::sort(rows.begin() + begin, rows.begin() + ends[bucket]);
    begin = ends[bucket];
  }
  for (std::size_t i = 0; i < rows.size(); ++i) {
    sorted.rows[static_cast<std::size_t>(first) + i] = rows[i].row;
    sorted.hashes[static_cast<std::size_t>(first) + i] = rows[i].hash;
  }
}

}  // namespace

std::vector<std::uint64_t> point_hashes(const PointsRef& points, std::uint64_t seed, int num_threads) {
  return hashes_of<float>(points, seed, num_threads);
}
std::vector<std::uint64_t> point_hashes(const PointsDoubleRef& points, std::uint64_t seed, int num_threads) {
  return hashes_of<double>(points, seed, num_threads);
}

std::vector<std::int64_t> cube_numbers(const PointsRef& points, const CubeGrid& grid, int num_threads) {
  return numbers_of<float>(points, grid, num_threads);
}
std::vector<std::int64_t> cube_numbers(const PointsDoubleRef& points, const CubeGrid& grid, int num_threads) {
  return numbers_of<double>(points, grid, num_threads);
}

NumberGroups group_by_number(const std::int64_t* numbers, std::int64_t count) {
  SeenNumbers seen;
  std::vector<std::int64_t> places(static_cast<std::size_t>(count)), counts;
  for (std::int64_t row = 0; row < count; ++row) {
    const bool is_as_before = row > 0 && numbers[row] == numbers[row - 1];
    const auto place = is_as_before ? places[static_cast<std::size_t>(row - 1)] : seen.place_of(numbers[row]);
    if (static_cast<std::size_t>(place) == counts.size()) counts.push_back(0);
    ++counts[static_cast<std::size_t>(place)];
    places[static_cast<std::size_t>(row)] = place;
  }
  std::vector<std::size_t> order(counts.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return seen.numbers()[a] < seen.numbers()[b]; });
  NumberGroups groups;
  std::vector<std::int64_t> next(counts.size());
  std::int64_t total = 0;
  for (const std::size_t place : order) {
    groups.numbers.push_back(seen.numbers()[place]);
    groups.counts.push_back(counts[place]);
    next[place] = total;
    total += counts[place];
  }
  groups.rows.resize(static_cast<std::size_t>(count));
  for (std::int64_t row = 0; row < count; ++row) {
    const auto place = static_cast<std::size_t>(places[static_cast<std::size_t>(row)]);
    groups.rows[static_cast<std::size_t>(next[place]++)] = row;
  }
  return groups;
}

HashOrder order_by_hash(const std::vector<std::int64_t>& starts, const std::uint64_t* hashes, std::int64_t count,
                        int num_threads) {
  require(!starts.empty() && starts.front() == 0, "starts", "from 0 on", starts.empty() ? -1 : starts.front());
  require(std::is_sorted(starts.begin(), starts.end()), "starts", "ascending", "some that are not");
  require(starts.back() == count, "starts", "up to the number of hashes", starts.back());
  HashOrder order;
  order.rows.resize(static_cast<std::size_t>(count));
  order.hashes.resize(static_cast<std::size_t>(count));
  const auto num_stretches = static_cast<std::int64_t>(starts.size()) - 1;
  parallel_blocks(num_stretches, stretches_per_hash_block, num_threads,
                  [&](auto, std::int64_t begin, std::int64_t end) {
                    std::vector<HashedRow> rows;
                    std::vector<std::int64_t> ends;
                    for (std::int64_t stretch = begin; stretch < end; ++stretch) {
                      const std::int64_t first = starts[static_cast<std::size_t>(stretch)];
                      const std::int64_t size = starts[static_cast<std::size_t>(stretch) + 1] - first;
                      sort_stretch(hashes, first, size, order, rows, ends);
                    }
                  });
  return order;
}

}  // namespace nacre
