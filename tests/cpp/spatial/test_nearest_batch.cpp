#include <cmath>
#include <limits>
#include <vector>

#include "base/random.hpp"
#include "doctest/doctest.h"
#include "spatial/nearest_batch.hpp"

namespace {

using namespace nacre;

constexpr double inf = std::numeric_limits<double>::infinity();

struct Cloud {
  std::vector<float> x, y, z;

  explicit Cloud(std::size_t count, std::uint64_t seed, float scale = 1.0F) : x(count), y(count), z(count) {
    for (std::size_t i = 0; i < count; ++i) {  // on the walls of a box
      const auto coordinate = [&](std::uint64_t axis) {
        return scale * static_cast<float>(random_uniform(seed, 4 * i + axis));
      };
      x[i] = coordinate(0);
      y[i] = coordinate(1);
      z[i] = i % 2 == 0 ? 0.0F : 0.01F * coordinate(2);
    }
  }
  std::vector<float> rows() const {
    std::vector<float> all;
    for (std::size_t i = 0; i < x.size(); ++i) all.insert(all.end(), {x[i], y[i], z[i]});
    return all;
  }
};

// Answers that must not depend on how the queries are cut into parts, nor on the slots that come in.
void check(const Cloud& points, const Cloud& queries, double max_distance) {
  const std::vector<float> rows = points.rows();
  const BlockTree<float> tree(rows.data(), static_cast<std::int64_t>(points.x.size()), 2);
  const auto count = static_cast<std::int64_t>(queries.x.size());
  std::vector<std::uint32_t> slots(queries.x.size(), no_slot);
  std::vector<float> d2(queries.x.size()), next(queries.x.size());
  for (const std::int64_t part : {count, std::int64_t{1}, std::int64_t{7}, count}) {
    CAPTURE(part);
    const NearestPoints batch = {queries.x.data(), queries.y.data(), queries.z.data(),
                                 slots.data(),     d2.data(),        next.data()};
    for (std::int64_t begin = 0; begin < count; begin += part) {
      find_nearest_points(tree, batch, begin, std::min(count, begin + part), max_distance);
    }
    std::int64_t wrong = 0;
    for (std::size_t i = 0; i < queries.x.size(); ++i) {
      float least = std::numeric_limits<float>::infinity(), second = least;
      std::uint32_t nearest = no_slot;
      for (std::uint32_t slot = 0; slot < tree.num_points(); ++slot) {
        const Eigen::Vector3f p = tree.position(slot).cast<float>();
        const float dx = queries.x[i] - p.x(), dy = queries.y[i] - p.y(), dz = queries.z[i] - p.z();
        const float distance = dx * dx + dy * dy + dz * dz;
        second = std::min(second, std::max(least, distance));
        if (!(distance < least)) continue;
        least = distance;
        nearest = slot;
      }
      if (!(least <= static_cast<float>(max_distance * max_distance))) {
        wrong += slots[i] != no_slot || std::isfinite(d2[i]);
        continue;
      }
      wrong += slots[i] != nearest || d2[i] != least || next[i] < least || next[i] > second * 1.00001F;
    }
    CHECK(wrong == 0);
    for (std::size_t i = 0; i < slots.size(); i += 3) slots[i] = (i % 2 == 0 || tree.num_points() == 0) ? no_slot : 0;
  }
}

}  // namespace

TEST_CASE("the nearest point in float, however the queries are cut") {
  for (const std::size_t count : {std::size_t{0}, std::size_t{1}, std::size_t{17}, std::size_t{3000}}) {
    CAPTURE(count);
    for (const double max_distance : {inf, 0.02}) {
      check(Cloud(count, 1), Cloud(300, 2), max_distance);
      check(Cloud(count, 1), Cloud(40, 3, 50.0F), max_distance);
    }
  }
}

TEST_CASE("many points in one place") {
  Cloud points(3000, 4);
  for (std::size_t i = 0; i < 2000; ++i) points.x[i] = points.y[i] = points.z[i] = 0.5F;
  Cloud queries(50, 5);
  queries.x[7] = queries.y[7] = queries.z[7] = 0.5F;
  check(points, queries, inf);
}

TEST_CASE("queries whose squared distances are no floats find nothing outside of the tree") {
  const Cloud points(50, 1);
  const std::vector<float> rows = points.rows();
  const BlockTree<float> tree(rows.data(), 50, 1);
  constexpr auto infinite = std::numeric_limits<float>::infinity();
  for (const float far : {1e30F, -1e30F, infinite, -infinite, std::numeric_limits<float>::quiet_NaN()}) {
    const std::vector<float> place(3, far);
    std::vector<std::uint32_t> slots(3, no_slot);
    std::vector<float> d2(3), next(3);
    find_nearest_points(tree, {place.data(), place.data(), place.data(), slots.data(), d2.data(), next.data()}, 0, 3,
                        inf);
    for (const std::uint32_t slot : slots) CHECK((slot == no_slot || slot < 50));
  }
}
