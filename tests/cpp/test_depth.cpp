#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>

#include "doctest/doctest.h"
#include "nacre/depth.hpp"
#include "random.hpp"

namespace {

using namespace nacre;

constexpr float missing = std::numeric_limits<float>::quiet_NaN();
constexpr int width = 120, height = 90;
const Camera::Distortion lens{0.1, -0.05, 0.001, -0.001, 0.01};

const Camera pinhole = Camera::pinhole(width, height, 100.0, 104.0, 58.0, 47.0);
const Camera radial = Camera::pinhole(width, height, 100.0, 104.0, 58.0, 47.0, {}, DepthKind::radial);
const Camera distorted = Camera::pinhole(width, height, 100.0, 104.0, 58.0, 47.0, lens);
const Camera orthographic = Camera::orthographic(width, height, 0.002);

struct Plane {
  Eigen::Vector3d normal;
  double offset;  // normal . p = offset
};

// Through the optical axis at distance z, slanted against the camera about an axis in the image.
Plane slanted_plane(double z, double slant, double axis) {
  const Eigen::Vector3d normal(std::sin(slant) * std::cos(axis), std::sin(slant) * std::sin(axis), -std::cos(slant));
  return {normal, normal.z() * z};
}

// The depth of a plane in the camera's depth kind; missing where a ray does not meet it within 20 m.
DepthImage render(const Camera& camera, const Plane& plane) {
  DepthImage depth(camera.height(), camera.width());
  for (Eigen::Index i = 0; i < depth.size(); ++i) {
    const Ray& ray = camera.rays()[static_cast<std::size_t>(i)];
    const double along = plane.normal.dot(Eigen::Vector3d(ray.direction_x, ray.direction_y, ray.direction_z));
    const double value = (plane.offset - plane.normal.x() * ray.origin_x - plane.normal.y() * ray.origin_y) / along;
    depth.data()[i] = value > 0.0 && value < 20.0 ? static_cast<float>(value) : missing;
  }
  return depth;
}

void add_noise(DepthImage& depth, const NoiseModel& noise, std::uint64_t seed) {
  for (Eigen::Index i = 0; i < depth.size(); ++i) {
    const double z = depth.data()[i];
    depth.data()[i] = static_cast<float>(z + noise.sigma(z) * random_normal(seed, static_cast<std::uint64_t>(i)));
  }
}

// How many pixels see the plane with an angle of at most 75 degrees between ray and normal.
std::int64_t num_facing(const Camera& camera, const Plane& plane, const DepthImage& depth) {
  std::int64_t count = 0;
  for (Eigen::Index i = 0; i < depth.size(); ++i) {
    const Ray& ray = camera.rays()[static_cast<std::size_t>(i)];
    const Eigen::Vector3d direction(ray.direction_x, ray.direction_y, ray.direction_z);
    count += std::isfinite(depth.data()[i]) && -plane.normal.dot(direction.normalized()) > 0.2588;
  }
  return count;
}

std::int64_t num_valid(const DepthImage& depth) { return (depth == depth).count(); }

bool same_bits(const DepthImage& a, const DepthImage& b) {
  return a.size() == b.size() &&
         std::memcmp(a.data(), b.data(), static_cast<std::size_t>(a.size()) * sizeof(float)) == 0;
}

// A box in front of a wall; between the two a pixel wide band of mixtures.
struct BoxScene {
  DepthImage depth = DepthImage::Constant(height, width, 2.0F);
  MaskImage mixed = MaskImage::Zero(height, width);

  explicit BoxScene(float wall = 2.0F) {
    depth.setConstant(wall);
    for (int v = 29; v <= 60; ++v) {
      for (int u = 39; u <= 80; ++u) {
        const bool rim = v == 29 || v == 60 || u == 39 || u == 80;
        const auto part = static_cast<float>(
            0.1 + 0.8 * random_uniform(1, static_cast<std::uint64_t>(v) * 1000 + static_cast<std::uint64_t>(u)));
        depth(v, u) = rim ? part * wall + (1.0F - part) * 1.2F : 1.2F;
        mixed(v, u) = rim;
      }
    }
  }
};

std::string message_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

double angle(const Frame& frame, Eigen::Index row, const Eigen::Vector3d& normal) {
  const Eigen::Vector3d n = frame.normals.row(row).transpose().cast<double>();
  return std::atan2(n.cross(normal).norm(), n.dot(normal));
}

}  // namespace

