#include "spatial/subset.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "base/numbers.hpp"
#include "base/parallel.hpp"
#include "base/random.hpp"

namespace nacre {
namespace {

constexpr std::int64_t rows_per_block = 8192;
constexpr int bin_bits = 12;

// Every finite row draws a ticket, and the lowest are taken.
using Ticket = std::pair<std::uint64_t, std::int64_t>;

// A hash set of rows by their coordinates.
template <class Cloud>
class Places {
 public:
  Places(const Cloud& points, std::int64_t most) : points_(points) {
    std::size_t size = 16;
    while (size < 2 * as_size(most)) size *= 2;
    rows_.assign(size, -1);
  }

  // Whether the row's place was not there yet.
  bool add(std::int64_t row) {
    std::size_t slot = hash(row) & (rows_.size() - 1);
    for (; rows_[slot] >= 0; slot = (slot + 1) & (rows_.size() - 1)) {
      if (points_.row(rows_[slot]) == points_.row(row)) return false;
    }
    rows_[slot] = row;
    return true;
  }

 private:
  std::size_t hash(std::int64_t row) const {
    std::uint64_t bits = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double coordinate = static_cast<double>(points_(row, axis)) + 0.0;  // -0 becomes 0
      std::uint64_t word;
      std::memcpy(&word, &coordinate, sizeof word);
      bits = mix64(bits ^ word);
    }
    return static_cast<std::size_t>(bits);
  }

  const Cloud& points_;
  std::vector<std::int64_t> rows_;
};

template <class Cloud>
class Draw {
 public:
  Draw(const Cloud& points, std::uint64_t seed, int num_threads)
      : points_(points), key_(mix64(seed)), num_threads_(num_threads) {}

  std::vector<std::int64_t> lowest(std::int64_t count) const {
    // How many tickets have which first bits?
    const std::int64_t num_blocks = (points_.rows() + rows_per_block - 1) / rows_per_block;
    std::vector<std::vector<std::int32_t>> histograms(as_size(num_blocks));
    for_rows([&](std::int64_t block, std::int64_t begin, std::int64_t end) {
      std::vector<std::int32_t>& histogram = histograms[as_size(block)];
      histogram.assign(std::size_t{1} << bin_bits, 0);
      for (std::int64_t row = begin; row < end; ++row) {
        if (is_finite(row)) ++histogram[as_size(bin(ticket(row)))];
      }
    });
    std::int64_t num_below = 0, limit = 0;
    for (std::int64_t total = 0; limit < std::int64_t{1} << bin_bits; ++limit, num_below = total) {
      for (const auto& histogram : histograms) total += histogram[as_size(limit)];
      if (total > count) break;
    }

    std::vector<std::vector<std::int64_t>> below(as_size(num_blocks));
    std::vector<std::vector<Ticket>> at_limit(as_size(num_blocks));
    for_rows([&](std::int64_t block, std::int64_t begin, std::int64_t end) {
      below[as_size(block)].reserve(as_size(std::min(end - begin, count)));
      for (std::int64_t row = begin; row < end; ++row) {
        const std::uint64_t drawn = ticket(row);
        if (bin(drawn) > limit || !is_finite(row)) continue;
        if (bin(drawn) < limit) {
          below[as_size(block)].push_back(row);
        } else {
          at_limit[as_size(block)].emplace_back(drawn, row);
        }
      }
    });
    std::vector<Ticket> last;
    for (const auto& tickets : at_limit) last.insert(last.end(), tickets.begin(), tickets.end());
    const std::int64_t missing = std::min(count - num_below, static_cast<std::int64_t>(last.size()));
    std::nth_element(last.begin(), last.begin() + missing, last.end());
    std::vector<std::int64_t> last_rows;
    for (std::int64_t i = 0; i < missing; ++i) last_rows.push_back(last[as_size(i)].second);
    std::sort(last_rows.begin(), last_rows.end());

    std::vector<std::int64_t> rows;
    rows.reserve(as_size(num_below + missing));
    for (const auto& part : below) rows.insert(rows.end(), part.begin(), part.end());
    const auto middle = static_cast<std::ptrdiff_t>(rows.size());
    rows.insert(rows.end(), last_rows.begin(), last_rows.end());
    std::inplace_merge(rows.begin(), rows.begin() + middle, rows.end());
    return rows;
  }

  // Rows in the order of their tickets.
  void sort(std::vector<std::int64_t>& rows) const {
    std::vector<Ticket> tickets;
    tickets.reserve(rows.size());
    for (const std::int64_t row : rows) tickets.emplace_back(ticket(row), row);
    std::sort(tickets.begin(), tickets.end());
    for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = tickets[i].second;
  }

 private:
  std::uint64_t ticket(std::int64_t row) const { return mix64(key_ ^ static_cast<std::uint64_t>(row)); }
  static std::int64_t bin(std::uint64_t ticket) { return static_cast<std::int64_t>(ticket >> (64 - bin_bits)); }

  bool is_finite(std::int64_t row) const {
    using Scalar = typename Cloud::Scalar;
    return points_(row, 0) * Scalar{0} + points_(row, 1) * Scalar{0} + points_(row, 2) * Scalar{0} == Scalar{0};
  }

  template <class Body>
  void for_rows(Body&& body) const {
    parallel_blocks(points_.rows(), rows_per_block, num_threads_, body);
  }

  const Cloud& points_;
  std::uint64_t key_;  // random_bits(seed, row) = mix64(key ^ row)
  int num_threads_;
};

}  // namespace

template <class Cloud>
std::vector<std::int64_t> choose_rows(const Cloud& points, std::int64_t count, std::uint64_t seed, int num_threads) {
  const Draw<Cloud> draw(points, seed, num_threads);
  std::vector<std::int64_t> drawn = draw.lowest(count);
  if (static_cast<std::int64_t>(drawn.size()) < count || points.rows() <= count) return drawn;  // every finite row
  Places<Cloud> places(points, count);
  if (std::all_of(drawn.begin(), drawn.end(), [&](std::int64_t row) { return places.add(row); })) return drawn;

  // Draw more, until there are enough places.
  for (std::int64_t num_drawn = count;;) {
    draw.sort(drawn);
    Places<Cloud> taken(points, count);
    std::vector<std::int64_t> chosen, repeated;
    for (const std::int64_t row : drawn) {
      if (static_cast<std::int64_t>(chosen.size()) == count) break;
      (taken.add(row) ? chosen : repeated).push_back(row);
    }
    const std::int64_t missing = count - static_cast<std::int64_t>(chosen.size());
    const bool has_more = static_cast<std::int64_t>(drawn.size()) == num_drawn && num_drawn < points.rows();
    if (missing == 0 || !has_more) {
      chosen.insert(chosen.end(), repeated.begin(), repeated.begin() + missing);
      std::sort(chosen.begin(), chosen.end());
      return chosen;
    }
    num_drawn = std::min(num_drawn + 2 * std::max(missing, num_drawn / 4), points.rows());
    drawn = draw.lowest(num_drawn);
  }
}

template std::vector<std::int64_t> choose_rows(const PointsRef&, std::int64_t, std::uint64_t, int);
template std::vector<std::int64_t> choose_rows(const PointsDoubleRef&, std::int64_t, std::uint64_t, int);

}  // namespace nacre
