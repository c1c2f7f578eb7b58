#include "depth/gaps.hpp"
#include "depth_images.hpp"
#include "doctest/doctest.h"

using namespace nacre_test;

namespace {

// As a coarse image leaves it that was moved into a finer one: every third row and column is missing.
DepthImage cracked(const DepthImage& whole) {
  DepthImage depth = whole;
  for (Eigen::Index v = 1; v < depth.rows(); v += 3) depth.row(v).setConstant(missing);
  for (Eigen::Index u = 1; u < depth.cols(); u += 3) depth.col(u).setConstant(missing);
  return depth;
}

// As a sensor leaves it that measures no pixel with a given probability.
DepthImage scattered(const DepthImage& whole, double missing_part) {
  DepthImage depth = whole;
  for (Eigen::Index i = 0; i < depth.size(); ++i) {
    if (random_uniform(7, static_cast<std::uint64_t>(i)) < missing_part) depth.data()[i] = missing;
  }
  return depth;
}

}  // namespace

TEST_CASE("cracks in a plane are filled with the plane itself") {
  for (const Camera& camera : {pinhole, orthographic}) {
    for (const double slant : {0.0, 0.4, 0.8}) {
      const DepthImage whole = render(camera, slanted_plane(1.5, slant, 0.8));
      const DepthImage depth = cracked(whole);
      REQUIRE(has_gaps(depth, camera));
      const DepthImage filled = fill_gaps(depth, camera);
      for (Eigen::Index v = 1; v + 1 < whole.rows(); ++v) {
        for (Eigen::Index u = 1; u + 1 < whole.cols(); ++u) {
          REQUIRE(filled(v, u) == doctest::Approx(whole(v, u)).epsilon(1e-5));
        }
      }
    }
  }
}

TEST_CASE("a crack between two surfaces stays") {
  DepthImage depth = render(pinhole, slanted_plane(1.5, 0.0, 0.0));
  const Eigen::Index edge = 3 * (depth.cols() / 6) + 1;
  depth.rightCols(depth.cols() - edge) += 0.5F;
  const DepthImage filled = fill_gaps(cracked(depth), pinhole);
  CHECK(std::isnan(filled(5, edge)));
  CHECK(filled(5, edge + 3) == doctest::Approx(2.0));
}

TEST_CASE("images as sensors make them have few gaps") {
  DepthImage depth = render(pinhole, slanted_plane(1.5, 0.4, 0.8));
  CHECK_FALSE(has_gaps(depth, pinhole));
  for (Eigen::Index v = 0; v < depth.rows(); ++v) {
    for (Eigen::Index u = 13 * v % 60; u < depth.cols(); u += 60) depth(v, u) = missing;  // single pixels
  }
  CHECK_FALSE(has_gaps(depth, pinhole));
  depth.rightCols(width / 2).setConstant(missing);
  CHECK_FALSE(has_gaps(depth, pinhole));
  CHECK_FALSE(has_gaps(DepthImage::Constant(height, width, missing), pinhole));
}

TEST_CASE("pixels missing at random are filled") {
  const DepthImage whole = render(pinhole, slanted_plane(1.5, 0.4, 0.8));
  for (const double part : {0.1, 0.3, 0.5}) {
    const DepthImage depth = scattered(whole, part);
    REQUIRE(has_gaps(depth, pinhole));
    const DepthImage filled = fill_gaps(depth, pinhole);
    CHECK(filled.isNaN().count() < depth.isNaN().count() / 2);
    CHECK(((filled - whole).abs() < 1e-5F || filled.isNaN()).all());
    const DepthImage clean = preprocess_depth(depth, pinhole);
    CHECK(clean.isFinite().count() > depth.isFinite().count());
  }
}

TEST_CASE("pixels missing at random do not change what noise is found") {
  DepthImage whole = render(pinhole, slanted_plane(1.5, 0.4, 0.8));
  add_noise(whole, {0.003, 0.0, 0.0}, 4);
  const NoiseModel expected = estimate_noise(whole, pinhole);
  for (const double part : {0.1, 0.3}) {
    const NoiseModel noise = estimate_noise(scattered(whole, part), pinhole);
    CHECK(noise.sigma(1.5) == doctest::Approx(expected.sigma(1.5)).epsilon(0.25));
  }
}

TEST_CASE("pixels that are wrong at random are taken for missing, and the noise of the others is measured") {
  const DepthImage whole = render(pinhole, slanted_plane(1.5, 0.4, 0.8));
  DepthImage depth = whole;
  add_noise(depth, {0.002, 0.0, 0.0}, 3);
  const NoiseModel without = estimate_noise(depth, pinhole);
  for (Eigen::Index i = 0; i < depth.size(); ++i) {
    const auto pixel = static_cast<std::uint64_t>(i);
    if (random_uniform(7, pixel) < 0.1) depth.data()[i] = static_cast<float>(0.3 + 5.0 * random_uniform(8, pixel));
  }
  REQUIRE(has_gaps(depth, pinhole));
  const DepthImage clean = preprocess_depth(depth, pinhole);
  CHECK((clean.isFinite() && (clean - whole).abs() > 0.1F).count() < clean.size() / 1000);
  CHECK(clean.isFinite().count() > 0.9 * static_cast<double>(clean.size()));
  CHECK(estimate_noise(depth, pinhole).sigma(1.5) == doctest::Approx(without.sigma(1.5)).epsilon(0.2));
}

TEST_CASE("a wire before a wall is no gap") {
  DepthImage depth = DepthImage::Constant(height, width, 2.0F);
  for (Eigen::Index u = 5; u < width; u += 10) depth.col(u).setConstant(1.0F);
  CHECK_FALSE(has_gaps(depth, pinhole));
  const DepthImage filled = fill_gaps(depth, pinhole);
  CHECK((filled == depth).all());
}

TEST_CASE("noise that is larger than pixels are wide leaves no gaps") {
  for (const double sigma : {0.3, 0.6, 1.2}) {
    CAPTURE(sigma);
    DepthImage depth = render(pinhole, slanted_plane(5.0, 0.2, 0.0));
    add_noise(depth, {sigma, 0.0, 0.0}, 5);
    CHECK_FALSE(has_gaps(depth, pinhole));
  }
}