TEST_CASE("raw depth becomes metres") {
  Eigen::Array<std::uint16_t, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> raw(1, 4);
  raw << 0, 1000, 65534, 65535;
  const DepthImage depth = depth_from_raw(raw, 1000.0);
  CHECK(std::isnan(depth(0, 0)));
  CHECK(depth(0, 1) == 1.0F);
  CHECK(depth(0, 2) == 65.534F);
  CHECK(std::isnan(depth(0, 3)));
  CHECK(message_of([&] { depth_from_raw(raw, 0.0); }).find("depth_scale") == 0);
}

TEST_CASE("back-projection keeps valid pixels, row by row, on their plane") {
  for (const Camera& camera : {pinhole, radial, distorted, orthographic}) {
    const Plane plane = slanted_plane(1.5, 0.6, 0.8);
    DepthImage depth = render(camera, plane);
    REQUIRE(num_valid(depth) == depth.size());
    depth(0, 1) = missing;
    depth(2, 3) = 0.0F;
    depth(4, 5) = -1.0F;
    depth(6, 7) = std::numeric_limits<float>::infinity();
    const Points points = back_project(depth, camera);
    REQUIRE(points.rows() == depth.size() - 4);
    for (Eigen::Index i = 0; i < points.rows(); ++i) {
      REQUIRE(std::abs(points.row(i).cast<double>().dot(plane.normal) - plane.offset) < 1e-5);
    }
    CHECK((camera.project(points.row(1).transpose().cast<double>()) - Eigen::Vector2d(2, 0)).norm() < 1e-3);
  }
  CHECK(back_project(DepthImage::Constant(height, width, missing), pinhole).rows() == 0);
}

TEST_CASE("planes of any slant are kept whole") {
  for (const Camera& camera : {pinhole, radial, distorted, orthographic}) {
    for (const double slant : {0.0, 0.5, 1.0, 1.2, 1.3}) {
      for (const double axis : {0.0, 0.9, 1.6, 2.4, 4.0}) {
        CAPTURE(slant);
        CAPTURE(axis);
        const Plane plane = slanted_plane(2.0, slant, axis);
        DepthImage depth = render(camera, plane);
        DepthOptions options;
        const NoiseModel noise{0.0005, 0.0005, 0.4};
        const std::int64_t facing = num_facing(camera, plane, depth);
        CHECK(num_valid(preprocess_depth(depth, camera, options)) >= 0.99 * static_cast<double>(facing));
        add_noise(depth, noise, 7);
        options.noise = noise;
        CHECK(num_valid(preprocess_depth(depth, camera, options)) >= 0.99 * static_cast<double>(facing));
      }
    }
  }
}

TEST_CASE("surfaces steeper than max_slant are removed") {
  DepthOptions options;
  options.max_slant = 1.0;
  DepthReport report;
  preprocess_depth(render(orthographic, slanted_plane(1.0, 0.9, 0.0)), orthographic, options, MaskImage(), &report);
  CHECK(report.num_slanted == 0);
  preprocess_depth(render(orthographic, slanted_plane(1.0, 1.1, 0.0)), orthographic, options, MaskImage(), &report);
  CHECK(report.num_slanted == report.num_pixels);
}

TEST_CASE("mixed pixels at depth edges are removed by both tests") {
  const BoxScene scene;
  for (const EdgeTest test : {EdgeTest::gradient, EdgeTest::inverse_depth}) {
    for (const int dilation : {0, 1, 2}) {
      DepthOptions options;
      options.edge_test = test;
      options.edge_dilation = dilation;
      const DepthImage clean = preprocess_depth(scene.depth, pinhole, options);
      for (Eigen::Index i = 0; i < clean.size(); ++i) {
        if (scene.mixed.data()[i]) REQUIRE(std::isnan(clean.data()[i]));
      }
      // No more than the band, a pixel on both sides, and the dilation.
      const auto removed = static_cast<double>(clean.size() - num_valid(clean));
      CHECK(removed <= (3 + 2 * dilation) * 2 * (42 + 32));
      CHECK(std::isfinite(clean(45, 60)));
      CHECK(std::isfinite(clean(29 - 2 - dilation, 60)));
      CHECK(std::isfinite(clean(29 + 2 + dilation, 60)));
    }
  }
}

