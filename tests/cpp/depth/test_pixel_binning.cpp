#include "depth/pixel_binning.hpp"
#include "depth_images.hpp"
#include "doctest/doctest.h"

using namespace nacre_test;

namespace {

DepthImage binned(const DepthImage& depth, const Camera& camera, int factor, int num_threads = 1) {
  return PixelBinning(depth, camera, factor, num_threads).depth();
}

const Camera vga = Camera::pinhole(640, 480, 525.0, 525.0, 319.5, 239.5);

}  // namespace

TEST_CASE("a block of pixels of a plane is what its camera's pixel sees") {
  for (const Camera& camera : {pinhole, distorted}) {
    for (const int factor : {2, 3, 4}) {
      const Plane plane = slanted_plane(2.0, 0.8, 0.4);
      const Camera coarse = camera.binned(factor);
      CHECK(coarse.width() == width / factor);
      CHECK(coarse.binning() == factor);
      CHECK(coarse.binned(2).binning() == 2 * factor);
      const DepthImage mean = binned(render(camera, plane), camera, factor), exact = render(coarse, plane);
      CHECK((mean / exact - 1.0F).abs().maxCoeff() < 2e-4F);
    }
  }
  CHECK(pinhole.binned(1) == pinhole);
  CHECK(pinhole.binned(2) != Camera::pinhole(width / 2, height / 2, 50.0, 52.0, 28.75, 23.25));  // of larger pixels
}

TEST_CASE("independent noise of four pixels is halved") {
  const Plane plane = slanted_plane(2.0, 0.3, 0.0);
  DepthImage noisy = render(pinhole, plane);
  add_noise(noisy, {0.004, 0.0, 0.0}, 1);
  const DepthImage error = binned(noisy, pinhole, 2) - render(pinhole.binned(2), plane);
  CHECK(std::sqrt(error.square().mean()) == doctest::Approx(0.002).epsilon(0.1));
  CHECK(std::abs(error.mean()) < 1e-4);
}

TEST_CASE("nothing is invented between two surfaces") {
  DepthImage step = DepthImage::Constant(height, width, 1.0F);
  step.rightCols(51).setConstant(1.2F);  // in the middle of a block
  const DepthImage mean = binned(step, pinhole, 2);
  CHECK((mean.isNaN() || (mean - 1.0F).abs() < 1e-6F || (mean - 1.2F).abs() < 1e-6F).all());
  CHECK(mean.isNaN().count() == height / 2);
  const DepthImage three = binned(step, pinhole, 3);  // most of a block are of one surface
  CHECK((three.isNaN()).count() == 0);
}

TEST_CASE("an image that was spread over more pixels than its camera has becomes whole") {
  const Plane plane = slanted_plane(2.0, 0.4, 0.2);
  const auto spread = [&](auto&& is_measured) {
    DepthImage depth = render(vga, plane);
    for (Eigen::Index v = 0; v < depth.rows(); ++v) {
      for (Eigen::Index u = 0; u < depth.cols(); ++u) {
        if (!is_measured(u, v)) depth(v, u) = missing;
      }
    }
    return depth;
  };
  const auto check = [&](const DepthImage& depth, int factor) {
    REQUIRE(binning_for(depth, MaskImage(), vga) == factor);
    const Camera coarse = vga.binned(factor);
    const DepthImage clean = preprocess_depth(factor > 1 ? binned(depth, vga, factor) : depth, coarse);
    const DepthImage exact = render(coarse, plane);
    const auto num_kept = static_cast<double>((!clean.isNaN()).count());
    CHECK(num_kept > 0.95 * static_cast<double>(clean.size()));
    // A block tells of some of its pixels, of which each looks a little aside.
    CHECK(clean.isNaN().select(0.0F, (clean / exact - 1.0F).abs()).maxCoeff() < 0.004F * static_cast<float>(factor));
  };
  check(spread([](auto u, auto v) { return u % 3 != 0 && v % 3 != 0; }), 2);
  check(spread([](auto u, auto v) { return (u + v) % 2 == 0; }), 2);
  check(spread([](auto u, auto v) { return u % 2 == 0 && v % 2 == 0; }), 2);
  check(spread([](auto, auto v) { return v % 4 == 0; }), 2);
  for (const int apart : {3, 4, 5, 8}) {
    CAPTURE(apart);
    check(spread([&](auto u, auto v) { return u % apart == 0 && v % apart == 0; }), apart);
  }
}

