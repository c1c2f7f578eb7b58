// The kernels of the depth images: every instruction set of this processor against plain loops.
#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "byte_image.hpp"
#include "depth_images.hpp"
#include "doctest/doctest.h"
#include "planar_image.hpp"
#include "ray_table.hpp"
#include "simd/edge_row.hpp"
#include "simd/keep_row.hpp"
#include "simd/normal_row.hpp"
#include "simd/point_row.hpp"
#include "simd/window_row.hpp"

namespace {

using namespace nacre_test;
namespace simd = nacre::simd;
using nacre::ByteImage;
using nacre::evaluate;
using nacre::is_measurement;
using nacre::PlanarImage;

struct Kernels {
  const char* name;
  simd::FitNormals* fit_normals;
  simd::MarkEdges* mark_edges;
  simd::MarkGradients* mark_gradients;
  simd::FitWindows* fit_windows;
  simd::KeepPixels* keep_pixels;
  simd::DropLonely* drop_lonely;
  simd::SelectKept* select_kept;
  simd::LinkPixels* link_pixels;
  simd::FillDepthRow* fill_depth_row;
  simd::FillPlanarRow* fill_planar_row;
  simd::FillPointRow* fill_point_row;
  simd::CountPoints* count_points;
  simd::GatherPoints* gather_points;
};

#define KERNELS_OF(isa)                                                                                            \
  Kernels {                                                                                                        \
    #isa, simd::isa::fit_normals, simd::isa::mark_edges, simd::isa::mark_gradients, simd::isa::fit_windows,        \
        simd::isa::keep_pixels, simd::isa::drop_lonely, simd::isa::select_kept, simd::isa::link_pixels,            \
        simd::isa::fill_depth_row, simd::isa::fill_planar_row, simd::isa::fill_point_row, simd::isa::count_points, \
        simd::isa::gather_points                                                                                   \
  }

std::vector<Kernels> all_kernels() {
  std::vector<Kernels> kernels = {KERNELS_OF(baseline)};
#ifdef NACRE_SIMD_X86
  if (simd::active_isa() != simd::Isa::baseline) kernels.push_back(KERNELS_OF(avx2));
  if (simd::active_isa() == simd::Isa::avx512) kernels.push_back(KERNELS_OF(avx512));
#endif
  return kernels;
}

constexpr std::array<int, 8> widths = {1, 7, 15, 16, 17, 64, 70, 133};
constexpr int rows = 40;

std::vector<Camera> cameras(int w) {
  return {Camera::pinhole(w, rows, 90.0, 94.0, w / 2.0, 18.0),
          Camera::pinhole(w, rows, 90.0, 94.0, w / 2.0, 18.0, {}, DepthKind::radial),
          Camera::pinhole(w, rows, 90.0, 94.0, w / 2.0, 18.0, lens), Camera::orthographic(w, rows, 0.01)};
}

// A waved surface before another, with noise, outliers, holes and codes for "no measurement".
DepthImage scene(int w, double noise, std::uint64_t seed) {
  DepthImage depth(rows, w);
  for (int v = 0; v < rows; ++v) {
    for (int u = 0; u < w; ++u) {
      const auto pixel = static_cast<std::uint64_t>(v * w + u);
      const double near = u > w / 2 && v > 10 ? 0.3 : 0.0;
      double z = 1.4 + 0.1 * std::sin(0.13 * u) * std::cos(0.11 * v) - near + noise * random_normal(seed, pixel);
      const double chance = random_uniform(seed + 1, pixel);
      if (chance < 0.02 || (u > 20 && u < 24 && v > 5 && v < 30)) z = missing;
      if (chance > 0.02 && chance < 0.026) z += chance < 0.023 ? 0.7 : -0.5;
      if (chance > 0.995) z = chance > 0.9975 ? -1.0 : std::numeric_limits<double>::infinity();
      depth(v, u) = static_cast<float>(z);
    }
  }
  return depth;
}

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

TEST_CASE("edges are those of a plain test") {
  for (const int w : widths) {
    const Camera camera = cameras(w).front();
    const PlanarImage image(scene(w, 0.002, 6), camera, 1);
    const simd::Quadratic sigma = image.sigma({0.002, 0.0, 0.0}), unit_slope = image.unit_slope();
    const simd::EdgeLimits limits = {sigma * 9.8F, unit_slope * 3.0F, sigma * 4.2F, unit_slope * 5.67F, 4.9F, 2.1F};
    std::vector<float> slope(static_cast<std::size_t>(w + PlanarImage::kOverhang));
    for (std::size_t u = 0; u < slope.size(); ++u) slope[u] = u % 3 == 0 ? 1e-3F : 1e-4F;
    std::vector<std::uint8_t> marks(static_cast<std::size_t>(w + 1), 9);
    for (int v = 0; v < rows; ++v) {
      for (const Kernels& kernels : all_kernels()) {
        kernels.mark_edges(image.planar_row(v), limits, slope.data(), marks.data());
        for (int u = 0; u < w; ++u) {
          const auto at = [&](int du, int dv) { return image.row(v + dv)[u + du]; };
          const float own = at(0, 0), lateral = slope[static_cast<std::size_t>(u)];
          bool edge = false, slanted = lateral > evaluate(limits.step_slant, own);
          for (const auto& [du, dv] : {std::pair{1, 0}, {0, 1}, {1, 1}, {-1, 1}}) {
            const float length = du != 0 && dv != 0 ? std::sqrt(2.0F) : 1.0F;
            const float bend = std::max(evaluate(limits.bend_noise, own), evaluate(limits.bend_crease, own) * length) +
                               limits.bend_lateral * lateral;
            const float step = evaluate(limits.step_noise, own) + evaluate(limits.step_slant, own) * length +
                               limits.step_lateral * lateral;
            const float a = at(-du, -dv), b = at(du, dv);
            const bool has_a = a == a, has_b = b == b;
            edge |= std::abs((own - a) + (own - b)) > bend;
            edge |= !has_a && std::abs((own - b) + (at(2 * du, 2 * dv) - b)) > bend;
            edge |= !has_b && std::abs((own - a) + (at(-2 * du, -2 * dv) - a)) > bend;
            const bool steep_a = std::abs(own - a) > step, steep_b = std::abs(own - b) > step;
            slanted |= (steep_a || !has_a) && (steep_b || !has_b) && (steep_a || steep_b);
          }
          CAPTURE(kernels.name);
          REQUIRE(marks[static_cast<std::size_t>(u)] ==
                  (edge ? simd::edge_mark : 0) + (slanted ? simd::slanted_mark : 0));
        }
        REQUIRE(marks.back() == 9);
      }
    }
  }
}

TEST_CASE("gradients are Sobel's") {
  const int w = 37;
  std::vector<float> values(3 * (w + 18));
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = static_cast<float>(random_uniform(3, i));
    if (random_uniform(4, i) < 0.03) values[i] = missing;
  }
  const float *above = values.data() + 1, *here = above + w + 18, *below = here + w + 18;
  for (const Kernels& kernels : all_kernels()) {
    std::vector<std::uint8_t> marks(w + 1, 9);
    kernels.mark_gradients({above, here, below, w}, 4.0F, marks.data());
    for (int u = 0; u < w; ++u) {
      const float du = above[u + 1] + 2 * here[u + 1] + below[u + 1] - above[u - 1] - 2 * here[u - 1] - below[u - 1];
      const float dv = below[u - 1] + 2 * below[u] + below[u + 1] - above[u - 1] - 2 * above[u] - above[u + 1];
      const float gradient = du * du + dv * dv;
      if (std::abs(gradient - 4.0F) < 1e-4F) continue;
      REQUIRE(marks[static_cast<std::size_t>(u)] == (gradient <= 4.0F ? 0 : simd::edge_mark));
    }
    REQUIRE(marks.back() == 9);
  }
}

