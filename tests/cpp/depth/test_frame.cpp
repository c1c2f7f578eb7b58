// What a cleaned depth image becomes: its noise, its points and their normals.
#include <algorithm>

#include "depth_images.hpp"
#include "doctest/doctest.h"
#include "nacre/depth.hpp"

namespace {

using namespace nacre_test;

double angle(const Frame& frame, Eigen::Index row, const Eigen::Vector3d& normal) {
  const Eigen::Vector3d n = frame.normals.row(row).transpose().cast<double>();
  return std::atan2(n.cross(normal).norm(), n.dot(normal));
}

}  // namespace

TEST_CASE("noise is measured within 15 %") {
  for (const double scale : {0.1, 1.0, 3.0}) {
    for (const double slant : {0.0, 0.9}) {
      const NoiseModel kinect = NoiseModel::kinect();
      for (const Camera& camera : {pinhole, radial, distorted}) {
        DepthImage depth = render(camera, slanted_plane(1.4, slant, 0.4));
        add_noise(depth, {scale * kinect.constant, scale * kinect.quadratic, kinect.offset}, 11);
        const NoiseModel found = estimate_noise(depth, camera);
        CHECK(found.sigma(1.4) == doctest::Approx(scale * kinect.sigma(1.4)).epsilon(0.15));
      }
      DepthImage depth = render(orthographic, slanted_plane(1.4, slant, 0.4));
      add_noise(depth, {scale * 0.0005, 0.0, 0.0}, 11);
      CHECK(estimate_noise(depth, orthographic).constant == doctest::Approx(scale * 0.0005).epsilon(0.15));
    }
  }
}

TEST_CASE("edges, curvature and quantisation do not fool the noise estimate") {
  const NoiseModel small{0.0003, 0.0, 0.0};
  BoxScene scene;
  add_noise(scene.depth, small, 5);
  const Camera flat = Camera::orthographic(width, height, 0.01);
  CHECK(estimate_noise(scene.depth, flat).constant == doctest::Approx(0.0003).epsilon(0.15));

  DepthImage ball(height, width);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const double r2 = ((u - 60.0) * (u - 60.0) + (v - 45.0) * (v - 45.0)) * 1e-4;
      ball(v, u) = r2 < 0.16 ? static_cast<float>(2.0 - std::sqrt(0.16 - r2)) : missing;
    }
  }
  add_noise(ball, small, 6);
  CHECK(estimate_noise(ball, flat).constant == doctest::Approx(0.0003).epsilon(0.15));

  // Plateaus: most pixels have neighbours of the same value.
  DepthImage steps = render(orthographic, slanted_plane(3.0, 0.08, 0.3));
  steps = (steps / 0.005F).round() * 0.005F;
  CHECK(estimate_noise(steps, orthographic).constant == doctest::Approx(0.005 / std::sqrt(12.0)).epsilon(0.15));
  // Kinect v1: an eighth of a pixel of disparity, 580 pixels focal length, 75 mm between projector and camera.
  DepthImage disparity = 580.0F * 0.075F * 8.0F / render(pinhole, slanted_plane(3.0, 0.05, 0.3));
  const double unit = 3.0 * 3.0 / (580.0 * 0.075 * 8.0);
  CHECK(estimate_noise(580.0F * 0.075F * 8.0F / disparity.round(), pinhole).sigma(3.0) ==
        doctest::Approx(unit / std::sqrt(12.0)).epsilon(0.15));

  // No noise at all, but steps between flat surfaces.
  CHECK(estimate_noise(BoxScene().depth, pinhole).sigma(1.2) < 1e-4);
  CHECK(estimate_noise(BoxScene().depth, flat).constant < 1e-4);
}

TEST_CASE("a clean image has a small noise, an image without patches the prior") {
  const NoiseModel clean = estimate_noise(DepthImage::Constant(height, width, 1.0F), pinhole);
  CHECK(clean.sigma(1.0) > 0.0);
  CHECK(clean.sigma(1.0) < 0.002 * pinhole.footprint(1.0));
  const DepthImage nothing = DepthImage::Constant(height, width, missing);
  CHECK(estimate_noise(nothing, pinhole).constant == NoiseModel::kinect().constant);
  CHECK(estimate_noise(nothing, orthographic).constant == doctest::Approx(0.0002));
}

TEST_CASE("normals of planes are exact, for every camera and slant") {
  for (const Camera& camera : {pinhole, radial, distorted, orthographic}) {
    for (const double slant : {0.0, 0.4, 1.0, 1.3}) {
      for (const double axis : {0.0, 1.0, 3.0, 5.0}) {
        const Plane plane = slanted_plane(1.5, slant, axis);
        const DepthImage depth = render(camera, plane);
        const Frame frame = make_frame(depth, camera, NoiseModel{0.0001, 0.0, 0.0});
        CHECK(static_cast<double>(frame.valid.size()) >= 0.99 * static_cast<double>(num_facing(camera, plane, depth)));
        for (const std::int32_t row : frame.valid) {
          CAPTURE(row);
          REQUIRE(angle(frame, row, plane.normal) < (camera == distorted ? 0.02 : 0.003));
          REQUIRE(std::abs(frame.points.row(row).cast<double>().dot(plane.normal) - plane.offset) < 1e-5);
        }
      }
    }
  }
}

