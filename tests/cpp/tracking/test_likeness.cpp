#include <cmath>

#include "base/random.hpp"
#include "depth_images.hpp"
#include "doctest/doctest.h"
#include "tracking/likeness.hpp"

using namespace nacre;
using namespace nacre_test;

namespace {

// Of each pixel of a wall two metres away a point that is as bright as `of_model` says, and an image that shows it as
// `of_view` does.
template <class OfModel, class OfView>
Likeness of_wall(OfModel&& of_model, OfView&& of_view, double wall = 2.0) {
  DepthView view;
  view.depth = Values::Constant(width * height, 2.0F);
  view.sigma = Values::Constant(width * height, 0.001F);
  PointsInView model{Points(width * height, 3), Points(width * height, 3), Values(width * height)};
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const Eigen::Index row = static_cast<Eigen::Index>(v) * width + u;
      const Ray ray = pinhole.ray(u, v);
      model.points.row(row) << ray.direction_x, ray.direction_y, ray.direction_z;
      model.points.row(row) *= static_cast<float>(wall) / ray.direction_z;
      model.normals.row(row) << 0.0F, 0.0F, -1.0F;
      model.brightness[row] = static_cast<float>(of_model(u, v));
      view.brightness.push_back(static_cast<std::uint8_t>(of_view(u, v)));
    }
  }
  return likeness(model, view, Pose::Identity(), pinhole, {0.01}, 10);
}

// Paint in 0 to 127.
int paint(int u, int v, std::uint64_t seed = 0) {
  return static_cast<int>(random_bits(seed, static_cast<std::uint64_t>(v) * width + static_cast<std::uint64_t>(u)) %
                          128);
}
const auto paint_of_model = [](int u, int v) { return paint(u, v); };
const auto other_paint = [](int u, int v) { return paint(u, v, 1); };

}  // namespace

TEST_CASE("what has the same paint is alike, in any light") {
  CHECK(of_wall(paint_of_model, paint_of_model).agreement > 0.99);
  const auto in_other_light = [](int u, int v) { return paint(u, v) * (width + u) / (2 * width) + 100 * v / height; };
  CHECK(of_wall(paint_of_model, in_other_light).agreement > 0.95);
}

TEST_CASE("other paint agrees by chance alone, and its negative disagrees") {
  const Likeness other = of_wall(paint_of_model, other_paint);
  CHECK(other.num_squares > 50.0);
  CHECK(std::abs(other.agreement) * std::sqrt(other.num_squares) < 4.0);
  CHECK(of_wall(paint_of_model, [](int u, int v) { return 127 - paint(u, v); }).agreement < -0.95);
}

TEST_CASE("where nothing is known nothing is said") {
  const auto unknown = [](int, int) { return std::nanf(""); };
  const auto plain = [](int, int) { return 100; };
  CHECK(of_wall(unknown, paint_of_model).num_squares == 0.0);           // points without colours
  CHECK(of_wall(plain, plain).num_squares == 0.0);                      // no texture
  CHECK(of_wall(paint_of_model, other_paint, 1.5).num_squares == 0.0);  // the model is elsewhere
  CHECK(likeness({Points(0, 3), Points(0, 3), Values()}, DepthView(), Pose::Identity(), pinhole, {}, 10).num_squares ==
        0.0);
}
