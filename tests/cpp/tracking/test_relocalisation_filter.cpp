#include "clouds.hpp"
#include "doctest/doctest.h"
#include "tracking/relocalisation_filter.hpp"

using namespace nacre;

namespace {

constexpr double depth = 0.5;

// Object from a camera that looks at it from a distance and was turned around it by an angle [rad].
Pose camera_at(double angle) {
  Pose back = Pose::Identity(), turn = Pose::Identity();
  back.translation().z() = -depth;
  turn.linear() = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()).toRotationMatrix();
  return turn * back;
}

Pose motion(double from, double to) { return camera_at(from).inverse() * camera_at(to); }

TrackingResult found_at(const Pose& pose, double relocalisation_score) {
  TrackingResult result;
  result.alignment.target_from_source = pose;
  result.alignment.weak_directions.resize(6, 0);
  result.relocalisation_score = relocalisation_score;
  return result;
}

// The number of the first frame of a camera that turns by a step each time, and is found with a relocalisation_score,
// at which the place is believed; -1: never.
int believed_at(double step, double relocalisation_score, const Pose& error = Pose::Identity(), int num_frames = 12) {
  PlaceHypothesis hypothesis;
  for (int i = 0; i < num_frames; ++i) {
    hypothesis.predict(motion((i - 1) * step, i * step));
    Pose pose = camera_at(i * step);
    if (i % 2 == 1) pose = error * pose;
    if (hypothesis.add(found_at(pose, relocalisation_score), depth)) return i;
  }
  return -1;
}

}  // namespace

TEST_CASE("a place is believed at once where one view says enough") { CHECK(believed_at(0.03, 1.5) == 0); }

TEST_CASE("where nothing led there, one view must say more") {
  TrackingResult found = found_at(camera_at(0.0), 1.5);
  found.expectation = Expectation::unexpected;
  CHECK_FALSE(PlaceHypothesis().add(found, depth));
  found.relocalisation_score = 2.1;
  CHECK(PlaceHypothesis().add(found, depth));
}

TEST_CASE("a place is believed when several views have said enough, the sooner the more they differ") {
  const int slow = believed_at(0.03, 0.65), fast = believed_at(0.1, 0.65);
  CHECK(fast >= 1);
  CHECK(slow > fast);
}

TEST_CASE("a camera that does not move says the same again and again") {
  CHECK(believed_at(0.0, 1.2, Pose::Identity(), 40) == -1);
}

TEST_CASE("what chance reaches is never believed") { CHECK(believed_at(0.1, 0.29) == -1); }

TEST_CASE("a place that does not move with the camera is not believed") {
  Pose error = Pose::Identity();
  error.translation().x() = 0.05;
  CHECK(believed_at(0.03, 0.7, error) == -1);
}

TEST_CASE("the prediction is the place moved as the frames say") {
  PlaceHypothesis hypothesis;
  CHECK_FALSE(hypothesis.predict(motion(0.0, 0.1)).has_value());
  hypothesis.add(found_at(camera_at(0.0), 0.7), depth);
  const std::optional<Pose> predicted = hypothesis.predict(motion(0.0, 0.1));
  REQUIRE(predicted.has_value());
  CHECK((predicted->matrix() - camera_at(0.1).matrix()).norm() < 1e-9);
  hypothesis.forget();
  CHECK_FALSE(hypothesis.predict(motion(0.1, 0.2)).has_value());
}

TEST_CASE("a place is given up where the camera cannot be followed") {
  PlaceHypothesis hypothesis;
  hypothesis.add(found_at(camera_at(0.0), 0.7), depth);
  CHECK_FALSE(hypothesis.predict(std::nullopt).has_value());
  CHECK_FALSE(hypothesis.predict(motion(0.0, 0.1)).has_value());
}

TEST_CASE("normals tell about each other where the surface turns, and nothing on a plane") {
  std::vector<Pair> curved, flat, unrelated;
  const OrientedCloud sphere = sphere_cloud(500, 2);
  for (int i = 0; i < 500; ++i) {
    const auto noise = [&](std::uint64_t seed) {
      return Eigen::Vector3d(0.05 * random_direction(seed, static_cast<std::uint64_t>(i)));
    };
    const auto pair = [&](const Eigen::Vector3d& source, const Eigen::Vector3d& target) {
      const Eigen::Vector3d p = sphere.points.row(i).transpose().cast<double>();
      return Pair{p, p, 0.5 * (source + target), 0.5 * (source - target), 1.0};
    };
    const auto normal = [&](int k) { return Eigen::Vector3d(sphere.normals.row(k).transpose().cast<double>()); };
    curved.push_back(pair(normal(i) + noise(3), normal(i) + noise(4)));
    flat.push_back(pair(Eigen::Vector3d::UnitZ() + noise(3), Eigen::Vector3d::UnitZ() + noise(4)));
    unrelated.push_back(pair(normal(i), normal((i + 250) % 500)));
  }
  CHECK(normal_information(curved, Metric::symmetric) > 3.0);
  CHECK(normal_information(flat, Metric::symmetric) < 0.1);
  CHECK(normal_information(unrelated, Metric::symmetric) < 0.2);
  CHECK(normal_information({}, Metric::symmetric) == 0.0);
}
