// The kernel of the normals: every instruction set of this processor against a plain fit.
#include <algorithm>
#include <cstring>
#include <vector>

#include "camera/ray_table.hpp"
#include "depth/inverse_depth_image.hpp"
#include "depth_kernels.hpp"
#include "doctest/doctest.h"

namespace {

using namespace nacre_test;
using nacre::evaluate;
using nacre::PlanarImage;

simd::NormalRule normal_rule(const PlanarImage& image, const Camera& camera, double noise) {
  const simd::Quadratic sigma = image.sigma({noise, 0.0, 0.0}), unit_slope = image.unit_slope();
  return {sigma,
          unit_slope,
          sigma * 5.66F,
          unit_slope * 5.67F,
          0.07F,
          0.4F,
          0.02F,
          static_cast<float>(camera.fx()),
          static_cast<float>(camera.fy())};
}

struct PlaneFit {
  Eigen::Vector3d plane = Eigen::Vector3d::Constant(missing);
  double misfit = 0.0;  // squared residuals per degree of freedom
};

// A window of columns and rows from the pixel.
struct Window {
  int left, right, top, bottom;
};

// To the pixels of a window that differ from its centre by at most the gate.
PlaneFit fit_window(const PlanarImage& image, const simd::NormalRule& rule, const Window& window, int radius,
                    double spread, int u, int v) {
  const float own = image.row(v)[u];
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  double squares = 0.0;
  for (int dv = window.top; dv <= window.bottom; ++dv) {
    for (int du = window.left; du <= window.right; ++du) {
      const float difference = image.row(v + dv)[u + du] - own;
      const auto distance = static_cast<float>(std::max(std::abs(du), std::abs(dv)));
      if (!(std::abs(difference) <= evaluate(rule.gate_base, own) + distance * evaluate(rule.gate_slope, own)))
        continue;
      const Eigen::Vector3d x(1, du, dv);
      matrix += x * x.transpose();
      right += x * static_cast<double>(difference);
      squares += static_cast<double>(difference) * difference;
    }
  }
  PlaneFit fit;
  const double n = matrix(0, 0);
  const double side = 2 * radius + 1;
  const double determinant = n > 0 ? matrix.determinant() / n : 0.0;  // of the central second moments
  if (n < static_cast<double>(rule.min_filled) * side * side - 1e-6) return fit;
  if (determinant < static_cast<double>(rule.min_spread) * spread * spread - 1e-6) return fit;
  fit.plane = matrix.inverse() * right;
  fit.misfit = (squares - fit.plane.dot(right)) / (n - 3.0);
  return fit;
}

// Of the plane value = own + plane . (1, du, dv) at a pixel.
Eigen::Vector3d normal_of(const Eigen::Vector3d& plane, const Camera& camera, float own, int u, int v) {
  if (!plane.allFinite()) return plane;
  if (camera.model() == Camera::Model::orthographic) {
    return Eigen::Vector3d(plane.y() * camera.fx(), plane.z() * camera.fy(), -1.0).normalized();
  }
  const auto xy = [&](int column, int row) -> Eigen::Vector2d {
    const Ray ray = camera.ray(std::clamp(column, 0, camera.width() - 1), std::clamp(row, 0, camera.height() - 1));
    return {static_cast<double>(ray.direction_x) / static_cast<double>(ray.direction_z),
            static_cast<double>(ray.direction_y) / static_cast<double>(ray.direction_z)};
  };
  Eigen::Matrix2d ray_from_pixel = Eigen::Vector2d(1.0 / camera.fx(), 1.0 / camera.fy()).asDiagonal();
  if (camera.distortion() != Camera::Distortion{}) {
    const auto between = [](int i, int size) { return std::min(i + 1, size - 1) - std::max(i - 1, 0); };
    ray_from_pixel << (xy(u + 1, v) - xy(u - 1, v)) / std::max(between(u, camera.width()), 1),
        (xy(u, v + 1) - xy(u, v - 1)) / std::max(between(v, camera.height()), 1);
  }
  const Eigen::Vector2d ab = ray_from_pixel.inverse().transpose() * plane.tail<2>();
  return -Eigen::Vector3d(ab.x(), ab.y(), static_cast<double>(own) + plane.x() - ab.dot(xy(u, v))).normalized();
}

// The normals of one pixel by the definition: several where rounding decides between them; NaN where there is none.
std::vector<Eigen::Vector3d> normals_of(const PlanarImage& image, const Camera& camera, const simd::NormalRule& rule,
                                        int u, int v) {
  const Eigen::Vector3d none = Eigen::Vector3d::Constant(missing);
  const float own = image.row(v)[u];
  if (own != own) return {none};
  const auto spread = [](int r) { return static_cast<float>((2 * r + 1) * (2 * r + 1) * r * (r + 1)) / 3.0F; };
  int radius = simd::least_normal_window;
  while (radius < simd::largest_normal_window &&
         evaluate(rule.sigma, own) > rule.slope_sigma * evaluate(rule.unit_slope, own) * std::sqrt(spread(radius))) {
    ++radius;
  }
  const int r = radius;
  const auto fit = [&](const Window& window) { return fit_window(image, rule, window, r, spread(r), u, v); };
  const PlaneFit all = fit({-r, r, -r, r});
  const double variance = std::pow(evaluate(rule.sigma, own), 2), largest = 2.0 * variance;
  std::vector<Eigen::Vector3d> normals;
  if (!all.plane.allFinite() || all.misfit < 1.001 * largest)
    normals.push_back(normal_of(all.plane, camera, own, u, v));
  if (!all.plane.allFinite() || all.misfit < 0.999 * largest) return normals;
  const PlaneFit halves[] = {fit({-r, 0, -r, r}), fit({0, r, -r, r}), fit({-r, r, -r, 0}), fit({-r, r, 0, r})};
  double least = std::min(all.misfit, largest);
  for (const PlaneFit& half : halves) {
    if (half.plane.allFinite()) least = std::min(least, half.misfit);
  }
  const double most = least + 1e-3 * (least + variance);
  bool is_better = false;
  for (const PlaneFit& half : halves) {
    if (!half.plane.allFinite() || half.misfit > std::min(most, 1.001 * largest)) continue;
    normals.push_back(normal_of(half.plane, camera, own, u, v));
    is_better |= half.misfit < 0.999 * largest;
  }
  if (!is_better) normals.push_back(normal_of(all.plane, camera, own, u, v));
  return normals;
}

}  // namespace