TEST_CASE("a rim of mixtures against nothing is removed") {
  // The wall is too far to be measured, but its mixtures with the box are not.
  BoxScene scene(9.0F);
  scene.depth = (scene.depth > 8.5F).select(missing, scene.depth);
  DepthOptions options;
  options.edge_dilation = 0;
  const DepthImage clean = preprocess_depth(scene.depth, pinhole, options);
  for (Eigen::Index i = 0; i < clean.size(); ++i) {
    if (scene.mixed.data()[i]) REQUIRE(std::isnan(clean.data()[i]));
  }
  CHECK(num_valid(clean) >= 36 * 26);
}

TEST_CASE("without an edge test mixtures stay") {
  DepthOptions options;
  options.edge_test = EdgeTest::none;
  options.min_component = 0;
  const BoxScene scene;
  CHECK(same_bits(preprocess_depth(scene.depth, pinhole, options), scene.depth));
}

TEST_CASE("range and mask remove pixels but make no edges") {
  DepthImage depth = DepthImage::Constant(height, width, 1.0F);
  depth.rightCols(40).setConstant(3.0F);
  MaskImage mask = MaskImage::Ones(height, width);
  mask.topRows(10).setZero();
  DepthOptions options;
  options.edge_test = EdgeTest::gradient;
  options.edge_dilation = 0;
  options.max_depth = 2.0;
  DepthReport report;
  const DepthImage clean = preprocess_depth(depth, pinhole, options, mask, &report);
  CHECK(report.num_out_of_range == 40 * height);
  CHECK(report.num_masked == 80 * 10);
  CHECK(report.num_edge == height - 10);  // the near side of the step; along the mask's rim nothing
  CHECK(std::isfinite(clean(10, 0)));
  CHECK(num_valid(clean) == report.num_kept);

  options.min_depth = 1.5;
  options.max_depth = 10.0;
  preprocess_depth(depth, pinhole, options, MaskImage(), &report);
  CHECK(report.num_out_of_range == 80 * height);
}

TEST_CASE("specks are removed") {
  DepthImage depth = DepthImage::Constant(height, width, missing);
  depth.block(10, 10, 4, 5).setConstant(1.0F);  // 20 pixels stay
  depth.block(40, 40, 3, 6).setConstant(1.0F);  // 18 do not
  depth.block(60, 60, 6, 6).setConstant(1.0F);
  depth.block(63, 60, 3, 6).setConstant(3.0F);  // touches the upper half, but lies at another depth
  DepthOptions options;
  options.edge_test = EdgeTest::none;
  options.max_missing = 1.0;
  DepthReport report;
  const DepthImage clean = preprocess_depth(depth, pinhole, options, MaskImage(), &report);
  CHECK(report.num_isolated == 18 + 36);
  CHECK(num_valid(clean) == 20);
  options.min_component = 0;
  CHECK(same_bits(preprocess_depth(depth, pinhole, options), depth));
}

TEST_CASE("a speck of any shape is one component") {
  // A comb: its teeth meet in the last row only.
  DepthImage depth = DepthImage::Constant(height, width, missing);
  for (int u = 20; u <= 30; u += 2) depth.col(u).segment(20, 5).setConstant(1.0F);
  depth.row(25).segment(20, 11).setConstant(1.0F);
  DepthOptions options;
  options.edge_test = EdgeTest::none;
  options.max_missing = 1.0;
  options.min_component = 41;
  CHECK(num_valid(preprocess_depth(depth, pinhole, options)) == 41);
  options.min_component = 42;
  CHECK(num_valid(preprocess_depth(depth, pinhole, options)) == 0);
}

