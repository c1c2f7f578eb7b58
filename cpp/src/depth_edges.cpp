// Which pixels at the edges of a depth image are noise.
#include <algorithm>
#include <cmath>

#include "depth_cleaning.hpp"
#include "parallel.hpp"

namespace nacre {
namespace {

constexpr std::int64_t kRowBlock = 16;

// A crease between two surfaces is an edge of the second difference as well. Up to a bend of this slope it is kept.
constexpr float kCreaseSlope = 3.0F;

// Allowance of the steepness test for noise, on top of the slant itself.
constexpr float kStepSigmas = 3.0F;

// A pixel looks this far to the side (standard deviation, in pixels), which on a slanted surface is noise of depth:
// Nguyen et al. 2012 measure 0.8 and more at grazing angles for whole edges.
constexpr float kLateralSigma = 0.5F;

struct PlanarLimits {
  Quadratic bend_noise, bend_crease, step_noise, step_slant;
  float bend_lateral, step_lateral;
};

// One of the four directions through each pixel of a row: neighbours at -offset and +offset, `length` pixels away.
void mark_direction(const float* centre, const float* slope, std::ptrdiff_t offset, float length, int width,
                    const PlanarLimits& limits, std::uint8_t* edge, std::uint8_t* slanted) {
  const float* const a = centre - offset;
  const float* const b = centre + offset;
  const float* const beyond_a = a - offset;
  const float* const beyond_b = b + offset;
  for (int u = 0; u < width; ++u) {
    const float c = centre[u];
    const float bend = std::max(limits.bend_noise(c), limits.bend_crease(c) * length) + limits.bend_lateral * slope[u];
    const float step = limits.step_noise(c) + limits.step_slant(c) * length + limits.step_lateral * slope[u];
    const float step_a = std::abs(c - a[u]), step_b = std::abs(c - b[u]);
    // Zero on every plane; comparisons with a missing neighbour (NaN) are false.
    const int bent = std::abs((a[u] - c) + (b[u] - c)) > bend;
    // At a rim the pixel is held against the plane through its two inner neighbours.
    const int no_a = a[u] != a[u], no_b = b[u] != b[u];
    const int bent_a = std::abs((c - a[u]) + (beyond_a[u] - a[u])) > bend;
    const int bent_b = std::abs((c - b[u]) + (beyond_b[u] - b[u])) > bend;
    const int steep_a = step_a > step, steep_b = step_b > step;
    edge[u] = static_cast<std::uint8_t>(edge[u] | bent | (no_a & bent_b) | (no_b & bent_a));
    slanted[u] = static_cast<std::uint8_t>(slanted[u] | ((steep_a | no_a) & (steep_b | no_b) & (steep_a | steep_b)));
  }
}

}  // namespace

EdgeMarks mark_planar_edges(const PlanarImage& image, const WindowFits& fits, const NoiseModel& noise,
                            const DepthOptions& options, int num_threads) {
  const Quadratic sigma = image.sigma(noise), unit_slope = image.unit_slope();
  const auto bend_sigmas = static_cast<float>(options.edge_sigmas * std::sqrt(6.0));
  const float step_sigmas = kStepSigmas * std::sqrt(2.0F);
  const PlanarLimits limits{sigma * bend_sigmas,         unit_slope * kCreaseSlope,
                            sigma * step_sigmas,         unit_slope * static_cast<float>(std::tan(options.max_slant)),
                            bend_sigmas * kLateralSigma, step_sigmas * kLateralSigma};
  const std::vector<float> slopes = smooth_slopes(fits);
  const auto nearest = [](std::int64_t pixel, int count) {
    return std::clamp<std::int64_t>((pixel - WindowFits::kRadius + WindowFits::kStep / 2) / WindowFits::kStep, 0,
                                    count - 1);
  };
  const std::size_t size = static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.height());
  EdgeMarks marks{Marks(size), Marks(size)};
  const float diagonal = std::sqrt(2.0F);
  parallel_for(image.height(), kRowBlock, num_threads, [&](std::int64_t v) {
    const float* const row = image.row(static_cast<int>(v));
    std::vector<float> slope(static_cast<std::size_t>(image.width()), 0.0F);
    for (int u = 0; u < image.width() && !slopes.empty(); ++u) {
      const std::int64_t window = nearest(v, fits.rows) * fits.cols + nearest(u, fits.cols);
      slope[static_cast<std::size_t>(u)] = slopes[static_cast<std::size_t>(window)];
    }
    std::uint8_t* const edge = marks.edge.data() + v * image.width();
    std::uint8_t* const slanted = marks.slanted.data() + v * image.width();
    mark_direction(row, slope.data(), 1, 1.0F, image.width(), limits, edge, slanted);
    mark_direction(row, slope.data(), image.stride(), 1.0F, image.width(), limits, edge, slanted);
    mark_direction(row, slope.data(), image.stride() + 1, diagonal, image.width(), limits, edge, slanted);
    mark_direction(row, slope.data(), image.stride() - 1, diagonal, image.width(), limits, edge, slanted);
  });
  return marks;
}

EdgeMarks mark_gradient_edges(const DepthRef& depth, const DepthOptions& options, int num_threads) {
  const std::int64_t width = depth.cols(), height = depth.rows();
  const auto limit = static_cast<float>(8.0 * options.gradient_threshold);
  EdgeMarks marks{Marks(static_cast<std::size_t>(width * height)), Marks(static_cast<std::size_t>(width * height))};
  parallel_for(height, kRowBlock, num_threads, [&](std::int64_t v) {
    const float* const above = &depth.coeffRef(std::max<std::int64_t>(v - 1, 0), 0);
    const float* const here = &depth.coeffRef(v, 0);
    const float* const below = &depth.coeffRef(std::min(v + 1, height - 1), 0);
    std::uint8_t* const edge = marks.edge.data() + v * width;
    for (std::int64_t u = 0; u < width; ++u) {
      const std::int64_t l = std::max<std::int64_t>(u - 1, 0), r = std::min(u + 1, width - 1);
      const float du = (above[r] - above[l]) + 2.0F * (here[r] - here[l]) + (below[r] - below[l]);
      const float dv = (below[l] - above[l]) + 2.0F * (below[u] - above[u]) + (below[r] - above[r]);
      edge[u] = !(du * du + dv * dv <= limit * limit);  // true for NaN
    }
  });
  return marks;
}

void dilate(int width, int height, int radius, int num_threads, Marks& marks) {
  for (int step = 0; step < radius; ++step) {
    Marks grown(marks);
    parallel_for(height, kRowBlock, num_threads, [&](std::int64_t v) {
      std::uint8_t* const target = grown.data() + v * width;
      const auto add = [&](const std::uint8_t* source, int begin, int end) {
        for (int u = begin; u < end; ++u) target[u] = target[u] | source[u];
      };
      const std::uint8_t* const row = marks.data() + v * width;
      add(row - 1, 1, width);
      add(row + 1, 0, width - 1);
      if (v > 0) add(row - width, 0, width);
      if (v + 1 < height) add(row + width, 0, width);
    });
    marks.swap(grown);
  }
}

}  // namespace nacre
