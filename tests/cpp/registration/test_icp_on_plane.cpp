#include <cmath>

#include "clouds.hpp"
#include "doctest/doctest.h"
#include "registration/icp.hpp"

using namespace nacre;

TEST_CASE("a source that moves on a plane finds its turn and shifts, and leaves the plane for nothing") {
  const OrientedCloud target = asymmetric_cloud(2000, 3);
  Pose truth = Pose::Identity();
  truth.linear() = Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  truth.translation() << 0.004, -0.006, 0.0;
  const OrientedCloud source = moved(target, truth.inverse());
  const AlignOptions options;
  const TwistBasis directions = motions_on_plane(Eigen::Vector3d::UnitZ());
  const IcpTarget to(AlignCloud(target.points, target.normals), options);
  const auto found = [&](const OrientedCloud& cloud) {
    return align_along(directions, to, IcpSource(AlignCloud(cloud.points, cloud.normals), options), Pose::Identity(),
                       options)
        .target_from_source;
  };
  CHECK((found(source).matrix() - truth.matrix()).norm() < 1e-4);
  Pose lifted = truth;
  lifted.translation().z() = 0.003;
  const Pose held = found(moved(target, lifted.inverse()));
  CHECK(std::abs(held.translation().z()) < 1e-9);
  CHECK((held.linear().col(2) - Eigen::Vector3d::UnitZ()).norm() < 1e-9);
}
