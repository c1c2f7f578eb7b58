// Which pixels at the edges of a depth image are noise.
#include <algorithm>
#include <cmath>

#include "depth_cleaning.hpp"
#include "parallel.hpp"

namespace nacre {
namespace {

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

// To each pixel of row v the slope of the nearest window.
void spread_slopes(const WindowFits& fits, const std::vector<float>& slopes, int v, std::vector<float>& row) {
  const auto nearest = [](int pixel, int count) {
    return std::clamp((pixel - WindowFits::kRadius + WindowFits::kStep / 2) / WindowFits::kStep, 0, count - 1);
  };
  const float* const windows = slopes.data() + nearest(v, fits.rows) * fits.cols;
  for (std::size_t u = 0; u < row.size(); ++u) row[u] = windows[nearest(static_cast<int>(u), fits.cols)];
}

// The tests of one row; marks are as wide as the values, so that the loops vectorize.
struct RowTest {
  explicit RowTest(int width)
      : slope(static_cast<std::size_t>(width)),
        bend(slope.size()),
        step(slope.size()),
        edge(slope.size()),
        slanted(slope.size()) {}

  std::vector<float> slope, bend, step;
  std::vector<std::int32_t> edge, slanted;
};

// The limits between pixels that are `length` apart.
void set_limits(const float* centre, const PlanarLimits& limits, float length, RowTest& test) {
  const PlanarLimits l = limits;
  const float* const slope = test.slope.data();
  float* const bend = test.bend.data();
  float* const step = test.step.data();
  const std::size_t width = test.slope.size();
  for (std::size_t u = 0; u < width; ++u) {
    const float c = centre[u];
    bend[u] = std::max(l.bend_noise(c), l.bend_crease(c) * length) + l.bend_lateral * slope[u];
    step[u] = l.step_noise(c) + l.step_slant(c) * length + l.step_lateral * slope[u];
  }
}

// Surfaces that are too steep as a whole; what is steep pixel by pixel only is found by mark_direction.
void mark_slanted(const float* centre, const PlanarLimits& limits, RowTest& test) {
  const Quadratic limit = limits.step_slant;
  const float* const slope = test.slope.data();
  std::int32_t* const slanted = test.slanted.data();
  const std::size_t width = test.slope.size();
  for (std::size_t u = 0; u < width; ++u) slanted[u] = slope[u] > limit(centre[u]);
}

// One of the four directions through each pixel of a row, with neighbours at -offset and +offset. Comparisons with a
// missing neighbour (NaN) are false.
void mark_direction(const float* centre, std::ptrdiff_t offset, RowTest& test) {
  const float* const a = centre - offset;
  const float* const b = centre + offset;
  const float* const beyond_a = a - offset;
  const float* const beyond_b = b + offset;
  const float* const bend = test.bend.data();
  const float* const step = test.step.data();
  std::int32_t* const edge = test.edge.data();
  std::int32_t* const slanted = test.slanted.data();
  const std::size_t width = test.slope.size();
  for (std::size_t u = 0; u < width; ++u) {
    const float from_a = centre[u] - a[u], from_b = centre[u] - b[u];
    const std::int32_t bent = std::abs(from_a + from_b) > bend[u];
    // At a rim the pixel is held against the plane through its two inner neighbours.
    const std::int32_t no_a = a[u] != a[u], no_b = b[u] != b[u];
    const std::int32_t bent_a = std::abs(from_a + (beyond_a[u] - a[u])) > bend[u];
    const std::int32_t bent_b = std::abs(from_b + (beyond_b[u] - b[u])) > bend[u];
    const std::int32_t steep_a = std::abs(from_a) > step[u], steep_b = std::abs(from_b) > step[u];
    edge[u] |= bent | (no_a & bent_b) | (no_b & bent_a);
    slanted[u] |= (steep_a | no_a) & (steep_b | no_b) & (steep_a | steep_b);
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
  const auto size = static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.height());
  EdgeMarks marks{Marks(size), Marks(size)};
  parallel_blocks(image.height(), rows_per_block(image.width()), num_threads,
                  [&](std::int64_t, std::int64_t begin, std::int64_t end) {
                    RowTest test(image.width());
                    for (std::int64_t v = begin; v < end; ++v) {
                      const float* const row = image.row(static_cast<int>(v));
                      if (!slopes.empty()) spread_slopes(fits, slopes, static_cast<int>(v), test.slope);
                      std::fill(test.edge.begin(), test.edge.end(), 0);
                      mark_slanted(row, limits, test);
                      set_limits(row, limits, 1.0F, test);
                      mark_direction(row, 1, test);
                      mark_direction(row, image.stride(), test);
                      set_limits(row, limits, std::sqrt(2.0F), test);
                      mark_direction(row, image.stride() + 1, test);
                      mark_direction(row, image.stride() - 1, test);
                      std::copy(test.edge.begin(), test.edge.end(), marks.edge.begin() + v * image.width());
                      std::copy(test.slanted.begin(), test.slanted.end(), marks.slanted.begin() + v * image.width());
                    }
                  });
  return marks;
}

EdgeMarks mark_gradient_edges(const DepthRef& measured, const DepthOptions& options, int num_threads) {
  const std::int64_t width = measured.cols(), height = measured.rows();
  const DepthImage depth =
      measured.unaryExpr([](float z) { return is_measurement(z) ? z : std::numeric_limits<float>::quiet_NaN(); });
  const auto limit = static_cast<float>(8.0 * options.gradient_threshold);
  EdgeMarks marks{Marks(static_cast<std::size_t>(width * height)), Marks(static_cast<std::size_t>(width * height))};
  parallel_for(height, rows_per_block(width), num_threads, [&](std::int64_t v) {
    const float* const above = &depth(std::max<std::int64_t>(v - 1, 0), 0);
    const float* const here = &depth(v, 0);
    const float* const below = &depth(std::min(v + 1, height - 1), 0);
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
    parallel_for(height, rows_per_block(width), num_threads, [&](std::int64_t v) {
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
