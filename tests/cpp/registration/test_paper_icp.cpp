#include <cmath>
#include <limits>

#include "clouds.hpp"
#include "doctest/doctest.h"
#include "registration/paper_icp.hpp"

using namespace nacre;

namespace {

AlignOptions paper_options() {
  AlignOptions options;
  options.method = Metric::paper;
  options.max_distance = 0.005;
  options.max_iterations = 15;
  options.sample_fraction = 0.05;
  options.keep_best = true;
  options.max_angle = 0.6;
  return options;
}

IcpResult aligned(const OrientedCloud& source, const OrientedCloud& target, const AlignOptions& options) {
  return align_as_in_paper(AlignCloud(source.points, source.normals), AlignCloud(target.points, target.normals),
                           Pose::Identity(), options);
}

// A square of 0.1 m in the plane z = height, left edge at x.
OrientedCloud square(double x, double height, double tilt = 0.0) {
  OrientedCloud cloud{Points(2601, 3), Points(2601, 3)};
  for (int i = 0; i < 2601; ++i) {
    cloud.points.row(i) << static_cast<float>(x + 0.002 * (i % 51)), static_cast<float>(0.002 * (i / 51)),
        static_cast<float>(height);
    cloud.normals.row(i) << static_cast<float>(std::sin(tilt)), 0.0F, static_cast<float>(std::cos(tilt));
  }
  return cloud;
}

}  // namespace

TEST_CASE("A surface without symmetry finds back from fifteen degrees, from a twentieth of its points") {
  const OrientedCloud target = asymmetric_cloud(20000, 3);
  Pose truth = Pose::Identity();
  truth.linear() = Eigen::AngleAxisd(0.26, Eigen::Vector3d(0.2, 1.0, -0.1).normalized()).toRotationMatrix();
  const OrientedCloud source = moved(asymmetric_cloud(20000, 4), truth.inverse());
  AlignOptions options = paper_options();
  const IcpResult result = aligned(source, target, options);
  CHECK(Eigen::AngleAxisd(result.target_from_source.linear().transpose() * truth.linear()).angle() < 0.01);
  CHECK((result.target_from_source.translation() - truth.translation()).norm() < 0.001);
  CHECK(result.rmse < 0.001);
  CHECK(result.num_inliers <= 1000);

  SUBCASE("with the same bits for any number of threads") {
    options.num_threads = 4;
    CHECK(aligned(source, target, options).target_from_source.matrix() == result.target_from_source.matrix());
  }
  SUBCASE("and other bits for another seed") {
    options.seed = 1;
    CHECK(aligned(source, target, options).target_from_source.matrix() != result.target_from_source.matrix());
  }
  SUBCASE("the last iterate is no better than the best") {
    options.keep_best = false;
    CHECK(aligned(source, target, options).rmse >= result.rmse);
  }
}

TEST_CASE("Pairs are less than the largest distance apart along the normal") {
  AlignOptions options = paper_options();
  options.max_iterations = 0;
  CHECK(aligned(square(0.0, 0.0049), square(0.0, 0.0), options).overlap == 1.0);
  CHECK(aligned(square(0.0, 0.0051), square(0.0, 0.0), options).overlap == 0.0);
  // To the right of the square there are points of its plane, farther from its rim than that.
  CHECK(aligned(square(0.05, 0.001), square(0.0, 0.0), options).overlap == 1.0);
}

TEST_CASE("Points match no rim, which has no normal, and nothing that faces elsewhere") {
  AlignOptions options = paper_options();
  options.max_iterations = 0;
  OrientedCloud target = square(0.0, 0.0);
  for (int i = 0; i < 2601; ++i) {
    if (i % 51 == 50) target.normals.row(i).setConstant(std::numeric_limits<float>::quiet_NaN());
  }
  CHECK(aligned(square(0.11, 0.001), target, options).overlap == 0.0);
  const double half = aligned(square(0.05, 0.001), target, options).overlap;
  CHECK(half > 0.3);
  CHECK(half < 0.6);
  CHECK(aligned(square(0.0, 0.001, 0.59), square(0.0, 0.0), options).overlap == 1.0);
  CHECK(aligned(square(0.0, 0.001, 0.61), square(0.0, 0.0), options).overlap == 0.0);
}

TEST_CASE("Without a pair the pose stays, and the result says so") {
  const IcpResult result = aligned(square(0.0, 1.0), square(0.0, 0.0), paper_options());
  CHECK(result.target_from_source.matrix() == Pose::Identity().matrix());
  CHECK(result.overlap == 0.0);
  CHECK(result.num_inliers == 0);
  CHECK(std::isnan(result.rmse));
}
