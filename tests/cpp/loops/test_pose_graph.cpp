#include <cmath>
#include <utility>

#include "base/numbers.hpp"
#include "base/random.hpp"
#include "base/se3.hpp"
#include "doctest/doctest.h"
#include "loops/pose_graph.hpp"

using namespace nacre;

namespace {

Vector6 random_twist(std::uint64_t seed, double size) {
  Vector6 twist;
  for (int i = 0; i < 6; ++i) twist[i] = size * random_normal(seed, static_cast<std::uint64_t>(i));
  return twist;
}

Matrix6 information(double sigma) { return Matrix6::Identity() / (sigma * sigma); }

// A camera that looks outward on a circle of radius 1 m.
Pose on_circle(int k, int count) {
  Pose turn = Pose::Identity(), out = Pose::Identity();
  turn.linear() = Eigen::AngleAxisd(2.0 * pi * k / count, Eigen::Vector3d::UnitY()).toRotationMatrix();
  out.translation().z() = 1.0;
  return turn * out;
}

double distance(const Pose& a, const Pose& b) { return log_motion(a.inverse() * b).norm(); }

constexpr int count = 24;

// Odometry around the circle, each motion wrong by the same twist; the nodes are where it leads.
PoseGraph drifting_circle(const Vector6& drift) {
  PoseGraph graph;
  graph.add_node(on_circle(0, count));
  for (int k = 1; k < count; ++k) {
    const Pose motion = on_circle(k - 1, count).inverse() * on_circle(k, count) * exp_twist(drift);
    graph.add_node(graph.poses().back() * motion);
    graph.add_edge({k - 1, k, motion, information(0.01), false});
  }
  return graph;
}

PoseEdge true_loop(int from, int to) {
  return {from, to, on_circle(from, count).inverse() * on_circle(to, count), information(0.0001), true};
}

Vector6 turn_drift() {  // 1 degree about the vertical and 5 mm forward at each step
  Vector6 drift = Vector6::Zero();
  drift[1] = pi / 180.0;
  drift[5] = 0.005;
  return drift;
}

}  // namespace

TEST_CASE("exp and log of a motion are inverse, near no turn and near half a turn") {
  for (const double size : {0.0, 1e-9, 1e-4, 0.3, 1.2}) {
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
      const Vector6 twist = random_twist(seed, size);
      if (twist.head<3>().norm() > 3.1) continue;
      CHECK((log_motion(exp_twist(twist)) - twist).norm() < 1e-9);
      const Pose pose = exp_twist(random_twist(seed + 100, 0.5));
      const Pose left = exp_twist(adjoint(pose) * twist) * pose, right = pose * exp_twist(twist);
      CHECK((left.matrix() - right.matrix()).norm() < 1e-9);
    }
  }
}

TEST_CASE("a drifting circle closes, and the drift is shared out evenly") {
  PoseGraph graph = drifting_circle(turn_drift());
  const double gap = distance(graph.poses()[count - 1], on_circle(count - 1, count));
  REQUIRE(gap > 0.3);
  graph.add_edge(true_loop(0, count - 1));
  const PoseGraphFit fit = graph.optimise();
  CHECK(fit.converged);
  CHECK(fit.weights.back() == doctest::Approx(1.0).epsilon(0.2));
  CHECK(distance(graph.poses()[count - 1], on_circle(count - 1, count)) < 0.002 * gap);
  CHECK(graph.poses()[0].matrix() == on_circle(0, count).matrix());
  double least = 1e9, most = 0.0;
  for (int k = 1; k < count; ++k) {
    const PoseEdge& edge = graph.edges()[static_cast<std::size_t>(k - 1)];
    const double error = distance(graph.poses()[static_cast<std::size_t>(k - 1)] * edge.from_from_to,
                                  graph.poses()[static_cast<std::size_t>(k)]);
    least = std::min(least, error);
    most = std::max(most, error);
  }
  CHECK(most < 1.6 * least);
  // Every pose is nearer to the truth than before.
  const PoseGraph before = drifting_circle(turn_drift());
  for (std::size_t k = 6; k < count; ++k) {
    CHECK(distance(graph.poses()[k], on_circle(static_cast<int>(k), count)) <
          0.7 * distance(before.poses()[k], on_circle(static_cast<int>(k), count)));
  }
}

