#include "depth/coarse_depth.hpp"
#include "depth_images.hpp"
#include "doctest/doctest.h"
#include "nacre/depth.hpp"

using namespace nacre_test;

namespace {

DepthImage rounded(const DepthImage& depth, float unit) { return (depth / unit).round() * unit; }

// As whole pixels of disparity are, and then stored in whole millimetres.
DepthImage triangulated(const DepthImage& depth, float unit) {
  return rounded(1.0F / rounded(1.0F / depth, unit), 0.001F);
}

float largest_error(const DepthImage& a, const DepthImage& b) { return (a - b).abs().maxCoeff(); }

}  // namespace

TEST_CASE("the unit of coarse depth is found") {
  const auto slope = [](double slant) { return render(pinhole, slanted_plane(3.0, slant, 0.4)); };
  const auto depth_unit = [](const DepthImage& depth) {
    const DepthUnit unit = coarse_unit(depth);
    CHECK_FALSE(unit.is_of_inverse);
    return unit.step;
  };
  CHECK(depth_unit(rounded(slope(0.05), 0.005F)) == doctest::Approx(0.005).epsilon(1e-3));
  CHECK(depth_unit(rounded(slope(0.05), 0.02F)) == doctest::Approx(0.02).epsilon(1e-3));
  CHECK(depth_unit(rounded(slope(0.3), 0.1F)) == doctest::Approx(0.1).epsilon(1e-3));
  DepthImage noisy = slope(0.2);
  add_noise(noisy, {0.004, 0.0, 0.0}, 3);
  CHECK(depth_unit(rounded(noisy, 0.02F)) == doctest::Approx(0.02).epsilon(1e-3));
}

TEST_CASE("whole pixels of disparity are steps of inverse depth") {
  const float unit = 1.0F / 33.0F;  // a focal length of 440 pixels, a baseline of 75 mm
  const DepthImage plane = render(pinhole, slanted_plane(1.5, 0.5, 0.4)), steps = triangulated(plane, unit);
  const DepthUnit found = coarse_unit(steps);
  CHECK(found.is_of_inverse);
  CHECK(found.step == doctest::Approx(unit).epsilon(1e-2));
  CHECK(found.at(2.0) == doctest::Approx(4.0 * unit).epsilon(1e-2));

  const DepthImage smooth = interpolate_plateaus(steps, found, 1);
  CHECK(largest_error(1.0F / smooth, 1.0F / steps) <= 0.51F * unit);
  const auto mean_error = [&](const DepthImage& depth) {
    return (depth - plane).abs().block(20, 20, height - 40, width - 40).mean();
  };
  CHECK(mean_error(smooth) < 0.4F * mean_error(steps));
  const NoiseModel noise = estimate_noise(steps, pinhole, 1);
  for (const double depth : {1.0, 3.0}) CHECK(noise.sigma(depth) >= found.at(depth) / std::sqrt(12.0));
}

TEST_CASE("depth that is finer than its noise, or has no levels, has no unit") {
  const DepthImage slope = render(pinhole, slanted_plane(3.0, 0.2, 0.4));
  CHECK(coarse_unit(slope).step == 0.0F);
  DepthImage noisy = slope;
  add_noise(noisy, {0.002, 0.0, 0.0}, 3);
  CHECK(coarse_unit(noisy).step == 0.0F);
  CHECK(coarse_unit(rounded(noisy, 0.001F)).step == 0.0F);
  DepthImage walls = DepthImage::Constant(height, width, 1.0F);
  walls.rightCols(width / 2).setConstant(1.2F);
  CHECK(coarse_unit(walls).step == 0.0F);
  CHECK(coarse_unit(DepthImage::Constant(height, width, missing)).step == 0.0F);
}

TEST_CASE("between the ends of plateaus a plane is itself again") {
  for (const double slant : {0.5, 0.8, 1.1}) {
    const DepthImage plane = render(orthographic, slanted_plane(3.0, slant, 0.6));
    const float unit = 0.02F;
    const DepthImage steps = rounded(plane, unit), smooth = interpolate_plateaus(steps, {unit, false}, 1);
    CHECK(largest_error(smooth, steps) <= 0.5F * unit + 1e-6F);
    const DepthImage inner_error = (smooth - plane).abs().block(20, 20, height - 40, width - 40);
    CHECK(inner_error.mean() < 0.4F * (steps - plane).abs().block(20, 20, height - 40, width - 40).mean());
  }
}

TEST_CASE("a step of more than one unit is an edge, and stays; what was not measured is not invented") {
  const float unit = 0.02F;
  DepthImage steps = rounded(render(pinhole, slanted_plane(3.0, 0.2, 0.4)), unit);
  steps.rightCols(width / 2) += 0.5F;
  steps(5, 7) = missing;
  const DepthImage smooth = interpolate_plateaus(steps, {unit, false}, 1);
  CHECK(std::isnan(smooth(5, 7)));
  const DepthImage step = smooth.col(width / 2) - smooth.col(width / 2 - 1);
  CHECK(step.minCoeff() > 0.5F - 1.5F * unit);
}

TEST_CASE("coarse depth is noisy by its unit, and the same for any number of threads") {
  const float unit = 0.05F;
  const DepthImage steps = rounded(render(pinhole, slanted_plane(3.0, 0.2, 0.4)), unit);
  const NoiseModel noise = estimate_noise(steps, pinhole, 1);
  CHECK(noise.constant >= unit / std::sqrt(12.0));
  CHECK(noise.sigma(3.0) < unit);
  const DepthImage one = interpolate_plateaus(steps, {unit, false}, 1),
                   two = interpolate_plateaus(steps, {unit, false}, 2);
  CHECK((one == two).all());
}