TEST_CASE("normals stay certain under noise, and do not reach across edges") {
  const NoiseModel noise{0.004, 0.0, 0.0};
  DepthImage depth = DepthImage::Constant(height, width, 1.5F);
  depth.rightCols(60).setConstant(1.2F);
  add_noise(depth, noise, 9);
  const Camera flat = Camera::orthographic(width, height, 0.002);
  const Frame frame = make_frame(depth, flat, noise);
  double squares = 0.0, worst = 0.0;
  for (const std::int32_t row : frame.valid) {
    const double error = angle(frame, row, {0.0, 0.0, -1.0});
    squares += error * error;
    worst = std::max(worst, error);
  }
  CHECK(frame.valid.size() > 0.99 * width * height);
  CHECK(std::sqrt(squares / static_cast<double>(frame.valid.size())) < 0.12);  // two components of 0.07
  CHECK(worst < 0.7);
}

TEST_CASE("normals do not reach across steps that are no steeper than surfaces") {
  const NoiseModel noise{0.0005, 0.0, 0.0};
  const Camera flat = Camera::orthographic(width, height, 0.001);
  for (const double step : {0.004, 0.006}) {
    CAPTURE(step);
    DepthImage depth = DepthImage::Constant(height, width, 0.5F);
    depth.rightCols(60) += static_cast<float>(step);
    add_noise(depth, noise, 9);
    const Frame frame = make_frame(depth, flat, noise);
    double squares = 0.0;
    int beside = 0;
    for (const std::int32_t row : frame.valid) {
      const int from_step = std::abs(2 * (row % width - (width - 60)) + 1);
      if (from_step > 3) continue;
      squares += std::pow(angle(frame, row, {0.0, 0.0, -1.0}), 2);
      ++beside;
    }
    CHECK(beside > 0.95 * 4 * height);
    CHECK(std::sqrt(squares / beside) < 0.3);  // 0.7 if they do
  }
}

TEST_CASE("noise does not flatten steep surfaces") {
  const NoiseModel noise{0.0005, 0.0, 0.0};
  const Camera flat = Camera::orthographic(width, height, 0.001);
  for (const double slant : {0.9, 1.1, 1.25}) {
    CAPTURE(slant);
    const Plane plane = slanted_plane(0.6, slant, 0.3);
    DepthImage depth = render(flat, plane);
    add_noise(depth, noise, 4);
    const Frame frame = make_frame(depth, flat, noise);
    double facing = 0.0;
    for (const std::int32_t row : frame.valid) facing += std::acos(-frame.normals(row, 2));
    CHECK(facing / static_cast<double>(frame.valid.size()) == doctest::Approx(slant).epsilon(0.01));
  }
}

TEST_CASE("a frame has a row per pixel, and NaN where nothing fits") {
  DepthImage depth = DepthImage::Constant(height, width, 1.0F);
  depth.rightCols(60).setConstant(missing);
  depth(20, 90) = 1.0F;
  depth(10, 10) = 0.0F;
  const Frame frame = make_frame(depth, pinhole, NoiseModel::kinect());
  CHECK(frame.width == width);
  CHECK(frame.height == height);
  REQUIRE(frame.points.rows() == width * height);
  CHECK(frame.points.row(20 * width + 90).allFinite());
  CHECK(!frame.normals.row(20 * width + 90).allFinite());
  CHECK(!frame.points.row(10 * width + 10).allFinite());
  CHECK(!frame.normals.row(10 * width + 10).allFinite());
  CHECK(frame.sigma[0] == doctest::Approx(NoiseModel::kinect().sigma(1.0)));
  CHECK(std::is_sorted(frame.valid.begin(), frame.valid.end()));
  CHECK(frame.valid.size() == 60 * height - 1 - 4);  // at corners the window is less than 40 % full
  for (const std::int32_t row : frame.valid) {
    REQUIRE(frame.normals.row(row).norm() == doctest::Approx(1.0F));
    REQUIRE(frame.normals.row(row).dot(frame.points.row(row)) < 0.0F);
  }
}

TEST_CASE("noise that is not given is measured") {
  DepthImage depth = render(pinhole, slanted_plane(1.5, 0.6, 0.8));
  add_noise(depth, NoiseModel::kinect(), 11);
  const Frame frame = make_frame(depth, pinhole);
  const Frame expected = make_frame(depth, pinhole, estimate_noise(depth, pinhole));
  CHECK(frame.valid == expected.valid);
  CHECK(frame.sigma == expected.sigma);
}

TEST_CASE("a frame may be made in the place of another") {
  const DepthImage first = render(pinhole, slanted_plane(1.5, 0.6, 0.8));
  DepthImage second = DepthImage::Constant(height, width, missing);
  second.topRows(50) = render(radial, slanted_plane(1.2, 0.3, 0.1)).topRows(50);
  const Camera small = Camera::orthographic(20, 10, 0.01);
  Frame frame;
  for (const auto& [depth, camera] : {std::pair{first, pinhole},
                                      {second, radial},
                                      {first, pinhole},
                                      {DepthImage(DepthImage::Constant(10, 20, 1.0F)), small}}) {
    make_frame(depth, camera, NoiseModel::kinect(), 2, frame);
    const Frame expected = make_frame(depth, camera, NoiseModel::kinect());
    CHECK(frame.width == camera.width());
    CHECK(frame.height == camera.height());
    CHECK(frame.valid == expected.valid);
    REQUIRE(frame.points.rows() == depth.size());
    REQUIRE(frame.sigma.size() == depth.size());
    for (const std::int32_t row : expected.valid) {
      REQUIRE(frame.points.row(row) == expected.points.row(row));
      REQUIRE(frame.normals.row(row) == expected.normals.row(row));
    }
  }
}
