#include "fusion/exposure.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/limits.hpp"
#include "base/statistics.hpp"
#include "camera/limits.hpp"
#include "camera/point_projection.hpp"
#include "depth/depth_view.hpp"
#include "fusion/limits.hpp"
#include "fusion/observable.hpp"

namespace nacre {
namespace {

bool is_well_exposed(const Eigen::Vector3f& color) {
  return color.minCoeff() >= fusion_limits::darkest_color && color.maxCoeff() <= fusion_limits::brightest_color;
}

// The median of ratios [log]; 1 where chance explains it: its standard error is sqrt(pi / 2n) of theirs.
float significant_gain(std::vector<float> ratios) {
  const float middle = median_of(ratios);
  for (float& ratio : ratios) ratio = std::abs(ratio - middle);
  const double count = static_cast<double>(ratios.size());
  const double error = std::sqrt(0.5 * M_PI / count) * mad_to_sigma * static_cast<double>(median_of(std::move(ratios)));
  return std::abs(static_cast<double>(middle)) > base_limits::noise_sigmas * error ? std::exp(middle) : 1.0F;
}

}  // namespace

Eigen::Vector3f color_gain(const PointModel& model, const BlockIndex& blocks, const std::vector<PointRange>& in_view,
                           const RegisteredFrame& now, double spacing) {
  if (!now.observer.has_colors() || model.colors.empty()) return Eigen::Vector3f::Ones();
  const PointProjection view(now.camera, now.world_from_camera);
  std::array<std::vector<float>, 3> ratios;
  constexpr std::size_t block_size = PointProjection::capacity;
  PointProjection::Block points;
  for (const PointRange& range : in_view) {
    view.project(model.points[range.first].data(), model.normals[range.first].data(), range.count, points);
    std::size_t num_left = blocks.num_left_before(range.first), next_gap = blocks.first_gap_behind(range.first);
    for (int j = 0; j < range.count; ++j) {
      const std::size_t i = range.first + static_cast<std::size_t>(j);
      if (i == next_gap) {
        num_left = blocks.num_left_before(i);
        next_gap = blocks.first_gap_behind(i);
      }
      if ((i + num_left) / block_size % fusion_limits::exposure_blocks != 0) continue;
      if (!points.inside[j] || !(points.facing[j] > fusion_limits::least_facing)) continue;
      const std::int32_t pixel = points.pixel[j];
      const float margin = std::max(static_cast<float>(camera_limits::surface_spacings * spacing),
                                    base_limits::noise_sigmas * sigma_at(now.frame, pixel));
      if (visibility(now.frame.points(pixel, 2) - points.z[j], margin) != Visibility::agrees) continue;
      const Eigen::Vector3f known = model.colors[i];
      const Eigen::Vector3f seen = now.observer.color(pixel % now.frame.width, pixel / now.frame.width);
      if (!known.allFinite() || !is_well_exposed(known) || !is_well_exposed(seen)) continue;
      for (int c = 0; c < 3; ++c) ratios[static_cast<std::size_t>(c)].push_back(std::log(known[c] / seen[c]));
    }
  }
  Eigen::Vector3f gain = Eigen::Vector3f::Ones();
  if (ratios[0].size() < fusion_limits::least_exposure_points) return gain;
  for (int c = 0; c < 3; ++c) gain[c] = significant_gain(std::move(ratios[static_cast<std::size_t>(c)]));
  return gain;
}

SharedExposure share_exposure(const PointModel& model, const BlockIndex& blocks, const std::vector<PointRange>& in_view,
                              const RegisteredFrame& now, double spacing) {
  const Eigen::Vector3f gain = color_gain(model, blocks, in_view, now, spacing);
  if (gain == Eigen::Vector3f::Ones()) return {};
  const float share = -1.0F / std::max(1.0F, static_cast<float>(now.index) + 1.0F);
  const Eigen::Vector3f moved = gain.array().pow(share);
  return {gain.cwiseProduct(moved), moved};
}

void expose_points(PointModel& model, const Eigen::Vector3f& gain) {
  for (Eigen::Vector3f& color : model.colors) {
    if (color.allFinite()) color = exposed(color, gain);
  }
}

}  // namespace nacre
