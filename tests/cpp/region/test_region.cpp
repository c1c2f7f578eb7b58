#include <cmath>

#include "depth_images.hpp"
#include "doctest/doctest.h"
#include "nacre/region.hpp"

using namespace nacre;
using namespace nacre_test;

namespace {

// A ball on a table, seen from above at 40 degrees.
struct Scene {
  Plane table = slanted_plane(1.0, 0.87, -1.5707963);
  DepthImage depth = render(pinhole, table);
  MaskImage ball = MaskImage::Zero(height, width);

  Scene() {
    constexpr double radius = 0.12;
    const Eigen::Vector3d center = Eigen::Vector3d(0.0, 0.0, 1.0) + radius * table.normal;
    for (Eigen::Index i = 0; i < depth.size(); ++i) {
      const Ray ray = ray_of(pinhole, i);
      const Eigen::Vector3d d(ray.direction_x, ray.direction_y, ray.direction_z);
      const double b = d.dot(center), c = center.squaredNorm() - radius * radius, root = b * b - c * d.squaredNorm();
      if (root < 0.0) continue;
      depth.data()[i] = static_cast<float>((b - std::sqrt(root)) / d.squaredNorm());
      ball.data()[i] = 1;
    }
  }
};

}  // namespace

TEST_CASE("a ball is what stands on the table, whatever the number of threads") {
  const Scene scene;
  const Frame frame = make_frame(preprocess_depth(scene.depth, pinhole), pinhole);
  RegionOptions options;
  options.object = true;
  RegionReport report;
  const MaskImage one = select_region(frame, pinhole, options, MaskImage(), &report, 1);
  REQUIRE(report.planes.size() == 1);
  CHECK(report.planes[0].normal.dot(scene.table.normal) > 0.9999);
  CHECK(report.planes[0].offset == doctest::Approx(scene.table.offset).epsilon(0.002));
  std::int64_t found = 0, wrong = 0, in_all = 0;
  for (Eigen::Index i = 0; i < one.size(); ++i) {
    const bool has_point = frame.points(i, 2) > 0.0F;
    found += one.data()[i] != 0 && scene.ball.data()[i] != 0;
    wrong += one.data()[i] != 0 && scene.ball.data()[i] == 0;
    in_all += has_point && scene.ball.data()[i] != 0;
  }
  CHECK(wrong == 0);
  CHECK(found > 0.85 * static_cast<double>(in_all));
  CHECK(report.num_inside == found);
  for (const int threads : {2, 5}) {
    CHECK((select_region(frame, pinhole, options, MaskImage(), nullptr, threads) == one).all());
  }
}

TEST_CASE("what lies outside of a region is no surface, and can still be seen through") {
  const Scene scene;
  Frame frame = make_frame(scene.depth, pinhole);
  const Frame before = frame;
  keep_region(scene.ball, frame);
  CHECK(frame.points.isApprox(before.points));
  CHECK(frame.valid.size() < before.valid.size());
  for (const std::int32_t row : frame.valid) CHECK(scene.ball.data()[row] != 0);
  for (Eigen::Index i = 0; i < scene.ball.size(); ++i) {
    if (scene.ball.data()[i] == 0) CHECK(std::isnan(frame.normals(i, 0)));
  }
}

TEST_CASE("sizes must fit") {
  const Scene scene;
  Frame frame = make_frame(scene.depth, pinhole);
  const Camera other = Camera::pinhole(10, 10, 10.0, 10.0, 5.0, 5.0);
  CHECK(message_of([&] { select_region(frame, other); }).find("frame must have the camera's size") == 0);
  CHECK(message_of([&] { select_region(frame, pinhole, {}, MaskImage::Ones(3, 3)); }).find("previous must have") == 0);
  CHECK(message_of([&] { keep_region(MaskImage::Ones(3, 3), frame); }).find("region must be of the frame's size") == 0);
}