TEST_CASE("less than half of what a block usually has is no measurement") {
  DepthImage depth = DepthImage::Constant(4, 12, 2.0F);
  depth(0, 0) = depth(0, 1) = missing;
  depth(0, 2) = depth(0, 3) = depth(1, 2) = 0.0F;
  depth(2, 4) = -1.0F;
  const DepthImage mean = binned(depth, Camera::pinhole(12, 4, 50.0, 50.0, 5.5, 1.5), 2);
  CHECK(mean(0, 0) == 2.0F);
  CHECK(std::isnan(mean(0, 1)));
  CHECK(mean(1, 2) == 2.0F);
}

TEST_CASE("what comes with pixels is that of those whose depth was taken") {
  const Camera camera = Camera::pinhole(4, 2, 50.0, 50.0, 1.5, 0.5);
  DepthImage depth = DepthImage::Constant(2, 4, 1.0F);
  depth(0, 1) = 5.0F;  // another surface
  depth.rightCols(2).setConstant(missing);
  const PixelBinning pixels(depth, camera, 2, 1);
  Colors colors = Colors::Zero(8, 3);
  colors.row(0).setConstant(10);
  colors.row(1).setConstant(250);
  colors.row(4).setConstant(20);
  colors.row(5).setConstant(30);
  CHECK(pixels.mean(colors).row(0) == Eigen::Matrix<std::uint8_t, 1, 3>(20, 20, 20));
  Attributes values(8, 1);
  values << 1.0F, 100.0F, missing, missing, missing, 3.0F, 0.0F, 0.0F;
  CHECK(pixels.mean(values)(0, 0) == 2.0F);
  CHECK(std::isnan(pixels.mean(values)(1, 0)));
  MaskImage levels(2, 4);
  levels << 7, 9, 0, 0, 2, 2, 0, 0;
  CHECK(pixels.commonest(levels)(0, 0) == 2);
  MaskImage mask(2, 4);
  mask << 1, 1, 1, 0, 0, 0, 0, 0;
  CHECK(pixels.majority(mask)(0, 0) == 1);
  CHECK(pixels.majority(mask)(0, 1) == 0);
}

TEST_CASE("as many pixels are averaged as leave those that are worked on") {
  const auto wall = [](const Camera& camera) { return render(camera, slanted_plane(2.0, 0.3, 0.4)); };
  const DepthImage full = wall(vga);
  CHECK(binning_for(full, MaskImage(), vga) == 2);
  CHECK(binning_for(wall(pinhole), MaskImage(), pinhole) == 1);
  CHECK(binning_for(wall(orthographic), MaskImage(), orthographic) == 1);
  DepthImage part = full;
  part.bottomRows(330).setConstant(missing);
  CHECK(binning_for(part, MaskImage(), vga) == 1);
  MaskImage mask = MaskImage::Zero(480, 640);
  mask.topRows(150).setOnes();
  CHECK(binning_for(full, mask, vga) == 1);
  CHECK(binning_for(DepthImage::Constant(480, 640, missing), MaskImage(), vga) == 2);
  CHECK(binning_for((full / 0.02F).round() * 0.02F, MaskImage(), vga) == 1);  // units of five pixels
  CHECK_THROWS_WITH_AS(binning_for(full, mask, pinhole), doctest::Contains("depth"), std::invalid_argument);
}

TEST_CASE("pixels are averaged to the same bits on any number of threads") {
  DepthImage noisy = render(pinhole, slanted_plane(2.0, 0.3, 0.0));
  add_noise(noisy, {0.02, 0.0, 0.0}, 1);
  const DepthImage one = binned(noisy, pinhole, 3, 1), four = binned(noisy, pinhole, 3, 4);
  CHECK(std::memcmp(one.data(), four.data(), sizeof(float) * static_cast<std::size_t>(one.size())) == 0);
}

TEST_CASE("cameras that cannot be coarser say so") {
  CHECK_THROWS_WITH_AS(orthographic.binned(2), doctest::Contains("binning"), std::invalid_argument);
  CHECK_THROWS_WITH_AS(pinhole.binned(91), doctest::Contains("binning"), std::invalid_argument);
  CHECK_THROWS_WITH_AS(pinhole.binned(0), doctest::Contains("binning"), std::invalid_argument);
}