TEST_CASE("windows are those of a least squares fit") {
  for (const int w : {7, 12, 80, 86, 87, 92, 133, 200}) {
    const Camera camera = Camera::pinhole(w, rows, 90.0, 94.0, w / 2.0, 18.0);
    DepthImage depth = scene(w, 0.002, 7);
    for (int v = 0; v < rows / 2; ++v) depth.row(v) = (depth.row(v) * 100.0F).round() / 100.0F;  // plateaus
    const PlanarImage image(depth, camera, 1);
    const simd::WindowRule rule = {image.sigma({0.001, 0.0, 0.0}), image.unit_slope(), 30.0F, 3.0F};
    const int count = (w - 2 * simd::fit_radius - 1) / simd::fit_step + 1;
    std::array<std::vector<float>, 5> first;
    for (int v = simd::fit_radius; v + simd::fit_radius < rows; v += 2) {
      for (const Kernels& kernels : all_kernels()) {
        CAPTURE(kernels.name);
        std::array<std::vector<float>, 5> out;
        for (auto& values : out) values.assign(static_cast<std::size_t>(count + 1), 7.0F);
        kernels.fit_windows(image.row(v) + simd::fit_radius, image.stride(), count, rule,
                            {out[0].data(), out[1].data(), out[2].data(), out[3].data(), out[4].data()});
        for (auto& values : out) REQUIRE(values.back() == 7.0F);
        if (kernels.fit_windows != all_kernels().front().fit_windows) {
          for (std::size_t k = 0; k < 5; ++k) {
            REQUIRE(std::memcmp(first[k].data(), out[k].data(), first[k].size() * sizeof(float)) == 0);
          }
          continue;
        }
        first = out;
        for (int j = 0; j < count; ++j) {
          const int u = simd::fit_radius + j * simd::fit_step;
          Eigen::Matrix<double, 49, 6> design;
          Eigen::Matrix<double, 49, 1> values;
          float smallest = std::numeric_limits<float>::infinity();
          int num_flat = 0;
          for (int i = 0; i < 49; ++i) {
            const double du = i % 7 - 3, dv = i / 7 - 3;
            design.row(i) << 1, du, dv, du * dv, du * du - 4, dv * dv - 4;
            values[i] = static_cast<double>(image.row(v + i / 7 - 3)[u + i % 7 - 3]);
          }
          for (int d = -3; d < 3; ++d) {
            for (const float step : {std::abs(image.row(v)[u + d + 1] - image.row(v)[u + d]),
                                     std::abs(image.row(v + d + 1)[u] - image.row(v + d)[u])}) {
              num_flat += step == 0.0F;
              if (step > 0.0F) smallest = std::min(smallest, step);
            }
          }
          double bends = 0.0;
          for (int d = -2; d <= 2; ++d) {
            const auto at = [&](int du, int dv) { return static_cast<double>(image.row(v + dv)[u + du]); };
            bends += std::pow(at(d - 1, 0) - 2.0 * at(d, 0) + at(d + 1, 0), 2);
            bends += std::pow(at(0, d - 1) - 2.0 * at(0, d) + at(0, d + 1), 2);
          }
          const auto k = static_cast<std::size_t>(j);
          const double unit = static_cast<double>(evaluate(rule.unit, image.row(v)[u]));
          const Eigen::Matrix<double, 6, 1> fit = (design.transpose() * design).inverse() * design.transpose() * values;
          const double residual = (values - design * fit).norm() / std::sqrt(43.0);
          REQUIRE((out[0][k] == out[0][k]) == values.allFinite());
          REQUIRE((out[1][k] == out[1][k]) == values.allFinite());
          REQUIRE((out[2][k] == out[2][k]) == values.allFinite());
          REQUIRE((out[4][k] == out[4][k]) == values.allFinite());
          if (!values.allFinite()) {
            REQUIRE(out[3][k] != out[3][k]);
            continue;
          }
          REQUIRE(static_cast<double>(out[0][k]) == doctest::Approx(residual / unit).epsilon(1e-5));
          REQUIRE(static_cast<double>(out[1][k]) == doctest::Approx(std::sqrt(bends / 60.0) / unit).epsilon(1e-5));
          REQUIRE(static_cast<double>(out[4][k]) == doctest::Approx(fit.segment<2>(1).norm()).epsilon(1e-5));
          const float step = smallest / static_cast<float>(unit);
          const bool has_step = num_flat >= 6 && step <= rule.max_step && step <= rule.max_step_pixels * out[2][k];
          REQUIRE((out[3][k] == out[3][k]) == has_step);
          if (has_step) REQUIRE(out[3][k] == doctest::Approx(step));
        }
      }
    }
  }
}