TEST_CASE("pixels with too few neighbours are removed") {
  DepthImage depth = DepthImage::Constant(height, width, missing);
  depth.block(20, 10, 20, 2).setConstant(1.0F);  // 9 of 24 neighbours at most
  depth.block(20, 40, 20, 3).setConstant(1.0F);  // 14 inside, 8 at the two ends
  DepthOptions options;
  options.edge_test = EdgeTest::none;
  options.min_component = 0;
  CHECK(num_valid(preprocess_depth(depth, pinhole, options)) == 60 - 6);
  depth.setConstant(missing);
  depth.block(0, 0, 3, 3).setConstant(1.0F);  // outside of the image nothing is missing
  CHECK(num_valid(preprocess_depth(depth, pinhole, options)) > 0);
}

TEST_CASE("the report adds up") {
  BoxScene scene;
  scene.depth.topRows(3).setZero();
  scene.depth(50, 5) = -1.0F;
  add_noise(scene.depth, NoiseModel::kinect(), 3);
  MaskImage mask = MaskImage::Ones(height, width);
  mask.leftCols(4).setZero();
  DepthOptions options;
  options.max_depth = 2.005;
  DepthReport r;
  const DepthImage clean = preprocess_depth(scene.depth, pinhole, options, mask, &r);
  CHECK(r.num_pixels == width * height);
  CHECK(r.num_invalid + r.num_out_of_range + r.num_masked + r.num_edge + r.num_slanted + r.num_isolated + r.num_kept ==
        r.num_pixels);
  CHECK(r.num_kept == num_valid(clean));
  CHECK(r.num_invalid > 0);
  CHECK(r.num_out_of_range > 0);
  CHECK(r.num_masked > 0);
  CHECK(r.num_edge > 0);
}

TEST_CASE("an image without measurements stays one") {
  DepthReport report;
  for (const float value : {missing, 0.0F, -3.0F, std::numeric_limits<float>::infinity()}) {
    const DepthImage clean =
        preprocess_depth(DepthImage::Constant(height, width, value), pinhole, {}, MaskImage(), &report);
    CHECK(num_valid(clean) == 0);
    CHECK(report.num_invalid == width * height);
  }
}

TEST_CASE("pixels beyond the end of the distortion see nothing") {
  const Camera camera = Camera::pinhole(width, height, 40.0, 40.0, 59.5, 44.5, {-0.3, 0.0, 0.0, 0.0, 0.0});
  const DepthImage depth = DepthImage::Constant(height, width, 1.0F);
  DepthReport report;
  const DepthImage clean = preprocess_depth(depth, camera, {}, MaskImage(), &report);
  CHECK(report.num_invalid > 0);
  CHECK(std::isnan(clean(0, 0)));
  CHECK(std::isfinite(clean(44, 59)));
  CHECK(back_project(depth, camera).rows() == report.num_pixels - report.num_invalid);
  const Frame frame = make_frame(depth, camera, NoiseModel::kinect());
  for (const std::int32_t row : frame.valid) REQUIRE(frame.points.row(row).allFinite());
}

TEST_CASE("a wrong depth scale is named") {
  const DepthImage metres = DepthImage::Constant(height, width, 1.5F);
  const std::string message = message_of([&] { preprocess_depth(metres * 1000.0F, pinhole); });
  CHECK(message.find("1500 m") != std::string::npos);
  CHECK(message.find("depth_scale") != std::string::npos);
  CHECK(message_of([&] { preprocess_depth(metres / 5000.0F, pinhole); }).find("depth_scale") != std::string::npos);
  CHECK(message_of([&] { preprocess_depth(metres, pinhole); }).empty());
}

TEST_CASE("sizes that do not match are named") {
  const DepthImage wrong = DepthImage::Constant(width, height, 1.0F);
  const DepthImage depth = DepthImage::Constant(height, width, 1.0F);
  CHECK(message_of([&] { preprocess_depth(wrong, pinhole); }) ==
        "depth must have the camera's size 120 x 90 (width x height), got 90 x 120");
  CHECK(message_of([&] { preprocess_depth(depth, pinhole, {}, MaskImage::Ones(3, 2)); }).find("mask") == 0);
  CHECK(message_of([&] { back_project(wrong, pinhole); }).find("depth") == 0);
  CHECK(message_of([&] { make_frame(wrong, pinhole, {}); }).find("depth") == 0);
  CHECK(message_of([&] { estimate_noise(wrong, pinhole); }).find("depth") == 0);
}

