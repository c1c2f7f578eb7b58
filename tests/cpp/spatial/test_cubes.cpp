#include <algorithm>
#include <set>
#include <stdexcept>

#include "base/random.hpp"
#include "doctest/doctest.h"
#include "nacre/cubes.hpp"

namespace {

using namespace nacre;

PointsDouble scattered(int count) {
  PointsDouble points(count, 3);
  for (Eigen::Index i = 0; i < points.size(); ++i)
    points.data()[i] = static_cast<float>(random_uniform(3, static_cast<std::uint64_t>(i))) * 10;
  return points;
}

}  // namespace

TEST_CASE("a hash depends on the place alone") {
  const PointsDouble points = scattered(1000);
  const auto hashes = point_hashes(points, 0);
  CHECK(point_hashes(Points(points.cast<float>()), 0) == hashes);
  CHECK(point_hashes(points, 0, 1) == hashes);
  CHECK(std::set<std::uint64_t>(hashes.begin(), hashes.end()).size() == hashes.size());
  CHECK(point_hashes(points, 1) != hashes);
  CHECK(point_hashes(PointsDouble::Constant(1, 3, -0.0), 0) == point_hashes(PointsDouble::Zero(1, 3), 0));
}

TEST_CASE("cubes are counted along z, then y, then x; what lies outside is of the nearest") {
  const CubeGrid grid{{-1, 0, 0}, 2, {3, 4, 5}};
  PointsDouble points(4, 3);
  points << -1, 0, 0, 1, 2, 2, 4.9, 7.9, 9.9, 1e30, -1e30, 3;
  CHECK(cube_numbers(points, grid) == std::vector<std::int64_t>{0, 1 * 20 + 1 * 5 + 1, 2 * 20 + 3 * 5 + 4, 2 * 20 + 1});
  CHECK_THROWS_AS(cube_numbers(points, {{0, 0, 0}, 0, {1, 1, 1}}), std::invalid_argument);
  CHECK_THROWS_AS(cube_numbers(points, {{0, 0, 0}, 1, {1, 0, 1}}), std::invalid_argument);
  const std::int64_t many = std::int64_t{1} << 31;
  CHECK_THROWS_AS(cube_numbers(points, {{0, 0, 0}, 1, {many, many, 2}}), std::invalid_argument);
}

TEST_CASE("rows are grouped by number as a stable sort groups them") {
  std::vector<std::int64_t> numbers;
  for (std::uint64_t i = 0; i < 20000; ++i) numbers.push_back(static_cast<std::int64_t>(random_bits(5, i / 2) % 3000));
  const NumberGroups groups = group_by_number(numbers.data(), static_cast<std::int64_t>(numbers.size()));
  std::vector<std::int64_t> rows(numbers.size());
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = static_cast<std::int64_t>(i);
  const auto number = [&](std::int64_t row) { return numbers[static_cast<std::size_t>(row)]; };
  std::stable_sort(rows.begin(), rows.end(), [&](std::int64_t a, std::int64_t b) { return number(a) < number(b); });
  CHECK(groups.rows == rows);
  CHECK(std::is_sorted(groups.numbers.begin(), groups.numbers.end()));
  for (std::size_t i = 0; i < groups.numbers.size(); ++i)
    CHECK(groups.counts[i] == std::count(numbers.begin(), numbers.end(), groups.numbers[i]));
  CHECK(group_by_number(nullptr, 0).rows.empty());
}

TEST_CASE("each stretch is in the order of its hashes, by any number of threads") {
  std::vector<std::uint64_t> hashes;
  for (std::uint64_t i = 0; i < 5000; ++i) hashes.push_back(random_bits(7, i / 3));  // some are equal
  const auto count = static_cast<std::int64_t>(hashes.size());
  const std::vector<std::int64_t> starts = {0, 0, 1, 4000, count};
  const HashOrder order = order_by_hash(starts, hashes.data(), count, 1);
  for (std::size_t stretch = 0; stretch + 1 < starts.size(); ++stretch) {
    for (std::int64_t i = starts[stretch]; i < starts[stretch + 1]; ++i) {
      const auto here = static_cast<std::size_t>(i);
      CHECK(order.rows[here] >= starts[stretch]);
      CHECK(order.rows[here] < starts[stretch + 1]);
      CHECK(order.hashes[here] == hashes[static_cast<std::size_t>(order.rows[here])]);
      if (i == starts[stretch]) continue;
      const bool ascends = order.hashes[here - 1] < order.hashes[here];
      CHECK((ascends || (order.hashes[here - 1] == order.hashes[here] && order.rows[here - 1] < order.rows[here])));
    }
  }
  CHECK(order_by_hash(starts, hashes.data(), count, 4).rows == order.rows);
  CHECK_THROWS_AS(order_by_hash({0, count - 1}, hashes.data(), count), std::invalid_argument);
  CHECK_THROWS_AS(order_by_hash({0, 3, 2, count}, hashes.data(), count), std::invalid_argument);
}
