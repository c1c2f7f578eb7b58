#include "base/point_rows.hpp"
#include "base/se3.hpp"
#include "camera/view_distance.hpp"
#include "depth_images.hpp"
#include "doctest/doctest.h"
#include "tracking/frame_odometry.hpp"
#include "tracking/limits.hpp"

using namespace nacre;
using namespace nacre_test;

namespace {

using Relief = double (*)(double x, double y);  // z [m] of a surface, in the world

double hills(double x, double y) { return 1.0 + 0.06 * std::sin(7.0 * x + 1.0) * std::cos(9.0 * y) + 0.05 * x * y; }
double wall(double, double) { return 1.0; }

// A camera that goes to the right by some centimetres a step, and turns a little.
Pose camera_at(int step) {
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::AngleAxisd(0.01 * step, Eigen::Vector3d::UnitY()).toRotationMatrix();
  pose.translation().x() = 0.03 * step;
  return pose;
}

DepthImage seen_from(const Pose& world_from_camera, Relief relief) {
  DepthImage depth(height, width);
  for (Eigen::Index i = 0; i < depth.size(); ++i) {
    const Ray ray = ray_of(pinhole, i);
    const Eigen::Vector3d along =
        world_from_camera.linear() * Eigen::Vector3d(ray.direction_x, ray.direction_y, ray.direction_z);
    const Eigen::Vector3d& origin = world_from_camera.translation();
    double z = 1.0;
    for (int k = 0; k < 50; ++k) {
      const Eigen::Vector3d p = origin + z * along;
      z = (relief(p.x(), p.y()) - origin.z()) / along.z();
    }
    depth.data()[i] = static_cast<float>(z);
  }
  return depth;
}

struct Camcorder {
  FrameOdometry odometry;

  void see(const Pose& world_from_camera, Relief relief, bool is_followed = true) {
    const Frame frame = make_frame(seen_from(world_from_camera, relief), pinhole, NoiseModel{0.001, 0.0});
    const TrackingOptions options;
    const Points points = take_rows<Points>(frame.points, frame.valid);
    const Points normals = take_rows<Points>(frame.normals, frame.valid);
    const IcpSource source(AlignCloud(points, normals), options.registration);
    odometry.look_at(source);
    if (is_followed)
      odometry.follow(source, CoarseFrame(frame, pinhole, MaskImage()), {frame.points.col(2), frame.sigma}, pinhole,
                      0.01, std::nullopt, options);
  }
  void see_and_register(int step, Relief relief) {
    see(camera_at(step), relief);
    odometry.end_frame(FrameStatus::tracked, camera_at(step), {});
  }
  void lose() { odometry.end_frame(FrameStatus::lost, Pose::Identity(), {}); }
};

Pose moved_by(const Pose& pose, const Eigen::Vector3d& shift) {
  Pose moved = pose;
  moved.translation() += shift;
  return moved;
}

Pose turned_by(const Pose& pose, double angle, const Eigen::Vector3d& axis) {
  Pose turned = pose;
  turned.linear() = Eigen::AngleAxisd(angle, axis).toRotationMatrix() * pose.linear();
  return turned;
}

}  // namespace

TEST_CASE("a lost camera is followed from where it was registered, and is less sure with every frame") {
  const Eigen::Vector3d aside(0.06, 0.0, 0.0);
  Camcorder camera;
  camera.see_and_register(0, hills);
  camera.see_and_register(1, hills);
  for (int step = 2; step < 10; ++step) {
    CAPTURE(step);
    camera.see(camera_at(step), hills);
    const auto place = camera.odometry.place();
    REQUIRE(place.has_value());
    CHECK(place->is_determined);
    CHECK(view_distance(place->world_from_camera, camera_at(step), 1.0) < 0.1);
    CHECK(camera.odometry.allows(camera_at(step), tracking_limits::least_new_view));
    // Steps of 0.03 of the depth, a quarter of which they may err.
    CHECK(camera.odometry.allows(moved_by(place->world_from_camera, aside), 0.0) == (0.03 * 0.25 * (step - 1) > 0.06));
    camera.lose();
  }
  CHECK(camera.odometry.place() == std::nullopt);  // of the next frame nothing is known yet
}

TEST_CASE("it can have come to what is near, and not to what is far") {
  Camcorder camera;
  camera.see_and_register(0, hills);
  CHECK(camera.odometry.allows(camera_at(100)));  // before anything is followed it may be anywhere
  camera.see(camera_at(1), hills);
  CHECK(camera.odometry.allows(camera_at(1)));
  CHECK(camera.odometry.allows(camera_at(4)));
  CHECK_FALSE(camera.odometry.allows(camera_at(10)));
  CHECK_FALSE(camera.odometry.allows(turned_by(camera_at(1), pi, Eigen::Vector3d::UnitY())));
}

