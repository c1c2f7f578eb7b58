// Which points of two outlines match.
#include <vector>

#include "base/limits.hpp"
#include "base/random.hpp"
#include "doctest/doctest.h"
#include "outlines/match.hpp"

using namespace nacre;

namespace {

// Points of a grid, many of them as far from one as from another, that end surfaces towards two sides.
std::vector<OutlinePoint> some_outline(std::uint64_t seed, std::size_t count) {
  std::vector<OutlinePoint> outline;
  for (std::size_t i = 0; i < count; ++i) {
    const auto at = [&](std::uint64_t axis) { return 0.01 * static_cast<double>(random_bits(seed + axis, i) % 8); };
    const auto side = static_cast<Eigen::Index>(random_bits(seed + 3, i) % 2);
    outline.push_back({{at(0), at(1), at(2)}, Eigen::Vector3d::UnitZ(), Eigen::Vector3d::Unit(side), 0.01});
  }
  return outline;
}

std::vector<int> nearest_of_all(const std::vector<OutlinePoint>& outline, const std::vector<OutlinePoint>& others,
                                double gate) {
  std::vector<int> nearest;
  for (const OutlinePoint& edge : outline) {
    double least = gate * gate;
    nearest.push_back(-1);
    for (std::size_t k = 0; k < others.size(); ++k) {
      const double squared = (others[k].point - edge.point).squaredNorm();
      if (!(squared < least) || others[k].outward.dot(edge.outward) < base_limits::same_surface_cosine) continue;
      least = squared;
      nearest.back() = static_cast<int>(k);
    }
  }
  return nearest;
}

}  // namespace

TEST_CASE("an outline's point matches the nearest of its kind, of equals the first") {
  const std::vector<OutlinePoint> outline = some_outline(1, 300), others = some_outline(10, 400);
  for (const double gate : {0.005, 0.015, 0.1}) {
    const std::vector<int> nearest = nearest_edges(outline, others, gate, 1);
    CHECK(nearest == nearest_of_all(outline, others, gate));
    CHECK(nearest == nearest_edges(outline, others, gate, 3));
  }
  CHECK(nearest_edges(outline, {}, 0.1, 1) == std::vector<int>(outline.size(), -1));
}
