#include <cmath>
#include <limits>
#include <vector>

#include "base/random.hpp"
#include "depth_images.hpp"
#include "doctest/doctest.h"
#include "fusion/block_index.hpp"
#include "fusion/fuse.hpp"
#include "tracking/points_in_view.hpp"

using namespace nacre;
using namespace nacre_test;

namespace {

const Camera& camera() {
  static const Camera pinhole = Camera::pinhole(160, 120, 140.0, 150.0, 75.0, 62.0);
  return pinhole;
}

double number(std::uint64_t i) { return static_cast<double>(random_bits(7, i) % 1000000) / 1e6; }

Pose some_pose(std::uint64_t i) {
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::AngleAxisd(0.8 * number(3 * i), Eigen::Vector3d(number(3 * i + 1), 1.0, 0.3).normalized())
                      .toRotationMatrix();
  pose.translation() =
      Eigen::Vector3d(number(5 * i), number(5 * i + 1), number(5 * i + 2)) - 0.5 * Eigen::Vector3d::Ones();
  return pose;
}

// A wall before the camera, and points in threes of hundreds all around it: before and behind the wall, beside the
// image, and behind the camera.
PointModel surroundings(const Frame& wall) {
  PointModel model;
  fuse(model, wall, camera(), Pose::Identity(), 0.03, 0);
  for (std::uint64_t group = 0; group < 60; ++group) {
    const Eigen::Vector3d middle =
        5.0 * Eigen::Vector3d(number(900 + 3 * group), number(901 + 3 * group), number(902 + 3 * group)) -
        2.5 * Eigen::Vector3d::Ones();
    for (std::uint64_t i = 0; i < 300; ++i) {
      const std::uint64_t k = 1000 * (group + 2) + 3 * i;
      model.points.emplace_back(
          (middle + 0.4 * Eigen::Vector3d(number(k), number(k + 1), number(k + 2))).cast<float>());
      model.normals.emplace_back(-Eigen::Vector3f::UnitZ());
      model.confidence.push_back(1.0F);
      model.last_seen.push_back(static_cast<std::int32_t>(group % 4));
      model.observations.push_back(static_cast<std::uint8_t>(1 + group % 5));
      model.free_space_violations.push_back(2);
    }
  }
  return model;
}

void check_same(const PointModel& a, const PointModel& b) {
  CHECK(a.points == b.points);
  CHECK(a.normals == b.normals);
  CHECK(a.confidence == b.confidence);
  CHECK(a.last_seen == b.last_seen);
  CHECK(a.observations == b.observations);
  CHECK(a.free_space_violations == b.free_space_violations);
}

}  // namespace

TEST_CASE("a volume holds every point that the camera sees") {
  const Camera cameras[] = {camera(), Camera::orthographic(160, 120, 0.01),
                            Camera::pinhole(160, 120, -140.0, 150.0, 75.0, 62.0),
                            Camera::pinhole(160, 120, 140.0, 150.0, 75.0, 62.0, {0.1, 0.02})};
  for (const Camera& one : cameras) {
    int num_inside = 0, num_outside = 0;
    for (std::uint64_t i = 0; i < 20000; ++i) {
      const Pose pose = some_pose(i % 50);
      const Eigen::Vector3f point =
          (6.0 * Eigen::Vector3d(number(i), number(i + 30000), number(i + 60000)) - 3.0 * Eigen::Vector3d::Ones())
              .cast<float>();
      const Eigen::Vector3d seen = pose.inverse() * point.cast<double>();
      const Eigen::Vector2d pixel = one.project(seen);
      const bool is_seen =
          pixel.x() >= -0.5 && pixel.x() <= 159.5 && pixel.y() >= -0.5 && pixel.y() <= 119.5 && seen.z() < 2.0;
      const bool may_be = ViewVolume(one, pose, 0.0, 0.0, 2.0).may_hold(Box(point, point));
      num_inside += static_cast<int>(is_seen);
      num_outside += static_cast<int>(!may_be);
      if (is_seen) REQUIRE(may_be);
    }
    CHECK(num_inside > 150);
    CHECK(num_outside > 8000);
  }
}

TEST_CASE("what a frame cannot see is left out, and nothing else changes by a bit") {
  const Frame wall = make_frame(render(camera(), slanted_plane(1.5, 0.2, 0.1)), camera(), NoiseModel{0.002, 0.0, 0.0});
  const PointModel before = surroundings(wall);
  const FusionOptions options;
  SurfaceObserver observer(camera(), options);
  observer.look_at(wall, Colors(), 2);
  for (std::uint64_t i = 0; i < 12; ++i) {
    const Pose pose = i == 0 ? Pose::Identity() : some_pose(i);
    const RegisteredFrame now{wall, camera(), observer, pose, 5};
    PointModel culled = before, whole = before;
    BlockIndex blocks(culled), all = BlockIndex::unbounded(whole);
    CHECK(blocks.in_view(observed_volume(now, options, 0.03)).size() < blocks.from(0).size());
    const FusionReport a = fuse_observed(culled, blocks, now, 0.03, options, 2, {});
    const FusionReport b = fuse_observed(whole, all, now, 0.03, options, 2, {});
    CHECK(a.num_updated == b.num_updated);
    CHECK(a.num_removed == b.num_removed);
    CHECK(a.num_inserted + a.num_updated > 0);
    check_same(culled, whole);

    // The index has followed: it finds what one of the model as it is now finds.
    const BlockIndex renewed = BlockIndex::unbounded(culled);
    const PointsInView x = points_in_view(culled, blocks, camera(), pose, 2, 2);
    const PointsInView y = points_in_view(culled, renewed, camera(), pose, 2, 2);
    CHECK(x.points == y.points);
    CHECK(x.points.rows() > 0);
  }
}

TEST_CASE("blocks that have become small become one") {
  PointModel model =
      surroundings(make_frame(render(camera(), slanted_plane(1.5, 0.2, 0.1)), camera(), NoiseModel{0.002, 0.0, 0.0}));
  BlockIndex blocks(model);
  std::vector<std::uint8_t> flags(model.points.size(), 0);
  for (std::size_t i = 0; i < flags.size(); i += 10) flags[i] = 1;
  const std::size_t num_blocks = blocks.from(0).size();
  model.keep(flags);
  blocks.keep(flags);
  const std::vector<PointRange> left = blocks.from(0);
  CHECK(left.size() < num_blocks / 5);
  CHECK(left.back().first + static_cast<std::size_t>(left.back().count) == model.points.size());
}
