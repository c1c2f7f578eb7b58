#include "depth/saturation.hpp"
#include "depth_images.hpp"
#include "doctest/doctest.h"

using namespace nacre;
using namespace nacre_test;

namespace {

// A slanted surface a metre away as a camera of some noise sees it.
DepthImage surface() {
  DepthImage depth = render(pinhole, slanted_plane(1.0, 0.4, 0.7));
  add_noise(depth, NoiseModel{0.002, 0.0}, 1);
  return depth;
}

void fill(DepthImage& depth, float value) { depth.block(10, 20, 40, 30).setConstant(value); }

}  // namespace

TEST_CASE("the value for what was too far is no measurement") {
  for (const float largest : {4.095F, 10.0F, 65.535F, 1e10F}) {
    DepthImage depth = surface(), expected = depth;
    fill(depth, largest);
    fill(expected, missing);
    CHECK(same_bits(without_saturated(depth), expected));
  }
}

TEST_CASE("most of an image may hold it, where a camera sees one thing alone") {
  DepthImage depth = DepthImage::Constant(height, width, 10.0F);
  DepthImage expected = DepthImage::Constant(height, width, missing);
  depth.block(30, 40, 30, 40) = expected.block(30, 40, 30, 40) = surface().block(30, 40, 30, 40);
  CHECK(same_bits(without_saturated(depth), expected));
}

TEST_CASE("surfaces may reach up to what is cut off") {
  DepthImage depth = render(pinhole, slanted_plane(1.0, 1.2, 1.5707963));
  const std::int64_t num_far = (depth > 4.0F).count();
  REQUIRE(num_far > 100);
  depth = (depth > 4.0F).select(4.0F, depth);
  const DepthImage clean = without_saturated(depth);
  REQUIRE(clean.size() == depth.size());
  CHECK(num_valid(depth) - num_valid(clean) == (depth == 4.0F).count());
}

TEST_CASE("what is measured stays") {
  CHECK(without_saturated(surface()).size() == 0);
  CHECK(without_saturated(DepthImage::Constant(height, width, missing)).size() == 0);
  CHECK(without_saturated(DepthImage::Constant(height, width, 2.0F)).size() == 0);

  DepthImage wall = surface();
  fill(wall, 2.5F);
  CHECK(without_saturated(wall).size() == 0);  // a flat one, as without noise

  DepthImage far = DepthImage::Constant(height, width, 6.0F);
  add_noise(far, NoiseModel{0.03, 0.0}, 2);
  far = (far * 100.0F).round() / 100.0F;  // in centimetres
  far.leftCols(80) = surface().leftCols(80);
  CHECK(without_saturated(far).size() == 0);

  DepthImage few = surface();
  few.block(16, 16, 2, 2).setConstant(10.0F);
  CHECK(without_saturated(few).size() == 0);
}
