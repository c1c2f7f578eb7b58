// Marked pixels that lie on a surface beside them: every instruction set of this processor against plain least squares.
#include <Eigen/Dense>
#include <array>
#include <limits>
#include <optional>
#include <vector>

#include "depth/byte_image.hpp"
#include "depth/inverse_depth_image.hpp"
#include "depth_images.hpp"
#include "doctest/doctest.h"
#include "simd/depth_edges.hpp"
#include "simd/depth_planar_edges.hpp"

namespace {

using namespace nacre_test;
namespace simd = nacre::simd;
using nacre::ByteImage;
using nacre::evaluate;
using nacre::PlanarImage;

std::vector<simd::KeepPlanarPixels*> all_kernels() {
  std::vector<simd::KeepPlanarPixels*> kernels = {simd::baseline::keep_planar_pixels};
#ifdef NACRE_SIMD_X86
  if (simd::active_isa() != simd::Isa::baseline) kernels.push_back(simd::avx2::keep_planar_pixels);
  if (simd::active_isa() == simd::Isa::avx512) kernels.push_back(simd::avx512::keep_planar_pixels);
#endif
  return kernels;
}

struct Side {
  double error, leverage;
};

// The plane through the unmarked pixels on one side: its error at the pixel, in its standard deviations; nothing where
// they are too few, too rough or too steep.
std::optional<Side> fit(const PlanarImage& image, const ByteImage& marks, const simd::PlanarRule& rule, int u, int v,
                        std::array<int, 2> ahead) {
  const double own = image.row(v)[u],
               variance = std::pow(static_cast<double>(evaluate(rule.sigma, image.row(v)[u])), 2);
  const auto is_unmarked = [&](int x, int y) { return marks.row(y)[x] == 0 && image.row(y)[x] == image.row(y)[x]; };
  if (!is_unmarked(u + ahead[0], v + ahead[1])) return std::nullopt;
  std::vector<Eigen::Vector3d> places;
  std::vector<double> values;
  for (int along = 1; along <= simd::side_depth; ++along) {
    for (int across = -simd::side_reach; across <= simd::side_reach; ++across) {
      const int du = along * ahead[0] + across * ahead[1], dv = along * ahead[1] + across * ahead[0];
      if (v + dv < 0 || v + dv >= image.height() || u + du < 0 || u + du >= image.width()) continue;
      if (!is_unmarked(u + du, v + dv)) continue;
      places.emplace_back(1.0, du, dv);
      values.push_back(static_cast<double>(image.row(v + dv)[u + du]) - own);
    }
  }
  if (values.size() < 8) return std::nullopt;
  Eigen::MatrixX3d design(values.size(), 3);
  for (std::size_t i = 0; i < values.size(); ++i) design.row(static_cast<Eigen::Index>(i)) = places[i];
  const Eigen::Map<const Eigen::VectorXd> w(values.data(), static_cast<Eigen::Index>(values.size()));
  const Eigen::Matrix3d inverse = (design.transpose() * design).inverse();
  const Eigen::Vector3d plane = inverse * design.transpose() * w;
  if ((w - design * plane).squaredNorm() > 1.5 * variance * static_cast<double>(values.size() - 3)) return std::nullopt;
  if (plane.tail<2>().norm() > static_cast<double>(evaluate(rule.steepest, image.row(v)[u]))) return std::nullopt;
  return Side{std::abs(plane[0]) / std::sqrt(variance * (1.0 + inverse(0, 0))), inverse(0, 0)};
}

// What the plane with the least leverage says [sigmas]; infinite where no side has one.
double error_of(const PlanarImage& image, const ByteImage& marks, const simd::PlanarRule& rule, int u, int v) {
  std::optional<Side> best;
  for (const std::array<int, 2> ahead : {std::array{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
    const std::optional<Side> side = fit(image, marks, rule, u, v, ahead);
    if (side && (!best || side->leverage < best->leverage - 1e-6)) best = side;
  }
  return best ? best->error : std::numeric_limits<double>::infinity();
}

TEST_CASE("pixels are kept as least squares say") {
  constexpr int rows = 40;
  constexpr double sigmas = 3.0;
  int num_kept = 0, num_left = 0, num_close = 0;
  for (const int w : {1, 7, 17, 64, 70, 133}) {
    const Camera camera = Camera::pinhole(w, rows, 90.0, 94.0, w / 2.0, 18.0);
    DepthImage depth(rows, w);
    ByteImage marks(w, rows), first(w, rows);
    for (int v = 0; v < rows; ++v) {
      for (int u = 0; u < w; ++u) {
        const auto pixel = static_cast<std::uint64_t>(v * w + u);
        const double z = (3 * u + v > 80 ? 1.2 : 1.5) + 0.004 * u + 0.003 * random_normal(1, pixel);
        depth(v, u) = random_uniform(2, pixel) < 0.02 ? missing : static_cast<float>(z);
        const bool is_near_edge = std::abs(3 * u + v - 80) < 6 || random_uniform(3, pixel) < 0.1;
        first.row(v)[u] = random_uniform(4, pixel) < 0.05 ? simd::slanted_mark : 0;
        marks.row(v)[u] = is_near_edge ? simd::edge_mark : first.row(v)[u];
      }
    }
    const PlanarImage image(depth, camera, 1);
    const simd::PlanarRule rule = {image.sigma({0.003, 0.0, 0.0}), image.unit_slope() * 5.67F,
                                   static_cast<float>(sigmas * sigmas)};
    ByteImage expected(w, rows);
    for (simd::KeepPlanarPixels* const keep_planar_pixels : all_kernels()) {
      ByteImage left_marked(w, rows);
      for (int v = 0; v < rows; ++v) {
        keep_planar_pixels(image.planar_row(v), rule, {marks.row(v), first.row(v), marks.stride()}, left_marked.row(v));
        for (int u = 0; u < w; ++u) {
          CAPTURE(u);
          CAPTURE(v);
          const bool may_be =
              marks.row(v)[u] != 0 && (first.row(v)[u] & simd::slanted_mark) == 0 && image.row(v)[u] == image.row(v)[u];
          const double error = may_be ? error_of(image, marks, rule, u, v) : std::numeric_limits<double>::infinity();
          if (keep_planar_pixels == simd::baseline::keep_planar_pixels) {
            expected.row(v)[u] = left_marked.row(v)[u];
            if (std::abs(error - sigmas) < 0.02) {
              ++num_close;
              continue;
            }
            const bool is_planar = error < sigmas;
            REQUIRE(left_marked.row(v)[u] == (is_planar ? 0 : marks.row(v)[u]));
            if (marks.row(v)[u] != 0) ++(is_planar ? num_kept : num_left);
          }
          REQUIRE(left_marked.row(v)[u] == expected.row(v)[u]);  // the same on every instruction set
        }
      }
    }
  }
  CHECK(num_kept > 300);
  CHECK(num_left > 300);
  CHECK(num_close < 20);
}

// A wall before nothing, its outline mixed with a background, in a band of a pixel.
struct Wall {
  DepthImage depth = DepthImage::Constant(height, width, missing);
  explicit Wall(double slant) {
    const DepthImage plane = render(orthographic, slanted_plane(1.0, slant, 0.0));
    depth.block(20, 30, 50, 60) = plane.block(20, 30, 50, 60);
    add_noise(depth, NoiseModel{0.0005, 0.0, 0.0}, 7);
    for (int v = 20; v < 70; ++v) {
      for (const int u : {30, 89}) depth(v, u) += 0.03F + 0.001F * static_cast<float>(v);
    }
  }
};

TEST_CASE("true pixels beside mixed ones stay, mixed ones go, at any slant") {
  for (const double slant : {0.0, 0.5, 1.0, 1.2}) {
    CAPTURE(slant);
    const Wall wall(slant);
    DepthOptions options;
    const DepthImage clean = preprocess_depth(wall.depth, orthographic, options);
    CHECK(num_valid(clean.block(20, 31, 50, 58)) > 0.97 * 50 * 58);
    CHECK(num_valid(clean.col(30)) + num_valid(clean.col(89)) == 0);
    options.planar_keep_sigmas = 0.0;
    CHECK(num_valid(preprocess_depth(wall.depth, orthographic, options).block(20, 31, 50, 58)) < 0.94 * 50 * 58);
  }
}

TEST_CASE("a step of a few sigma is not bridged by a plane through both sides") {
  // Half way between two walls 12 sigma apart: a plane through both explains the pixel, one side's alone does not.
  DepthImage depth = DepthImage::Constant(height, width, 1.0F);
  depth.rightCols(60).setConstant(1.06F);
  add_noise(depth, NoiseModel{0.005, 0.0, 0.0}, 3);
  depth.col(60).setConstant(1.03F);
  DepthOptions options;
  options.noise = NoiseModel{0.005, 0.0, 0.0};
  options.max_missing = 1.0;
  const PlanarImage image(depth, orthographic, 1);
  ByteImage marks(width, height), first(width, height), left_marked(width, height);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) marks.row(v)[u] = first.row(v)[u] = u == 60;
  }
  const simd::PlanarRule rule = {image.sigma(*options.noise), image.unit_slope() * 5.67F, 9.0F};
  int num_kept = 0;
  for (int v = 0; v < height; ++v) {
    simd::keep_planar_pixels()(image.planar_row(v), rule, {marks.row(v), first.row(v), marks.stride()},
                               left_marked.row(v));
    num_kept += left_marked.row(v)[60] == 0;
  }
  CHECK(num_kept <= height / 10);
}

}  // namespace