TEST_CASE("pixels are kept and dropped as plain loops say") {
  for (const int w : widths) {
    const Camera camera = cameras(w)[2];
    const DepthImage depth = scene(w, 0.01, 8);
    const PlanarImage image(depth, camera, 1);
    std::vector<std::uint8_t> marks(static_cast<std::size_t>(w)), mask(marks), least(marks);
    for (std::size_t u = 0; u < marks.size(); ++u) {
      marks[u] = static_cast<std::uint8_t>(4 * random_uniform(9, u));
      mask[u] = u % 5 != 0 ? 255 : 0;
      least[u] = static_cast<std::uint8_t>(5 + u % 7);
    }
    const simd::LinkRule rule = {image.sigma({0.005, 0.0, 0.0}), image.unit_slope()};
    for (const Kernels& kernels : all_kernels()) {
      CAPTURE(kernels.name);
      ByteImage keep(w, rows), still_kept(w, rows);
      for (int v = 0; v < rows; ++v) {
        const float* const direction = camera.ray_table().row(v).x;
        const bool masked = v % 2 == 0;
        const simd::KeepCounts counts = kernels.keep_pixels(
            {&depth(v, 0), direction, masked ? mask.data() : nullptr, marks.data(), 1.1F, 1.45F, w}, keep.row(v));
        std::array<int, 6> expected{};
        for (int u = 0; u < w; ++u) {
          const float z = depth(v, u);
          const std::uint8_t mark = marks[static_cast<std::size_t>(u)];
          const std::size_t reason = !is_measurement(z)                                 ? 0
                                     : z < 1.1F || z > 1.45F                            ? 1
                                     : masked && mask[static_cast<std::size_t>(u)] == 0 ? 2
                                     : (mark & simd::edge_mark) != 0                    ? 3
                                     : (mark & simd::slanted_mark) != 0                 ? 4
                                                                                        : 5;
          ++expected[reason];
          REQUIRE(keep.row(v)[u] == (reason == 5));
        }
        REQUIRE(counts.num_invalid == expected[0]);
        REQUIRE(counts.num_out_of_range == expected[1]);
        REQUIRE(counts.num_masked == expected[2]);
        REQUIRE(counts.num_edge == expected[3]);
        REQUIRE(counts.num_slanted == expected[4]);
      }
      const std::size_t words = static_cast<std::size_t>(w + 63) / 64;
      std::vector<std::uint64_t> kept(words), left(words), above(words);
      std::vector<float> selected(static_cast<std::size_t>(w + 1), 7.0F);
      for (int v = 0; v < rows; ++v) {
        kernels.drop_lonely(keep.row(v), keep.stride(), least.data(), w, still_kept.row(v));
        kernels.link_pixels(image.planar_row(v), rule, keep.row(v), keep.stride(),
                            {kept.data(), left.data(), above.data()});
        const int count = kernels.select_kept(&depth(v, 0), keep.row(v), w, selected.data());
        REQUIRE(count == std::count(keep.row(v), keep.row(v) + w, 1));
        REQUIRE(selected.back() == 7.0F);
        for (int u = 0; u < w; ++u) {
          const auto i = static_cast<std::size_t>(u);
          int window = 0;
          for (int k = 0; k < 25; ++k) {
            const int x = u + k % 5 - 2, y = v + k / 5 - 2;
            window += x >= 0 && x < w && y >= 0 && y < rows && keep.row(y)[x];
          }
          REQUIRE(still_kept.row(v)[u] == (keep.row(v)[u] && window >= least[i]));
          const float own = image.row(v)[u], limit = evaluate(rule.noise, own) + evaluate(rule.slant, own);
          const auto bit = [&](const std::vector<std::uint64_t>& bits) { return (bits[i / 64] >> (i % 64) & 1) != 0; };
          const bool has = keep.row(v)[u] != 0;
          REQUIRE(bit(kept) == has);
          REQUIRE(bit(left) == (has && keep.row(v)[u - 1] && std::abs(own - image.row(v)[u - 1]) <= limit));
          REQUIRE(bit(above) == (has && keep.row(v - 1)[u] && std::abs(own - image.row(v - 1)[u]) <= limit));
          REQUIRE((selected[i] == selected[i]) == has);
          if (has) REQUIRE(selected[i] == depth(v, u));
        }
        const int spare = static_cast<int>(64 * words) - w;
        if (spare > 0) REQUIRE((kept.back() >> (64 - spare)) == 0);
      }
    }
  }
}

