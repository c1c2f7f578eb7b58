#include "clouds.hpp"
#include "doctest/doctest.h"
#include "registration/icp.hpp"
#include "registration/scale_check.hpp"

using namespace nacre;

namespace {

constexpr double noise = 2e-4;

// What a camera sees of an object, with independent noise along the normals; a factor moves it along the rays.
OrientedCloud seen(double factor, std::uint64_t seed, double noise_sigma = noise) {
  OrientedCloud cloud = facing(asymmetric_cloud(6000, seed), {0.0, 0.0, -0.5});
  for (Eigen::Index i = 0; i < cloud.points.rows(); ++i) {
    const auto error = static_cast<float>(noise_sigma * random_normal(seed + 100, static_cast<std::uint64_t>(i)));
    cloud.points.row(i) += error * cloud.normals.row(i);
  }
  const Eigen::RowVector3f eye(0.0F, 0.0F, -0.5F);
  cloud.points = ((cloud.points.rowwise() - eye) * static_cast<float>(factor)).rowwise() + eye;
  return cloud;
}

IcpResult registered(const OrientedCloud& source, const OrientedCloud& target, AlignOptions options = {}) {
  options.max_distance = 0.02;
  return align_to(IcpTarget(AlignCloud(target.points, target.normals), options),
                  IcpSource(AlignCloud(source.points, source.normals), options), Pose::Identity(), options);
}

}  // namespace

TEST_CASE("the size of a source that was scaled is found, whatever the method") {
  const OrientedCloud whole = asymmetric_cloud(20000, 1);
  for (const Metric metric : {Metric::point_to_plane, Metric::symmetric}) {
    AlignOptions options;
    options.method = metric;
    for (const double factor : {0.95, 0.98, 1.0, 1.01, 1.05}) {
      const SizeDifference found = registered(seen(factor, 2), whole, options).size_difference;
      CHECK(found.relative == doctest::Approx(1.0 / factor - 1.0).epsilon(0.12).scale(0.02));
      CHECK(found.sigma < 0.006);
    }
  }
}

TEST_CASE("its standard deviation is that of its errors") {
  const OrientedCloud whole = asymmetric_cloud(20000, 1);
  double squares = 0.0;
  constexpr int num_trials = 30;
  for (int trial = 0; trial < num_trials; ++trial) {
    const SizeDifference found =
        registered(seen(1.0, static_cast<std::uint64_t>(10 + trial), 1e-3), whole).size_difference;
    squares += found.relative * found.relative / (found.sigma * found.sigma * num_trials);
  }
  CHECK(std::sqrt(squares) > 0.5);
  CHECK(std::sqrt(squares) < 2.0);
}

TEST_CASE("a plane and a corner tell nothing of their size") {
  constexpr int side = 40;
  for (const int num_faces : {1, 3}) {
    OrientedCloud faces{Points(side * side * num_faces, 3), Points(side * side * num_faces, 3)};
    for (int i = 0; i < faces.points.rows(); ++i) {
      const int face = i / (side * side), u = i / side % side, v = i % side;
      const double error = noise * random_normal(1, static_cast<std::uint64_t>(i));
      const Eigen::Vector3d local(0.005 * u, 0.005 * v, error);
      for (int axis = 0; axis < 3; ++axis) {
        faces.points(i, (axis + face) % 3) = static_cast<float>(local[axis]);
        faces.normals(i, (axis + face) % 3) = axis == 2 ? 1.0F : 0.0F;
      }
    }
    OrientedCloud larger = faces;
    larger.points *= 1.05F;
    const SizeDifference found = registered(larger, faces).size_difference;
    CHECK(found.sigma > 0.2 * std::abs(found.relative));
  }
}

TEST_CASE("no pairs tell nothing") {
  const SizeDifference found = size_difference({}, Metric::symmetric);
  CHECK(found.relative == 0.0);
  CHECK(std::isinf(found.sigma));
}
