#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "clouds.hpp"
#include "doctest/doctest.h"
#include "nacre/global_registration.hpp"
#include "registration/rotation_grid.hpp"

using namespace nacre;

namespace {

Pose random_motion(std::uint64_t seed) {
  Pose pose = Pose::Identity();
  const double angle = 3.1 * random_uniform(seed, 100);
  pose.linear() = Eigen::AngleAxisd(angle, random_direction(seed, 200)).toRotationMatrix();
  pose.translation() = 2.0 * random_direction(seed, 300);
  return pose;
}

double angle_between(const Pose& a, const Pose& b) {
  return Eigen::AngleAxisd(a.linear().transpose() * b.linear()).angle();
}

GlobalCloud cloud_of(const OrientedCloud& cloud) { return GlobalCloud(cloud.points, cloud.normals); }

GlobalCloud view_of(const OrientedCloud& cloud, const Eigen::Vector3d& viewpoint) {
  return GlobalCloud(cloud.points, cloud.normals, viewpoint);
}

}  // namespace

TEST_CASE("rotations are spread over all: none is farther than 34 degrees from one of 288") {
  double farthest = 0.0;
  for (std::uint64_t i = 0; i < 2000; ++i) {
    const Eigen::Quaterniond wanted = Eigen::Quaterniond(random_normal(1, 4 * i), random_normal(1, 4 * i + 1),
                                                         random_normal(1, 4 * i + 2), random_normal(1, 4 * i + 3))
                                          .normalized();
    double nearest = 10.0;
    for (int k = 0; k < 288; ++k) {
      const Eigen::Quaterniond one = spread_rotation(k, 288);
      CHECK(one.norm() == doctest::Approx(1.0));
      nearest = std::min(nearest, wanted.angularDistance(one));
    }
    farthest = std::max(farthest, nearest);
  }
  CHECK(farthest < 0.6);
}

TEST_CASE("any motion of a whole cloud is found") {
  const OrientedCloud target = asymmetric_cloud(4000, 1), other = asymmetric_cloud(4000, 2);
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    const Pose truth = random_motion(seed);
    const OrientedCloud source = moved(other, truth.inverse());
    const GlobalAlignResult result = align_global(cloud_of(source), cloud_of(target));
    CHECK(result.found());
    CHECK(angle_between(result.alignment.target_from_source, truth) < 0.01);
    CHECK((result.alignment.target_from_source * truth.inverse()).translation().norm() < 0.001);
    CHECK(result.overlap > 0.8);
  }
}

TEST_CASE("two views from sides 90 degrees apart are joined") {
  const OrientedCloud whole = asymmetric_cloud(12000, 1), other = asymmetric_cloud(12000, 2);
  int num_found = 0;
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    const Eigen::Vector3d from = 0.6 * random_direction(seed, 1);
    const Eigen::Vector3d to = 0.6 * from.cross(random_direction(seed, 2)).normalized();
    const Pose truth = random_motion(seed);
    const OrientedCloud source = moved(facing(other, from), truth.inverse()), target = facing(whole, to);
    const GlobalAlignResult result = align_global(view_of(source, truth.inverse() * from), view_of(target, to));
    if (!result.found()) continue;
    ++num_found;
    CHECK(angle_between(result.alignment.target_from_source, truth) < 0.03);
  }
  CHECK(num_found >= 4);
}

TEST_CASE("a sphere fits itself in every direction: ambiguous") {
  const OrientedCloud a = sphere_cloud(3000, 1), b = sphere_cloud(3000, 2);
  CHECK(align_global(cloud_of(a), cloud_of(b)).status == GlobalAlignStatus::ambiguous);
}

TEST_CASE("other surfaces are not accepted") {
  const OrientedCloud thing = asymmetric_cloud(4000, 1), ball = sphere_cloud(4000, 1);
  CHECK_FALSE(align_global(cloud_of(ball), cloud_of(thing)).found());
  CHECK_FALSE(align_global(cloud_of(thing), cloud_of(ball)).found());
}

