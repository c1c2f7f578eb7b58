#include <cmath>

#include "base/random.hpp"
#include "deformation/node_growth.hpp"
#include "deformation/warp_registration.hpp"
#include "doctest/doctest.h"

using namespace nacre;

namespace {

constexpr float spacing = 0.008F;
constexpr double sigma = 0.0005;

// A sheet with relief that is rolled up around an axis along y: its length along x stays.
OrientedPoint on_sheet(float x, float y, float curvature, float relief = 0.01F) {
  const float angle = curvature * x, height = relief * std::sin(40.0F * x) * std::cos(35.0F * y);
  const float slope_x = 40.0F * relief * std::cos(40.0F * x) * std::cos(35.0F * y);
  const float slope_y = -35.0F * relief * std::sin(40.0F * x) * std::sin(35.0F * y);
  const Eigen::Vector3f along(std::cos(angle), 0.0F, std::sin(angle)), up(std::sin(angle), 0.0F, -std::cos(angle));
  const Eigen::Vector3f base =
      curvature == 0.0F ? Eigen::Vector3f(x, y, 0.6F)
                        : Eigen::Vector3f(std::sin(angle) / curvature, y, 0.6F + (1.0F - std::cos(angle)) / curvature);
  const Eigen::Vector3f normal = (up - slope_x * along - slope_y * Eigen::Vector3f::UnitY()).normalized();
  return {base + height * up, normal};
}

struct Scene {
  WarpField field;
  OrientedPoints canonical;
  std::vector<std::int32_t> rows;

  explicit Scene(float relief = 0.01F) {
    std::vector<std::int32_t> last_seen;
    for (int i = -20; i <= 20; ++i) {
      for (int j = -15; j <= 15; ++j) {
        const OrientedPoint point =
            on_sheet(spacing * static_cast<float>(i), spacing * static_cast<float>(j), 0.0F, relief);
        rows.push_back(static_cast<std::int32_t>(canonical.points.size()));
        canonical.points.push_back(point.point);
        canonical.normals.push_back(point.normal);
        last_seen.push_back(0);
      }
    }
    field.node_spacing = 0.05;
    const std::vector<float> spacings(canonical.points.size(), spacing);
    grow(field, {canonical.points, canonical.normals, spacings, last_seen, 0, static_cast<double>(spacing)});
  }

  // Root mean square distance of points, from a column on, from where the sheet, rolled up, has them [m].
  double error(float curvature, int first_column = -20) const {
    const OrientedPoints moved = warped(field, canonical.points, canonical.normals, 1);
    double sum = 0.0;
    const auto first = static_cast<std::size_t>(31 * (first_column + 20));
    std::size_t k = first;
    for (int i = first_column; i <= 20; ++i) {
      for (int j = -15; j <= 15; ++j) {
        const OrientedPoint truth =
            on_sheet(spacing * static_cast<float>(i), spacing * static_cast<float>(j), curvature);
        sum += static_cast<double>((moved.points[k++] - truth.point).squaredNorm());
      }
    }
    return std::sqrt(sum / static_cast<double>(k - first));
  }
};

ShownSurface shown(float curvature, float relief = 0.01F) {
  constexpr int size = 90;
  ShownSurface surface{Points(size * size, 3), Points(size * size, 3), Values(size * size), Values(size * size)};
  for (int k = 0; k < size * size; ++k) {
    const OrientedPoint point = on_sheet(0.004F * static_cast<float>(k % size - size / 2),
                                         0.003F * static_cast<float>(k / size - size / 2), curvature, relief);
    const auto noise = static_cast<float>(sigma * random_normal(3, static_cast<std::uint64_t>(k)));
    surface.points.row(k) = (point.point + noise * point.normal).transpose();
    surface.normals.row(k) = point.normal.transpose();
  }
  surface.sigma.setConstant(static_cast<float>(sigma));
  surface.reach.setConstant(0.004F);
  return surface;
}

}  // namespace

TEST_CASE("a sheet that is rolled up is followed, its points with it") {
  Scene scene;
  const double before = scene.error(1.2F);
  CHECK(before > 0.005);
  const WarpFit fit = register_warp(scene.field, scene.canonical, scene.rows, shown(1.2F), 1);
  CHECK(fit.is_bent);
  CHECK(fit.explained > 0.95);
  CHECK(scene.error(1.2F) < 0.2 * before);
  CHECK(scene.field.strain() < 0.02);
}

TEST_CASE("what a frame hides stays as it was bent") {
  Scene scene;
  register_warp(scene.field, scene.canonical, scene.rows, shown(1.2F), 1);
  ShownSurface half = shown(1.5F);
  for (Eigen::Index i = 0; i < half.points.rows(); ++i) {
    if (half.points(i, 0) > 0.0F) half.points(i, 2) += 1.0F;
  }
  const double flat = Scene().error(1.2F, 4);
  CHECK(register_warp(scene.field, scene.canonical, scene.rows, half, 1).is_bent);
  CHECK(scene.error(1.2F, 4) < 0.5 * flat);
}

