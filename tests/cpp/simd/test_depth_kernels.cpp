// The kernels of the depth images: every instruction set of this processor against plain loops.
#include <algorithm>
#include <array>
#include <cstring>
#include <vector>

#include "camera/ray_table.hpp"
#include "depth/byte_image.hpp"
#include "depth/inverse_depth_image.hpp"
#include "depth_kernels.hpp"
#include "doctest/doctest.h"

using namespace nacre_test;
using nacre::ByteImage;
using nacre::evaluate;
using nacre::is_measurement;
using nacre::PlanarImage;

TEST_CASE("edges are those of a plain test") {
  for (const int w : widths) {
    const Camera camera = cameras(w).front();
    const PlanarImage image(scene(w, 0.002, 6), camera, 1);
    const simd::Quadratic sigma = image.sigma({0.002, 0.0, 0.0}), unit_slope = image.unit_slope();
    const simd::EdgeLimits limits = {sigma * 9.8F, unit_slope * 3.0F, sigma * 4.2F, unit_slope * 5.67F, 4.9F, 2.1F};
    std::vector<float> slope(static_cast<std::size_t>(w + PlanarImage::kOverhang));
    std::vector<float> at_rim(slope.size(), 0.0F);
    for (std::size_t u = 0; u < slope.size(); ++u) {
      slope[u] = u % 3 == 0 ? 1e-3F : 1e-4F;
      if (u % 2 == 0) at_rim[u] = slope[u];
    }
    std::vector<std::uint8_t> marks(static_cast<std::size_t>(w + 1), 9);
    for (int v = 0; v < rows; ++v) {
      for (const Kernels& kernels : all_kernels()) {
        kernels.mark_edges(image.planar_row(v), limits, {slope.data(), at_rim.data()}, marks.data());
        for (int u = 0; u < w; ++u) {
          const auto at = [&](int du, int dv) { return image.row(v + dv)[u + du]; };
          const float own = at(0, 0), lateral = slope[static_cast<std::size_t>(u)];
          bool edge = false, slanted = lateral > evaluate(limits.step_slant, own);
          for (const auto& [du, dv] : {std::pair{1, 0}, {0, 1}, {1, 1}, {-1, 1}}) {
            const float length = du != 0 && dv != 0 ? std::sqrt(2.0F) : 1.0F;
            const float straight =
                std::max(evaluate(limits.bend_noise, own), evaluate(limits.bend_crease, own) * length);
            const float bend = std::hypot(straight, limits.bend_lateral * lateral);
            const float rim_bend = std::hypot(straight, limits.bend_lateral * at_rim[static_cast<std::size_t>(u)]);
            const float step = std::hypot(evaluate(limits.step_noise, own), limits.step_lateral * lateral) +
                               evaluate(limits.step_slant, own) * length;
            const float a = at(-du, -dv), b = at(du, dv);
            const bool has_a = a == a, has_b = b == b;
            edge |= std::abs((own - a) + (own - b)) > bend;
            const auto bent = [&](float away) { return away > rim_bend || -away > bend; };
            const float sign = image.planar_row(v).is_inverse ? -1.0F : 1.0F;
            edge |= !has_a && bent(sign * ((own - b) + (at(2 * du, 2 * dv) - b)));
            edge |= !has_b && bent(sign * ((own - a) + (at(-2 * du, -2 * dv) - a)));
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
        kernels.remove_isolated(keep.row(v), keep.stride(), least.data(), w, still_kept.row(v));
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

TEST_CASE("marks grow to the four neighbours, and not beyond the image") {
  for (const int w : widths) {
    ByteImage marks(w, rows);
    for (int v = 0; v < rows; ++v) {
      for (int u = 0; u < w; ++u) {
        const double chance = random_uniform(5, static_cast<std::uint64_t>(v * w + u));
        marks.row(v)[u] = static_cast<std::uint8_t>(chance < 0.1 ? 1 + 20.0 * chance : 0);
      }
    }
    const auto at = [&](int u, int v) { return u >= 0 && u < w && v >= 0 && v < rows ? int{marks.row(v)[u]} : 0; };
    for (const Kernels& kernels : all_kernels()) {
      CAPTURE(kernels.name);
      ByteImage grown(w, rows);
      for (int v = 0; v < rows; ++v) kernels.dilate_marks(marks.row(v), marks.stride(), w, grown.row(v));
      for (int v = 0; v < rows; ++v) {
        for (int u = -1; u <= w; ++u) {
          const int expected = at(u, v) | at(u - 1, v) | at(u + 1, v) | at(u, v - 1) | at(u, v + 1);
          REQUIRE(int{grown.row(v)[u]} == (u >= 0 && u < w ? expected : 0));
        }
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

TEST_CASE("as many points are written as were counted, whatever has become of the image") {
  for (const int w : widths) {
    const Camera camera = cameras(w).front();
    const simd::RayRow rays = camera.ray_table().row(0);
    const std::vector<float> full(static_cast<std::size_t>(w), 1.0F), empty(full.size(), NAN);
    for (const Kernels& kernels : all_kernels()) {
      CAPTURE(kernels.name);
      for (const int count : {0, 1, w / 2, w - 1}) {
        std::vector<float> points(static_cast<std::size_t>(3 * w + 3), 7.0F);
        kernels.gather_points(full.data(), rays, w, points.data(), count);
        for (int u = 0; u < count; ++u) REQUIRE(points[static_cast<std::size_t>(3 * u + 2)] == rays.z[u]);
        for (std::size_t i = 3 * static_cast<std::size_t>(count); i < points.size(); ++i) REQUIRE(points[i] == 7.0F);
        kernels.gather_points(empty.data(), rays, w, points.data(), count);
        for (std::size_t i = 0; i < 3 * static_cast<std::size_t>(count); ++i) REQUIRE(std::isnan(points[i]));
      }
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
          kernels.gather_points(&depth(v, 0), rays, w, gathered.data(), count);
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
