// Painted walls, seen by two cameras: what both show tells how the camera moved.
#include <cmath>
#include <limits>

#include "base/random.hpp"
#include "base/se3.hpp"
#include "doctest/doctest.h"
#include "keypoints/motion.hpp"

using namespace nacre;

namespace {

const Camera camera = Camera::pinhole(320, 240, 260.0, 260.0, 159.5, 119.5);

// Of a wall: squares of 2 cm, each of a random brightness, and larger ones.
double paint(std::uint64_t seed, double x, double y) {
  const auto square = [&](double size, std::uint64_t more) {
    const auto column = static_cast<std::int64_t>(std::floor(x / size)),
               row = static_cast<std::int64_t>(std::floor(y / size));
    return random_uniform(seed + more, static_cast<std::uint64_t>(column + 1000 * row + 1000000));
  };
  return 255.0 * (0.5 * square(0.02, 0) + 0.5 * square(0.07, 100));
}

// Two walls that meet in a corner: y is free, x > 0 is nearer the more it grows.
DepthView see_walls(const Pose& world_from_camera, std::uint64_t seed = 1) {
  const Eigen::Index count = static_cast<Eigen::Index>(camera.width()) * camera.height();
  DepthView view{Values(count), Values::Constant(count, 1e-3F), world_from_camera};
  view.brightness.resize(static_cast<std::size_t>(count));
  for (int v = 0; v < camera.height(); ++v) {
    for (int u = 0; u < camera.width(); ++u) {
      const Ray ray = camera.ray(u, v);
      const Eigen::Vector3d direction =
          world_from_camera.linear() * Eigen::Vector3d(ray.direction_x, ray.direction_y, ray.direction_z);
      const Eigen::Vector3d from = world_from_camera.translation();
      double nearest = std::numeric_limits<double>::infinity();
      for (const Eigen::Vector3d& normal : {Eigen::Vector3d(0.5, 0.0, 1.0), Eigen::Vector3d(-0.3, 0.1, 1.0)}) {
        const double along = (1.0 - normal.dot(from)) / normal.dot(direction);
        if (along > 0.0) nearest = std::min(nearest, along);
      }
      const Eigen::Vector3d point = from + nearest * direction;
      const Eigen::Index pixel = static_cast<Eigen::Index>(v) * camera.width() + u;
      view.depth[pixel] = static_cast<float>(nearest * ray.direction_z);
      view.brightness[static_cast<std::size_t>(pixel)] = static_cast<std::uint8_t>(paint(seed, point.x(), point.y()));
    }
  }
  return view;
}

Keypoints keypoints_of(const DepthView& view, int num_threads = 1) {
  return find_keypoints(view, camera, 1.0, num_threads);
}

Pose moved(double turn, const Eigen::Vector3d& axis, const Eigen::Vector3d& shift) {
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::AngleAxisd(turn, axis).toRotationMatrix();
  pose.translation() = shift;
  return pose;
}

}  // namespace

TEST_CASE("descriptors differ in so many bits") {
  CHECK(num_differing({0, 0, 0, 0}, {0, 0, 0, 0}) == 0);
  CHECK(num_differing({1, 0, 3, 0}, {0, 0, 0, 1}) == 4);
  CHECK(num_differing({~0ULL, ~0ULL, ~0ULL, ~0ULL}, {0, 0, 0, 0}) == 256);
}

TEST_CASE("the motion between two images is found, however far the camera went") {
  const Keypoints target = keypoints_of(see_walls(Pose::Identity()));
  const std::vector<Pose> motions = {
      moved(0.0, Eigen::Vector3d::UnitZ(), {0.1, 0.05, 0.0}),   // aside
      moved(0.3, Eigen::Vector3d::UnitY(), {0.0, 0.0, 0.0}),    // about itself
      moved(0.7, Eigen::Vector3d::UnitZ(), {0.02, 0.0, 0.0}),   // about what it looks at
      moved(0.0, Eigen::Vector3d::UnitZ(), {0.0, 0.0, 0.3}),    // nearer
      moved(0.0, Eigen::Vector3d::UnitZ(), {0.0, 0.0, -0.4}),   // farther
      moved(0.2, Eigen::Vector3d::UnitX(), {0.0, 0.15, -0.1}),  // all at once
  };
  for (const Pose& motion : motions) {
    const auto found = keypoint_motion(keypoints_of(see_walls(motion)), target, 0, 1);
    REQUIRE(found);
    CHECK(found->num_matches >= 20);
    const Pose rest = motion.inverse() * found->target_from_source;
    CHECK(rest.translation().norm() < 0.01);
    CHECK(angle_between(rest, Pose::Identity()) < 0.01);
  }
}

TEST_CASE("images of different walls have no motion in common") {
  const Keypoints target = keypoints_of(see_walls(Pose::Identity()));
  for (std::uint64_t seed = 2; seed < 8; ++seed) {
    CHECK(!keypoint_motion(keypoints_of(see_walls(Pose::Identity(), 1000 * seed)), target, 0, 1));
  }
}

TEST_CASE("corners are where brightness changes in two directions, and depth is known") {
  DepthView view = see_walls(Pose::Identity());
  for (int v = 0; v < camera.height(); ++v) {
    for (int u = 0; u < camera.width(); ++u) {
      const auto pixel =
          static_cast<std::size_t>(v) * static_cast<std::size_t>(camera.width()) + static_cast<std::size_t>(u);
      view.brightness[pixel] = (u < 160) != (v < 120) ? 200 : 50;  // one corner, and edges
    }
  }
  const Keypoints one = keypoints_of(view);
  REQUIRE(one.points.rows() == 1);
  const Eigen::Vector3f corner = one.points.row(0).transpose();
  CHECK(std::abs(260.0F * corner.x() / corner.z()) < 2.0F);
  CHECK(std::abs(260.0F * corner.y() / corner.z()) < 2.0F);
  view.depth.setConstant(std::numeric_limits<float>::quiet_NaN());
  CHECK(keypoints_of(view).points.rows() == 0);
}

TEST_CASE("images that show nothing have no keypoints") {
  DepthView view = see_walls(Pose::Identity());
  std::fill(view.brightness.begin(), view.brightness.end(), std::uint8_t{90});
  const Keypoints none = keypoints_of(view);
  CHECK(none.points.rows() == 0);
  CHECK(!keypoint_motion(none, none, 0, 1));
  view.brightness.clear();
  CHECK(keypoints_of(view).points.rows() == 0);
  const Camera tiny = Camera::pinhole(2, 2, 2.0, 2.0, 0.5, 0.5);
  const DepthView small{Values::Ones(4), Values::Ones(4), Pose::Identity(), {}, {0, 255, 255, 0}};
  CHECK(find_keypoints(small, tiny, 1.0, 1).points.rows() == 0);
}

TEST_CASE("any number of threads finds the same") {
  const DepthView here = see_walls(Pose::Identity()),
                  there = see_walls(moved(0.1, Eigen::Vector3d::UnitY(), {0.05, 0.0, 0.0}));
  const Keypoints one = keypoints_of(here, 1), three = keypoints_of(here, 3);
  CHECK(one.points == three.points);
  CHECK(one.descriptors == three.descriptors);
  const auto alone = keypoint_motion(keypoints_of(there), one, 0, 1),
             together = keypoint_motion(keypoints_of(there), one, 0, 3);
  REQUIRE(alone);
  REQUIRE(together);
  CHECK(alone->target_from_source.matrix() == together->target_from_source.matrix());
}