TEST_CASE("along a wall it may have gone, or turned, as far as it ever did in a frame, but looks the same way") {
  Camcorder camera;
  camera.see_and_register(0, hills);
  camera.see_and_register(3, hills);  // 0.09 m: 0.6 of a view distance
  camera.see_and_register(3, wall);
  camera.see(camera_at(3), wall);
  REQUIRE(camera.odometry.place().has_value());
  CHECK_FALSE(camera.odometry.place()->is_determined);
  CHECK_FALSE(camera.odometry.motion().has_value());
  CHECK(camera.odometry.allows(moved_by(camera_at(3), {0.08, 0.0, 0.0}), 0.0));
  CHECK_FALSE(camera.odometry.allows(moved_by(camera_at(3), {0.1, 0.0, 0.0}), 0.0));
  CHECK(camera.odometry.allows(turned_by(camera_at(3), 0.11, Eigen::Vector3d::UnitZ()), 0.0));
  CHECK_FALSE(camera.odometry.allows(turned_by(camera_at(3), 0.11, Eigen::Vector3d::UnitY()), 0.0));
}

TEST_CASE("it is unsure of directions that were open when it was registered, unless the frame before tells them") {
  FrameOdometry::WeakDirections along_x = Vector6::Unit(3);
  const auto allows_shift = [&](bool is_followed, FrameStatus next = FrameStatus::lost) {
    Camcorder camera;
    camera.see_and_register(0, hills);
    camera.see_and_register(1, hills);
    camera.see(camera_at(2), hills, is_followed);
    camera.odometry.end_frame(FrameStatus::weak, camera_at(2), along_x);
    camera.see(camera_at(3), hills);
    camera.odometry.end_frame(next, camera_at(3), {});
    camera.see(camera_at(4), hills);
    return camera.odometry.allows(moved_by(camera_at(4), {0.04, 0.0, 0.0}), tracking_limits::least_new_view);
  };
  CHECK(allows_shift(false));
  CHECK_FALSE(allows_shift(true));
  CHECK_FALSE(allows_shift(false, FrameStatus::tracked));
}

TEST_CASE("after a frame that shows nothing, or something else, it may be anywhere") {
  Camcorder nothing, other;
  nothing.see_and_register(0, hills);
  nothing.lose();
  nothing.see(camera_at(1), hills);
  CHECK_FALSE(nothing.odometry.place().has_value());
  CHECK(nothing.odometry.allows(camera_at(100)));

  other.see_and_register(0, hills);
  other.see(camera_at(0), [](double x, double y) { return 2.5 + 0.5 * std::sin(20.0 * x) * std::sin(15.0 * y); });
  CHECK_FALSE(other.odometry.place().has_value());
  CHECK_FALSE(other.odometry.motion().has_value());
}

TEST_CASE("over frames that show nothing it goes on as before, and is not twice as fast as ever") {
  Camcorder camera;
  camera.see_and_register(0, hills);
  camera.see_and_register(1, hills);
  for (int step = 2; step < 5; ++step) {
    camera.lose();
    CAPTURE(step);
    REQUIRE(camera.odometry.predicted().has_value());
    CHECK(view_distance(*camera.odometry.predicted(), camera_at(step + 1), 1.0) < 0.05);
  }
  camera.see(camera_at(5), hills);
  CHECK_FALSE(camera.odometry.place().has_value());
  CHECK(camera.odometry.allows(camera_at(5), 0.0));
  // Steps of 0.03 m, which hands may make longer: 4 of twice 0.25 of 0.15 m.
  CHECK(camera.odometry.allows(moved_by(camera_at(5), {0.0, 0.29, 0.0}), 0.0));
  CHECK_FALSE(camera.odometry.allows(moved_by(camera_at(5), {0.0, 0.31, 0.0}), 0.0));
  CHECK(camera.odometry.allows(turned_by(camera_at(5), 0.39, Eigen::Vector3d::UnitX()), 0.0));
  CHECK_FALSE(camera.odometry.allows(turned_by(camera_at(5), 0.41, Eigen::Vector3d::UnitX()), 0.0));
  camera.lose();
  CHECK_FALSE(camera.odometry.predicted().has_value());  // the last frame was seen
  camera.see(camera_at(6), hills);
  CHECK_FALSE(camera.odometry.place().has_value());  // it tells how it moved, but not from where
  CHECK(camera.odometry.motion().has_value());
  CHECK(camera.odometry.allows(camera_at(6), 0.0));
  CHECK_FALSE(camera.odometry.allows(moved_by(camera_at(6), {0.0, 0.35, 0.0}), 0.0));
}

TEST_CASE("rounding does not grow where frame after frame is placed by the one before") {
  Camcorder camera;
  Pose pose = camera_at(0);
  pose.linear() *= 1.0 + 1e-12;
  for (int step = 0; step < 20; ++step) {
    camera.see(camera_at(0), wall);
    const auto place = camera.odometry.place();
    if (step > 1) REQUIRE(place.has_value());
    if (place) pose = place->world_from_camera;
    camera.odometry.end_frame(FrameStatus::weak, pose, Eigen::Matrix<double, 6, 3>::Identity());
  }
  CHECK((pose.linear() * pose.linear().transpose()).isIdentity(1e-10));
}
