#include <cmath>
#include <limits>

#include "doctest/doctest.h"
#include "nacre/rendering.hpp"

using nacre::Colors;
using nacre::Picture;
using nacre::PictureView;
using nacre::Points;
using nacre::PointsDouble;
using nacre::Values;

namespace {

constexpr int side = 60;

PictureView view_along_z() {
  PictureView view;
  view.view_from_model.setIdentity();
  view.metres_per_pixel = 0.01;
  view.width = view.height = side;
  return view;
}

// 900 points of a wave across the picture, facing the viewer, and as many behind them.
struct Scene {
  PointsDouble points{1800, 3};
  Points normals = Points::Constant(1800, 3, 0.0f);
  Colors colors = Colors::Zero(1800, 3);
  Values radii = Values::Constant(1800, 0.03f);

  Scene() {
    normals.col(2).setConstant(-1.0f);
    for (int i = 0; i < 1800; ++i) {
      const bool behind = i >= 900;
      const double x = 0.02 * (i % 30) - 0.29, y = 0.02 * (i / 30 % 30) - 0.29;
      points.row(i) << x, y, (behind ? 1.0 : 0.0) + 0.02 * std::sin(20.0 * x);
      colors(i, behind ? 2 : 0) = 255;
    }
  }

  Picture drawn(const PictureView& view, int num_threads = 1) const {
    return nacre::render_points(points, normals, colors, radii, view, false, num_threads);
  }
};

}  // namespace

TEST_CASE("The picture has the same bits for any number of threads") {
  PictureView view = view_along_z();
  const Scene scene;
  for (const double distance : {std::numeric_limits<double>::infinity(), 2.0}) {
    view.distance = distance;
    const Picture alone = scene.drawn(view);
    for (const int num_threads : {2, 3, 7}) CHECK(scene.drawn(view, num_threads) == alone);
  }
}

TEST_CASE("What is in front hides what is behind, and leaves no hole") {
  const Picture picture = Scene().drawn(view_along_z());
  CHECK((picture.col(3).array() == 255).all());
  CHECK((picture.col(0).array() > 128).all());
  CHECK((picture.col(2).array() == 0).all());
}

TEST_CASE("Points that are not finite and radii of any size are drawn or left out") {
  Scene scene;
  const float odd[] = {0.0f, -1.0f, 1e30f, std::numeric_limits<float>::infinity(),
                       std::numeric_limits<float>::quiet_NaN()};
  for (int i = 0; i < 5; ++i) scene.radii(i) = odd[i];
  scene.points(7, 1) = std::numeric_limits<double>::quiet_NaN();
  scene.points(8, 2) = std::numeric_limits<double>::infinity();
  scene.points(9, 0) = 1e300;
  scene.normals.row(10).setConstant(std::numeric_limits<float>::quiet_NaN());
  scene.normals.row(11).setZero();
  scene.normals.row(12).setConstant(std::numeric_limits<float>::max());
  PictureView view = view_along_z();
  for (const double distance : {std::numeric_limits<double>::infinity(), 1.0}) {
    view.distance = distance;
    CHECK(scene.drawn(view).rows() == side * side);
  }
}

TEST_CASE("Arguments that do not fit are named") {
  Scene scene;
  PictureView view = view_along_z();
  scene.radii.conservativeResize(3);
  CHECK_THROWS_WITH(scene.drawn(view), "radii must be one per point, got 3");
  scene = Scene();
  view.width = 0;
  CHECK_THROWS_WITH(scene.drawn(view), "width must be positive, got 0");
  view = view_along_z();
  view.metres_per_pixel = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(scene.drawn(view), "metres_per_pixel must be positive, got nan");
}

TEST_CASE("No point makes an empty picture") {
  const Picture picture =
      nacre::render_points(PointsDouble(0, 3), Points(0, 3), Colors(0, 3), Values(0), view_along_z());
  CHECK((picture.array() == 0).all());
}