TEST_CASE("options out of range are named") {
  const auto complaint = [](const std::function<void(DepthOptions&)>& change) {
    DepthOptions options;
    change(options);
    return message_of([&] { options.check(); });
  };
  CHECK(complaint([](DepthOptions&) {}).empty());
  CHECK(complaint([](DepthOptions& o) { o.min_depth = -1.0; }).find("min_depth") == 0);
  CHECK(complaint([](DepthOptions& o) { o.max_depth = 0.0; }).find("max_depth") == 0);
  CHECK(complaint([](DepthOptions& o) { o.gradient_threshold = 0.0; }).find("gradient_threshold") == 0);
  CHECK(complaint([](DepthOptions& o) { o.edge_dilation = -1; }).find("edge_dilation") == 0);
  CHECK(complaint([](DepthOptions& o) { o.edge_sigmas = missing; }).find("edge_sigmas") == 0);
  CHECK(complaint([](DepthOptions& o) { o.max_slant = 1.6; }).find("max_slant") == 0);
  CHECK(complaint([](DepthOptions& o) { o.max_missing = 1.1; }).find("max_missing") == 0);
  CHECK(complaint([](DepthOptions& o) { o.min_component = -1; }).find("min_component") == 0);
  CHECK(complaint([](DepthOptions& o) { o.noise = NoiseModel{-1.0, 0.0, 0.0}; }).find("noise.constant") == 0);
}

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
  DepthImage steps = render(orthographic, slanted_plane(3.0, 0.2, 0.3));
  steps = (steps / 0.005F).round() * 0.005F;
  CHECK(estimate_noise(steps, orthographic).constant == doctest::Approx(0.005 / std::sqrt(12.0)).epsilon(0.15));
  // Kinect v1: an eighth of a pixel of disparity, 580 pixels focal length, 75 mm between projector and camera.
  DepthImage disparity = 580.0F * 0.075F * 8.0F / render(pinhole, slanted_plane(3.0, 0.1, 0.3));
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
        const Frame frame = make_frame(depth, camera, {0.0001, 0.0, 0.0});
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

TEST_CASE("images smaller than a window") {
  for (const int side : {1, 2, 3, 6, 7, 8}) {
    const Camera camera = Camera::pinhole(side, side, 10.0, 10.0, side / 2.0, side / 2.0);
    const DepthImage depth = DepthImage::Constant(side, side, 1.0F);
    DepthOptions options;
    options.min_component = 0;
    CHECK(num_valid(preprocess_depth(depth, camera, options)) == side * side);
    CHECK(make_frame(depth, camera, NoiseModel::kinect()).points.rows() == side * side);
  }
}

TEST_CASE("the same bits for any number of threads") {
  BoxScene scene;
  add_noise(scene.depth, NoiseModel::kinect(), 4);
  scene.depth(70, 70) = missing;
  const NoiseModel noise = estimate_noise(scene.depth, pinhole, 1);
  const DepthImage clean = preprocess_depth(scene.depth, pinhole, {}, MaskImage(), nullptr, 1);
  const Frame frame = make_frame(clean, pinhole, noise, 1);
  for (const int threads : {2, 3, 8, 0}) {
    CHECK(estimate_noise(scene.depth, pinhole, threads).constant == noise.constant);
    CHECK(same_bits(preprocess_depth(scene.depth, pinhole, {}, MaskImage(), nullptr, threads), clean));
    const Frame other = make_frame(clean, pinhole, noise, threads);
    CHECK(other.valid == frame.valid);
    for (const std::int32_t row : frame.valid) {
      REQUIRE(other.normals.row(row) == frame.normals.row(row));
      REQUIRE(other.points.row(row) == frame.points.row(row));
    }
  }
}

TEST_CASE("a crop and a strided block give the same as a copy") {
  BoxScene scene;
  const DepthImage wide = scene.depth.replicate(1, 2);
  CHECK(same_bits(preprocess_depth(wide.leftCols(width), pinhole), preprocess_depth(scene.depth, pinhole)));
}
