#include "depth/coarse_depth.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <vector>

#include "base/parallel.hpp"
#include "depth/inverse_depth_image.hpp"
#include "depth/limits.hpp"
#include "depth/window_fits.hpp"

namespace nacre {
namespace {

// Values of one row or column of an image.
struct Line {
  const float* first;
  Eigen::Index stride, size;

  float operator[](Eigen::Index i) const { return first[i * stride]; }
};

// At the middle of each plateau its value is right, and at its end the mean with the next plateau, one unit away; visit
// gets each measured pixel, what is interpolated between those for it, and the length of its plateau.
template <class Visit>
void for_each_on_plateau(const Line& line, float unit, Visit&& visit) {
  const auto mean_with = [&](float value, Eigen::Index other) {
    const bool is_next =
        other >= 0 && other < line.size && std::abs(line[other] - value) < (1.0F + depth_limits::unit_tolerance) * unit;
    return is_next ? 0.5F * (value + line[other]) : value;
  };
  for (Eigen::Index begin = 0, end = 0; begin < line.size; begin = end) {
    const float value = line[begin];
    end = begin + 1;
    if (!is_measurement(value)) continue;
    while (end < line.size && line[end] == value) ++end;
    const auto length = static_cast<float>(end - begin);
    const float before = mean_with(value, begin - 1), after = mean_with(value, end);
    for (Eigen::Index i = begin; i < end; ++i) {
      const float place = (2.0F * static_cast<float>(i - begin) + 1.0F) / length - 1.0F;  // -1 to 1 along the plateau
      visit(i, value + (place < 0.0F ? before - value : after - value) * std::abs(place), length);
    }
  }
}

// Steep and far surfaces step by several units at once, but seldom everywhere.
float smallest_step(const std::vector<float>& steps) {
  return static_cast<float>(quantile(steps, depth_limits::unit_quantile));
}

// The same of steps that the storage of depth has rounded, too.
float smallest_rounded_step(const std::vector<float>& steps) {
  const float least = smallest_step(steps);
  std::vector<float> single;
  std::copy_if(steps.begin(), steps.end(), std::back_inserter(single),
               [&](float step) { return 0.5F * least < step && step < 1.5F * least; });
  return single.empty() ? 0.0F : static_cast<float>(quantile(single, 0.5));
}

// Whether nearly all steps between so many levels are multiples of a unit.
bool is_unit(float unit, const std::vector<float>& steps, const std::vector<float>& levels) {
  if (!(unit > 0.0F)) return false;
  const auto is_multiple = [&](float step) {
    const float units = step / unit;
    return std::abs(units - std::round(units)) < depth_limits::unit_tolerance;
  };
  const auto num_multiples = static_cast<double>(std::count_if(steps.begin(), steps.end(), is_multiple));
  if (num_multiples < depth_limits::least_multiples * static_cast<double>(steps.size())) return false;
  std::vector<float> sorted = levels;
  std::sort(sorted.begin(), sorted.end());
  return std::unique(sorted.begin(), sorted.end()) - sorted.begin() >= depth_limits::least_levels;
}

// visit(z, next) for each two measured pixels that are neighbours in a probed row.
template <class Visit>
void for_each_neighbors(const DepthRef& depth, Visit&& visit) {
  for (Eigen::Index v = 0; v < depth.rows(); v += depth_limits::probed_rows) {
    const float* const row = &depth.coeffRef(v, 0);
    for (Eigen::Index u = 0; u + 1 < depth.cols(); ++u) {
      if (is_measurement(row[u]) && is_measurement(row[u + 1])) visit(row[u], row[u + 1]);
    }
  }
}

// Between the plateaus of an image whose steps are of this size.
DepthImage interpolate(const DepthRef& depth, float step, int num_threads) {
  DepthImage sum = depth, weight = DepthImage::Zero(depth.rows(), depth.cols());
  // A plateau that is twice as long tells its slope half as well.
  const auto add = [&](Eigen::Index v, Eigen::Index u, float value, float length) {
    const float added = 1.0F / (length * length);
    sum(v, u) = (weight(v, u) > 0.0F ? sum(v, u) : 0.0F) + added * value;
    weight(v, u) += added;
  };
  parallel_for(depth.rows(), rows_per_block(depth.cols()), num_threads, [&](std::int64_t v) {
    for_each_on_plateau({&depth.coeffRef(v, 0), 1, depth.cols()}, step,
                        [&](Eigen::Index u, float value, float length) { add(v, u, value, length); });
  });
  parallel_for(depth.cols(), rows_per_block(depth.rows()), num_threads, [&](std::int64_t u) {
    for_each_on_plateau({&depth.coeffRef(0, u), depth.outerStride(), depth.rows()}, step,
                        [&](Eigen::Index v, float value, float length) { add(v, u, value, length); });
  });
  return (weight > 0.0F).select(sum / weight, depth);
}

}  // namespace

DepthUnit coarse_unit(const DepthRef& depth) {
  std::int64_t num_equal = 0, num_steps = 0;
  for_each_neighbors(depth, [&](float z, float next) {
    num_equal += z == next;
    num_steps += z != next;
  });
  if (num_steps == 0 || num_equal <= num_steps) return {};
  std::vector<float> steps, levels, nexts;
  for_each_neighbors(depth, [&](float z, float next) {
    if (z == next) return;
    steps.push_back(std::abs(z - next));
    levels.push_back(z);
    nexts.push_back(next);
  });
  if (const float unit = smallest_step(steps); is_unit(unit, steps, levels)) return {unit, false};
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const float step = std::abs(1.0F / levels[i] - 1.0F / nexts[i]);
    steps[i] = std::isfinite(step) ? step : 0.0F;
  }
  if (const float unit = smallest_rounded_step(steps); is_unit(unit, steps, levels)) return {unit, true};
  return {};
}

DepthImage interpolate_plateaus(const DepthRef& depth, const DepthUnit& unit, int num_threads) {
  if (!unit.is_of_inverse) return interpolate(depth, unit.step, num_threads);
  const DepthImage inverse = depth.unaryExpr([](float z) { return is_measurement(z) ? 1.0F / z : z; });
  return interpolate(inverse, unit.step, num_threads).unaryExpr([](float value) {
    return is_measurement(value) ? 1.0F / value : value;
  });
}

NoiseModel with_unit(const NoiseModel& noise, const DepthUnit& unit) {
  if (!(unit.step > 0.0F)) return noise;
  NoiseModel rounded = noise;
  const double sigma = static_cast<double>(unit.step) / std::sqrt(12.0);
  if (unit.is_of_inverse) {
    rounded.offset = 0.0;  // depth is triangulated
    rounded.quadratic = std::hypot(noise.quadratic, sigma);
  } else {
    rounded.constant = std::hypot(noise.constant, sigma);
  }
  return rounded;
}

}  // namespace nacre