TEST_CASE("free space tells: a view that the target's viewpoint sees through is not consistent") {
  const OrientedCloud whole = asymmetric_cloud(8000, 1);
  const Eigen::Vector3d from(0.0, 0.0, 0.6);
  const OrientedCloud seen = facing(whole, from);
  // A shield between the viewpoint and what was seen.
  OrientedCloud shielded = seen;
  for (Eigen::Index i = 0; i < shielded.points.rows() / 2; ++i) {
    shielded.points.row(i) += 0.1F * (from.cast<float>().transpose() - shielded.points.row(i)).normalized();
  }
  const GlobalAlignResult clear = align_global(cloud_of(seen), view_of(seen, from));
  const GlobalAlignResult doubtful = align_global(cloud_of(shielded), view_of(seen, from));
  CHECK(clear.found());
  CHECK(clear.consistency > 0.95);
  CHECK(doubtful.consistency < 0.8);
}

TEST_CASE("the same bits for any number of threads") {
  const Eigen::Vector3d viewpoint(0.0, 0.0, 0.6);
  const OrientedCloud target = facing(asymmetric_cloud(6000, 1), viewpoint);
  const OrientedCloud source = moved(asymmetric_cloud(3000, 2), random_motion(5));
  GlobalAlignOptions options;
  options.num_threads = 1;
  const GlobalAlignResult expected = align_global(cloud_of(source), view_of(target, viewpoint), options);
  for (const int num_threads : {2, 4, 0}) {
    options.num_threads = num_threads;
    const GlobalAlignResult result = align_global(cloud_of(source), view_of(target, viewpoint), options);
    CHECK(std::memcmp(result.alignment.target_from_source.matrix().data(),
                      expected.alignment.target_from_source.matrix().data(), 16 * sizeof(double)) == 0);
    CHECK(result.rivalry == expected.rivalry);
    CHECK(result.consistency == expected.consistency);
  }
}

TEST_CASE("data that allows no answer") {
  const OrientedCloud thing = asymmetric_cloud(2000, 1);
  const Points none(0, 3);
  const Points bad = Points::Constant(500, 3, std::numeric_limits<float>::quiet_NaN());
  const Points one = Points::Constant(500, 3, 1.0F);
  CHECK(align_global(GlobalCloud(none), cloud_of(thing)).status == GlobalAlignStatus::too_few_points);
  CHECK(align_global(cloud_of(thing), GlobalCloud(none)).status == GlobalAlignStatus::too_few_points);
  CHECK(align_global(GlobalCloud(bad), cloud_of(thing)).status == GlobalAlignStatus::too_few_points);
  CHECK_FALSE(align_global(GlobalCloud(one), cloud_of(thing)).found());
  CHECK_FALSE(align_global(GlobalCloud(one), GlobalCloud(one)).found());
  CHECK(align_global(GlobalCloud(none), GlobalCloud(none)).alignment.target_from_source.isApprox(Pose::Identity()));
}

TEST_CASE("rows that are not finite are ignored") {
  OrientedCloud thing = asymmetric_cloud(4000, 1);
  const OrientedCloud source = moved(asymmetric_cloud(4000, 2), random_motion(3).inverse());
  for (Eigen::Index i = 0; i < thing.points.rows(); i += 7) {
    thing.points(i, 1) = std::numeric_limits<float>::quiet_NaN();
    thing.normals(i + 1 < thing.points.rows() ? i + 1 : i, 0) = std::numeric_limits<float>::quiet_NaN();
  }
  const GlobalAlignResult result = align_global(cloud_of(source), cloud_of(thing));
  CHECK(result.found());
  CHECK(angle_between(result.alignment.target_from_source, random_motion(3)) < 0.01);
}

TEST_CASE("misuse names the argument") {
  const OrientedCloud thing = asymmetric_cloud(100, 1);
  const auto message = [&](const GlobalAlignOptions& options) {
    try {
      align_global(cloud_of(thing), cloud_of(thing), options);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  GlobalAlignOptions options;
  options.num_rotations = 0;
  CHECK(message(options) == "num_rotations must be at least 1, got 0");
  options = {};
  options.tolerance = -1.0;
  CHECK(message(options) == "tolerance must be 0 (automatic) or a positive distance in metres, got -1");
  options = {};
  options.max_rivalry = 2.0;
  CHECK(message(options) == "max_rivalry must be in [0, 1], got 2");
  CHECK_THROWS_AS(GlobalCloud(thing.points, Points(3, 3)), std::invalid_argument);
  CHECK_THROWS_AS(GlobalCloud(thing.points, thing.normals, Eigen::Vector3d(0.0, 0.0, std::nan(""))),
                  std::invalid_argument);
}
