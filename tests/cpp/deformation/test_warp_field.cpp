#include <cmath>

#include "base/random.hpp"
#include "base/se3.hpp"
#include "deformation/warp_field.hpp"
#include "doctest/doctest.h"

using namespace nacre;

namespace {

Eigen::Vector3d random_vector(std::uint64_t seed, double size) {
  return size * Eigen::Vector3d(random_normal(seed, 0), random_normal(seed, 1), random_normal(seed, 2));
}

WarpNode random_node(std::uint64_t seed) {
  const Eigen::Vector3d axis = random_vector(seed, 0.4);
  return {random_vector(seed + 100, 0.2), {}, rotation(axis, axis.norm()), random_vector(seed + 200, 0.2)};
}

Vector6 unit(int k, double size) { return size * Vector6::Unit(k); }

// Four nodes on a square, each moved alike.
WarpField moved_square(const Pose& motion) {
  WarpField field;
  field.node_spacing = 0.1;
  for (const auto& [x, y] : {std::pair(0.0, 0.0), std::pair(0.1, 0.0), std::pair(0.0, 0.1), std::pair(0.1, 0.1)}) {
    const Eigen::Vector3d rest(x, y, 0.5);
    field.nodes.push_back({rest, {}, motion.linear(), motion * rest});
  }
  field.edges = {{0, 1}, {0, 2}, {1, 3}, {2, 3}};
  return field;
}

}  // namespace

TEST_CASE("a binding keeps the nearest nodes, whatever the order in which they come") {
  WarpBinding forward, backward;
  for (int node = 0; node < 8; ++node) forward.offer(node, static_cast<float>((node * 5) % 8));
  for (int node = 7; node >= 0; --node) backward.offer(node, static_cast<float>((node * 5) % 8));
  CHECK(forward.nodes == std::array<std::int32_t, 5>{0, 5, 2, 7, 4});
  CHECK(forward.nodes == backward.nodes);
  CHECK(!forward.offer(3, 9.0F));
  CHECK(forward.offer(4, 0.5F));  // a shorter way to one that it has
  CHECK(forward.nodes == std::array<std::int32_t, 5>{0, 4, 5, 2, 7});
  CHECK(!forward.offer(4, 0.7F));
}

TEST_CASE("weights are a partition of one that fades to 0 at the last node") {
  WarpBinding binding;
  const float distances[] = {0.01F, 0.02F, 0.03F, 0.04F, 0.04F};
  for (int node = 0; node < 5; ++node) binding.offer(node, distances[node]);
  const auto weights = binding.weights(1.0);
  CHECK(weights[0] + weights[1] + weights[2] + weights[3] == doctest::Approx(1.0));
  CHECK(weights[0] / weights[1] == doctest::Approx(9.0 / 4.0));
  CHECK(weights[3] == doctest::Approx(0.0));
}

TEST_CASE("nodes that all move alike move points rigidly, there and back") {
  Vector6 twist;
  twist << 0.3, -0.2, 0.5, 0.1, 0.2, -0.1;
  const Pose motion = exp_twist(twist);
  const WarpField field = moved_square(motion);
  WarpBinding binding;
  for (int node = 0; node < 4; ++node) binding.offer(node, 0.02F * static_cast<float>(node + 1));
  const OrientedPoint rest{{0.03F, 0.05F, 0.52F}, {0.0F, 0.6F, -0.8F}};
  const OrientedPoint moved = warped(field.at(binding), rest);
  CHECK((moved.point.cast<double>() - motion * rest.point.cast<double>()).norm() < 1e-6);
  CHECK((moved.normal.cast<double>() - motion.linear() * rest.normal.cast<double>()).norm() < 1e-6);
  const OrientedPoint back = unwarped(field.at(binding), moved);
  CHECK((back.point - rest.point).norm() < 1e-6F);
  CHECK((back.normal - rest.normal).norm() < 1e-6F);
  CHECK(field.strain() < 1e-12);
}

TEST_CASE("derivatives are those that differences show") {
  constexpr double step = 1e-6;
  const Eigen::Vector3d point = random_vector(7, 0.2), direction = random_vector(8, 1.0).normalized();
  const WarpNode first = random_node(1), second = random_node(2);
  const auto along = [&](const WarpNode& node) {
    return direction.dot(node.rotation * (point - node.rest) + node.position);
  };
  for (int k = 0; k < 6; ++k) {
    WarpNode more = first, less = first;
    move(more, unit(k, step));
    move(less, unit(k, -step));
    CHECK(derivative(first, point, direction)[k] ==
          doctest::Approx((along(more) - along(less)) / (2.0 * step)).epsilon(1e-6));
    const Eigen::Vector3d change = gap_between(more, second).gap - gap_between(less, second).gap;
    CHECK((gap_between(first, second).by_first.col(k) - change / (2.0 * step)).norm() < 1e-6);
  }
}

TEST_CASE("a node that was added later is carried by its parents") {
  Vector6 twist;
  twist << 0.1, 0.2, -0.3, 0.05, 0.0, 0.1;
  const Pose motion = exp_twist(twist);
  WarpField field = moved_square(Pose::Identity());
  WarpNode later{{0.05, 0.05, 0.5}, {}, Eigen::Matrix3d::Identity(), {0.05, 0.05, 0.5}};
  for (int node = 0; node < 4; ++node) later.parents.offer(node, 0.07F);
  field.nodes.push_back(later);
  const NodeStates earlier = moved_square(motion).states();
  const WarpField then = field.as_of(earlier);
  CHECK((then.nodes.back().position - motion * later.rest).norm() < 1e-6);
  CHECK((then.nodes.back().rotation - motion.linear()).norm() < 1e-6);
}

TEST_CASE("the strain is how much edges are longer or shorter") {
  WarpField field = moved_square(Pose::Identity());
  for (WarpNode& node : field.nodes) node.position *= 1.1;
  CHECK(field.strain() == doctest::Approx(0.1));
}