TEST_CASE("what noise explains bends nothing") {
  Scene scene;
  const std::vector<WarpNode> before = scene.field.nodes;
  const WarpFit fit = register_warp(scene.field, scene.canonical, scene.rows, shown(0.0F), 1);
  CHECK(!fit.is_bent);
  for (std::size_t i = 0; i < before.size(); ++i) {
    CHECK(scene.field.nodes[i].position == before[i].position);
    CHECK((fit.bent[i].position - before[i].position).norm() < 0.002);  // nor had it far
  }
}

TEST_CASE("what was bent goes on where what was still would stay") {
  Scene still, bending;
  CHECK(!register_warp(still.field, still.canonical, still.rows, shown(0.03F), 1).is_bent);
  const std::vector<std::uint8_t> was_bending(bending.field.nodes.size(), 1);
  CHECK(register_warp(bending.field, bending.canonical, bending.rows, shown(0.03F), 1, was_bending).is_bent);
}

TEST_CASE("a frame that shows nothing near leaves the shape") {
  Scene scene;
  ShownSurface far = shown(0.0F);
  far.points.col(2).array() += 1.0F;
  const WarpFit fit = register_warp(scene.field, scene.canonical, scene.rows, far, 1);
  CHECK(!fit.is_bent);
  CHECK(fit.explained == 0.0);
  CHECK(!register_warp(scene.field, scene.canonical, scene.rows, ShownSurface(), 1).is_bent);
  CHECK(scene.error(0.0F) < 1e-6);
}

// Of a smooth sheet: 0 to 200 on its material.
float paint(float x, float y) { return 100.0F + 90.0F * std::sin(60.0F * x) * std::cos(70.0F * y); }

TEST_CASE("what slides along itself is followed by its colours, in whatever exposure") {
  const float curvature = 1.2F, slide = 0.008F, exposure = 20.0F;
  Scene with_colors(0.0F), without(0.0F);
  std::vector<Eigen::Vector3f> colors;
  for (const Eigen::Vector3f& point : with_colors.canonical.points) {
    colors.push_back(Eigen::Vector3f::Constant(paint(point.x(), point.y())));
  }
  ShownSurface surface = shown(curvature, 0.0F);
  surface.spacing = static_cast<double>(spacing);
  surface.brightness.resize(surface.points.rows());
  surface.gradient.resize(surface.points.rows(), 3);
  for (Eigen::Index k = 0; k < surface.points.rows(); ++k) {
    const Eigen::Vector3f normal = surface.normals.row(k).transpose(), along = normal.cross(Eigen::Vector3f::UnitY());
    const float x = std::atan2(normal.x(), -normal.z()) / curvature, y = surface.points(k, 1) - slide;
    const float by_x = 90.0F * 60.0F * std::cos(60.0F * x) * std::cos(70.0F * y);
    const float by_y = -90.0F * 70.0F * std::sin(60.0F * x) * std::sin(70.0F * y);
    surface.brightness[k] =
        exposure + paint(x, y) + static_cast<float>(random_normal(4, static_cast<std::uint64_t>(k)));
    const float towards = along.x() > 0.0F ? 1.0F : -1.0F;
    surface.gradient.row(k) = (by_x * towards * along + by_y * Eigen::Vector3f::UnitY()).transpose();
  }
  register_warp(without.field, without.canonical, without.rows, surface, 1);
  register_warp(with_colors.field, with_colors.canonical, with_colors.rows, surface, 1, {}, colors);
  const auto error = [&](const Scene& scene) {
    const OrientedPoints moved = warped(scene.field, scene.canonical.points, scene.canonical.normals, 1);
    double sum = 0.0;
    for (std::size_t i = 0; i < moved.points.size(); ++i) {
      const Eigen::Vector3f& rest = scene.canonical.points[i];
      const OrientedPoint truth = on_sheet(rest.x(), rest.y() + slide, curvature, 0.0F);
      sum += static_cast<double>((moved.points[i] - truth.point).squaredNorm());
    }
    return std::sqrt(sum / static_cast<double>(moved.points.size()));
  };
  CHECK(error(without) > 0.006);
  CHECK(error(with_colors) < 0.25 * error(without));
}

TEST_CASE("any number of threads bends to the same bits") {
  Scene one, many;
  register_warp(one.field, one.canonical, one.rows, shown(1.2F), 1);
  register_warp(many.field, many.canonical, many.rows, shown(1.2F), 3);
  for (std::size_t i = 0; i < one.field.nodes.size(); ++i) {
    CHECK(one.field.nodes[i].position == many.field.nodes[i].position);
    CHECK(one.field.nodes[i].rotation == many.field.nodes[i].rotation);
  }
}