TEST_CASE("measurements without error are met exactly from a bad start") {
  PoseGraph graph;
  graph.add_node(on_circle(0, count));
  for (int k = 1; k < count; ++k) {
    graph.add_node(on_circle(k, count) * exp_twist(random_twist(static_cast<std::uint64_t>(k), 0.2)));
    graph.add_edge({k - 1, k, on_circle(k - 1, count).inverse() * on_circle(k, count), information(0.01), false});
  }
  graph.add_edge(true_loop(0, count - 1));
  CHECK(graph.optimise().converged);
  for (int k = 0; k < count; ++k)
    CHECK(distance(graph.poses()[static_cast<std::size_t>(k)], on_circle(k, count)) < 1e-8);
}

TEST_CASE("wrong loops are left out, whether other loops contradict them or the odometry alone") {
  for (const auto& [from, to] : {std::pair(0, count - 2), std::pair(3, 15)}) {
    PoseGraph graph = drifting_circle(turn_drift());
    PoseEdge wrong = true_loop(from, to);
    wrong.from_from_to = wrong.from_from_to * exp_twist(random_twist(7, 0.5));
    graph.add_edge(true_loop(0, count - 1));
    graph.add_edge(wrong);
    graph.add_edge(true_loop(1, count - 2));
    const PoseGraphFit fit = graph.optimise();
    CHECK(fit.weights[count - 1] == 1.0);
    CHECK(fit.weights[count] == 0.0);
    CHECK(fit.weights[count + 1] == 1.0);
    CHECK(fit.largest_error < 5.0);
    CHECK(distance(graph.poses()[count - 1], on_circle(count - 1, count)) < 0.002);
  }
}

TEST_CASE("without any loop that fits, the nodes stay where the odometry leads") {
  PoseGraph graph = drifting_circle(turn_drift());
  const std::vector<Pose> before = graph.poses();
  PoseEdge wrong = true_loop(3, 15);
  wrong.from_from_to = wrong.from_from_to * exp_twist(random_twist(7, 0.5));
  graph.add_edge(wrong);
  CHECK(graph.optimise().weights.back() == 0.0);
  for (std::size_t k = 0; k < count; ++k) CHECK(distance(graph.poses()[k], before[k]) < 1e-9);
}

TEST_CASE("fixed nodes stay where they are") {
  PoseGraph graph;
  graph.add_node(on_circle(0, count));
  graph.add_node(on_circle(1, count) * exp_twist(random_twist(1, 0.1)));
  graph.add_node(on_circle(2, count), true);
  for (int k = 1; k < 3; ++k) {
    graph.add_edge({k - 1, k, on_circle(k - 1, count).inverse() * on_circle(k, count), information(0.01), false});
  }
  graph.optimise();
  CHECK(graph.poses()[2].matrix() == on_circle(2, count).matrix());
  CHECK(distance(graph.poses()[1], on_circle(1, count)) < 1e-8);
}

TEST_CASE("directions that a loop does not know stay as the odometry has them") {
  Vector6 climb = Vector6::Zero();
  climb[4] = 0.005;
  PoseGraph graph = drifting_circle(climb);
  PoseEdge loop = true_loop(0, count - 1);
  Matrix6 known = Matrix6::Zero();
  known.topLeftCorner<3, 3>() = information(0.0001).topLeftCorner<3, 3>();  // the rotation alone
  loop.information = known;
  graph.add_edge(loop);
  CHECK(graph.optimise().converged);
  const Vector6 rest = log_motion(on_circle(count - 1, count).inverse() * graph.poses()[count - 1]);
  CHECK(rest.head<3>().norm() < 1e-3);
  CHECK(rest.tail<3>().norm() == doctest::Approx(0.005 * (count - 1)).epsilon(0.01));
}
