#include "depth/coarse_depth.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
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

}  // namespace

float coarse_unit(const DepthRef& depth) {
  std::size_t num_equal = 0;
  std::vector<float> steps, levels;
  for (Eigen::Index v = 0; v < depth.rows(); v += depth_limits::probed_rows) {
    for (Eigen::Index u = 0; u + 1 < depth.cols(); ++u) {
      const float z = depth(v, u), step = std::abs(z - depth(v, u + 1));
      if (!is_measurement(z) || !is_measurement(depth(v, u + 1))) continue;
      if (step == 0.0F) {
        ++num_equal;
      } else {
        steps.push_back(step);
        levels.push_back(z);
      }
    }
  }
  if (steps.empty() || num_equal <= steps.size()) return 0.0F;
  // Steep and far surfaces step by several units at once, but seldom everywhere.
  const auto unit = static_cast<float>(quantile(steps, depth_limits::unit_quantile));
  const auto is_multiple = [&](float step) {
    const float units = step / unit;
    return std::abs(units - std::round(units)) < depth_limits::unit_tolerance;
  };
  const auto num_multiples = static_cast<double>(std::count_if(steps.begin(), steps.end(), is_multiple));
  if (num_multiples < depth_limits::least_multiples * static_cast<double>(steps.size())) return 0.0F;
  std::sort(levels.begin(), levels.end());
  const auto num_levels = std::unique(levels.begin(), levels.end()) - levels.begin();
  return num_levels < depth_limits::least_levels ? 0.0F : unit;
}

DepthImage interpolate_plateaus(const DepthRef& depth, float unit, int num_threads) {
  DepthImage sum = depth, weight = DepthImage::Zero(depth.rows(), depth.cols());
  // A plateau that is twice as long tells its slope half as well.
  const auto add = [&](Eigen::Index v, Eigen::Index u, float value, float length) {
    const float added = 1.0F / (length * length);
    sum(v, u) = (weight(v, u) > 0.0F ? sum(v, u) : 0.0F) + added * value;
    weight(v, u) += added;
  };
  parallel_for(depth.rows(), rows_per_block(depth.cols()), num_threads, [&](std::int64_t v) {
    for_each_on_plateau({&depth.coeffRef(v, 0), 1, depth.cols()}, unit,
                        [&](Eigen::Index u, float value, float length) { add(v, u, value, length); });
  });
  parallel_for(depth.cols(), rows_per_block(depth.rows()), num_threads, [&](std::int64_t u) {
    for_each_on_plateau({&depth.coeffRef(0, u), depth.outerStride(), depth.rows()}, unit,
                        [&](Eigen::Index v, float value, float length) { add(v, u, value, length); });
  });
  return (weight > 0.0F).select(sum / weight, depth);
}

NoiseModel with_unit(const NoiseModel& noise, float unit) {
  NoiseModel rounded = noise;
  rounded.constant = std::hypot(noise.constant, static_cast<double>(unit) / std::sqrt(12.0));
  return rounded;
}

}  // namespace nacre