TEST_CASE("raw values become metres") {
  std::vector<std::uint16_t> raw = {0, 1, 1000, 65534, 65535};
  for (int i = 0; i < 70; ++i) raw.push_back(static_cast<std::uint16_t>(937 * i));
  for (const Kernels& kernels : all_kernels()) {
    std::vector<float> depth(raw.size());
    kernels.fill_depth_row(raw.data(), 5000.0F, static_cast<int>(raw.size()), depth.data());
    for (std::size_t i = 0; i < raw.size(); ++i) {
      const bool is_there = raw[i] != 0 && raw[i] != 65535;
      REQUIRE((depth[i] == depth[i]) == is_there);
      if (is_there) REQUIRE(depth[i] == static_cast<float>(raw[i]) / 5000.0F);
    }
  }
}

TEST_CASE("rows become points") {
  for (const int w : widths) {
    for (const Camera& camera : cameras(w)) {
      const DepthImage depth = scene(w, 0.01, 9);
      const bool is_inverse = camera.model() == Camera::Model::pinhole;
      for (const Kernels& kernels : all_kernels()) {
        CAPTURE(kernels.name);
        std::vector<float> values(static_cast<std::size_t>(w + 1), 7.0F), sigma(values);
        std::vector<float> points(static_cast<std::size_t>(3 * w + 3), 7.0F), gathered(points);
        for (int v = 0; v < rows; ++v) {
          const simd::RayRow rays = camera.ray_table().row(v);
          const float* const z_of = camera.depth_kind() == DepthKind::radial ? rays.z : nullptr;
          kernels.fill_planar_row(&depth(v, 0), z_of, is_inverse, w, values.data());
          kernels.fill_point_row(&depth(v, 0), rays, {0.001F, 0.002F, 0.4F}, w, points.data(), sigma.data());
          const int count = kernels.count_points(&depth(v, 0), rays, w);
          kernels.gather_points(&depth(v, 0), rays, w, gathered.data());
          int next = 0;
          for (int u = 0; u < w; ++u) {
            const auto i = static_cast<std::size_t>(u);
            const Ray ray = camera.ray(u, v);
            const float z = depth(v, u);
            const Eigen::Vector3f point(points.data() + 3 * u);
            REQUIRE(point.allFinite() == is_measurement(z));
            REQUIRE((values[i] == values[i]) == is_measurement(z));
            REQUIRE((sigma[i] == sigma[i]) == is_measurement(z));
            if (!is_measurement(z)) continue;
            const Eigen::Vector3f expected(ray.origin_x + z * ray.direction_x, ray.origin_y + z * ray.direction_y,
                                           z * ray.direction_z);
            REQUIRE(point == expected);
            REQUIRE(Eigen::Vector3f(gathered.data() + 3 * next++) == expected);
            REQUIRE(values[i] == (is_inverse ? 1.0F / (z * ray.direction_z) : z));
            REQUIRE(sigma[i] == doctest::Approx(0.001 + 0.002 * (z - 0.4) * (z - 0.4)).epsilon(1e-6));
          }
          REQUIRE(next == count);
          REQUIRE(values.back() == 7.0F);
          REQUIRE(sigma.back() == 7.0F);
          for (std::size_t i = points.size() - 3; i < points.size(); ++i) {
            REQUIRE(points[i] == 7.0F);
            REQUIRE(gathered[i] == 7.0F);
          }
        }
      }
    }
  }
}
