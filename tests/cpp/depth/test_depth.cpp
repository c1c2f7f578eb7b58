#include "depth_images.hpp"
#include "doctest/doctest.h"

using namespace nacre_test;
#include "nacre/depth.hpp"

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

TEST_CASE("a rim that bends away from its surface is removed, a straight one is kept") {
  DepthImage depth = DepthImage::Constant(height, width, missing);
  depth.block(20, 20, 40, 40).setConstant(1.0F);
  depth.block(20, 59, 40, 1).setConstant(1.008F);  // four pixels' width farther than its neighbours
  DepthOptions options;
  options.edge_dilation = 0;
  options.max_missing = 1.0;
  const DepthImage clean = preprocess_depth(depth, orthographic, options);
  CHECK(num_valid(clean.block(20, 20, 40, 38)) == 40 * 38);
  CHECK(num_valid(clean.block(20, 59, 40, 1)) == 0);
}

TEST_CASE("a ramp between two surfaces is removed") {
  DepthImage depth = DepthImage::Constant(height, width, 1.0F);
  for (int step = 1; step <= 5; ++step) depth.col(59 + step).setConstant(1.0F + 0.05F * static_cast<float>(step));
  depth.rightCols(width - 65).setConstant(1.3F);
  DepthOptions options;
  options.edge_dilation = 0;
  options.max_missing = 1.0;
  const DepthImage clean = preprocess_depth(depth, orthographic, options);
  CHECK(num_valid(clean.block(0, 60, height, 5)) == 0);
  CHECK(num_valid(clean.middleRows(1, height - 2)) == (height - 2) * (width - 5));
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

TEST_CASE("speckles are removed") {
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

TEST_CASE("a speckle of any shape is one component") {
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
  CHECK(message_of([&] { make_frame(wrong, pinhole); }).find("depth") == 0);
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
  CHECK(complaint([](DepthOptions& o) { o.planar_keep_sigmas = -1.0; }).find("planar_keep_sigmas") == 0);
  CHECK(complaint([](DepthOptions& o) { o.max_slant = 1.6; }).find("max_slant") == 0);
  CHECK(complaint([](DepthOptions& o) { o.max_missing = 1.1; }).find("max_missing") == 0);
  CHECK(complaint([](DepthOptions& o) { o.min_component = -1; }).find("min_component") == 0);
  CHECK(complaint([](DepthOptions& o) { o.noise = NoiseModel{-1.0, 0.0, 0.0}; }).find("noise.constant") == 0);
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
  const auto same = [](const Points& a, const Points& b) {
    return a.size() == b.size() &&
           std::memcmp(a.data(), b.data(), static_cast<std::size_t>(a.size()) * sizeof(float)) == 0;
  };
  const NoiseModel noise = estimate_noise(scene.depth, pinhole, 1);
  const DepthImage clean = preprocess_depth(scene.depth, pinhole, {}, MaskImage(), nullptr, 1);
  const Frame frame = make_frame(clean, pinhole, noise, 1);
  const Points points = back_project(clean, pinhole, 1);
  for (const int threads : {2, 3, 4, 7, 8, 0}) {
    CHECK(estimate_noise(scene.depth, pinhole, threads).constant == noise.constant);
    CHECK(same_bits(preprocess_depth(scene.depth, pinhole, {}, MaskImage(), nullptr, threads), clean));
    const Frame other = make_frame(clean, pinhole, noise, threads);
    CHECK(other.valid == frame.valid);
    CHECK(same(other.points, frame.points));
    CHECK(same(other.normals, frame.normals));
    CHECK(same(depth_normals(clean, pinhole, noise, threads), frame.normals));
    CHECK(same(back_project(clean, pinhole, threads), points));
  }
}

TEST_CASE("a crop and a strided block give the same as a copy") {
  BoxScene scene;
  const DepthImage wide = scene.depth.replicate(1, 2);
  CHECK(same_bits(preprocess_depth(wide.leftCols(width), pinhole), preprocess_depth(scene.depth, pinhole)));
}