TEST_CASE("normals are those of a plain fit, with the same bits on every instruction set") {
  for (const int w : widths) {
    // A column has no slope along u, and its camera model none either.
    for (const Camera& camera : cameras(w)) {
      for (const double noise : {0.0002, 0.004, 0.01, 0.03}) {
        CAPTURE(w);
        CAPTURE(noise);
        const DepthImage depth = scene(w, noise, 5);
        const PlanarImage image(depth, camera, 1);
        const simd::NormalRule rule = normal_rule(image, camera, noise);
        std::vector<float> first;
        for (const Kernels& kernels : all_kernels()) {
          CAPTURE(kernels.name);
          std::vector<float> normals(static_cast<std::size_t>(3 * rows * w + 3), 7.0F);
          std::vector<std::int32_t> valid(static_cast<std::size_t>(w));
          for (int v = 0; v < rows; ++v) {
            const int count = kernels.fit_normals(image.planar_row(v), rule, camera.ray_table().row(v),
                                                  normals.data() + 3 * v * w, 100, valid.data());
            int next = 0;
            for (int u = 0; u < w; ++u) {
              const Eigen::Vector3f found(normals.data() + 3 * (v * w + u));
              if (found.x() == found.x()) {
                REQUIRE(next < count);
                REQUIRE(valid[static_cast<std::size_t>(next++)] == 100 + u);
              }
              if (!first.empty()) continue;
              CAPTURE(u);
              CAPTURE(v);
              bool is_expected = false;
              for (const Eigen::Vector3d& expected : normals_of(image, camera, rule, u, v)) {
                is_expected |=
                    expected.allFinite() ? (found.cast<double>() - expected).norm() < 2e-4 : !found.allFinite();
              }
              REQUIRE(is_expected);
            }
            REQUIRE(next == count);
          }
          REQUIRE(normals.back() == 7.0F);
          if (first.empty()) first = normals;
          REQUIRE(std::memcmp(first.data(), normals.data(), first.size() * sizeof(float)) == 0);
        }
      }
    }
  }
}
