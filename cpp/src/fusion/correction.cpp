#include "fusion/correction.hpp"

#include <algorithm>
#include <cmath>

#include "base/limits.hpp"
#include "base/parallel.hpp"
#include "camera/limits.hpp"
#include "camera/view_volume.hpp"
#include "depth/tilt.hpp"
#include "fusion/limits.hpp"
#include "spatial/hash_grid.hpp"

namespace nacre {

void move_points(PointModel& model, const std::vector<Pose>& corrections, int num_threads) {
  parallel_for(model.size(), 4096, num_threads, [&](std::int64_t k) {
    const auto i = static_cast<std::size_t>(k);
    const Eigen::Isometry3f motion(corrections[static_cast<std::size_t>(model.last_seen[i])].cast<float>());
    model.points[i] = motion * model.points[i];
    model.normals[i] = (motion.linear() * model.normals[i]).normalized();
  });
}

void straighten_points(PointModel& model, const std::vector<Pose>& poses, double tilt, int num_threads) {
  parallel_for(model.size(), 4096, num_threads, [&](std::int64_t k) {
    const auto i = static_cast<std::size_t>(k);
    const Eigen::Isometry3f pose(poses[static_cast<std::size_t>(model.last_seen[i])].cast<float>());
    const SurfacePoint seen = {pose.inverse() * model.points[i], pose.linear().transpose() * model.normals[i]};
    const SurfacePoint straight = without_tilt(seen, tilt);
    model.points[i] = pose * straight.point;
    model.normals[i] = pose.linear() * straight.normal;
  });
}

std::vector<std::uint8_t> merge_layers(PointModel& model, std::int32_t oldest_frame, double spacing,
                                       const std::function<double(const Eigen::Vector3f&)>& spacing_of) {
  const auto reach_of = [&](int level) {
    return std::ldexp(spacing, level) * std::hypot(1.0, camera_limits::surface_spacings);
  };
  std::vector<std::uint8_t> is_old(model.points.size());
  Box newer;
  for (std::size_t i = 0; i < is_old.size(); ++i) {
    is_old[i] = model.last_seen[i] < oldest_frame ? 1 : 0;
    if (is_old[i] == 0) newer.extend(model.points[i]);
  }
  const auto margin = static_cast<float>(reach_of(fusion_limits::layer_levels - 1));
  const Box reached(newer.min() - Eigen::Vector3f::Constant(margin), newer.max() + Eigen::Vector3f::Constant(margin));
  std::vector<std::size_t> old;  // those that may have newer ones beside them
  for (std::size_t i = 0; i < is_old.size(); ++i) {
    if (is_old[i] != 0 && reached.contains(model.points[i])) old.push_back(i);
  }
  std::vector<PointGrid> grids;
  for (int level = 0; level < fusion_limits::layer_levels; ++level) {
    grids.emplace_back(reach_of(level), old.size());
    for (const std::size_t i : old) grids.back().add(model.points[i]);
  }

  std::vector<std::uint8_t> flags(model.points.size(), 1);
  for (std::size_t i = 0; i < model.points.size(); ++i) {
    if (is_old[i] != 0) continue;
    int level = 0;
    const double wanted = spacing_of(model.points[i]);
    while (level + 1 < fusion_limits::layer_levels && std::ldexp(spacing, level) < wanted) ++level;
    const double between = std::clamp(wanted, spacing, std::ldexp(spacing, level));
    const auto reach = static_cast<float>(between),
               across = static_cast<float>(camera_limits::surface_spacings * between);
    // The nearest along the surface, the older of two as near.
    std::size_t best = 0;
    float least = reach * reach;
    grids[static_cast<std::size_t>(level)].any_near(model.points[i], [&](std::int32_t k) {
      const std::size_t j = old[static_cast<std::size_t>(k)];
      const Eigen::Vector3f difference = model.points[i] - model.points[j];
      const float offset = difference.dot(model.normals[j]);
      const float along = difference.squaredNorm() - offset * offset;
      if (std::abs(offset) < across && (along < least || (along == least && j < best)) &&
          model.normals[i].dot(model.normals[j]) > base_limits::same_side_cosine) {
        least = along;
        best = j;
      }
      return false;
    });
    if (!(least < reach * reach)) continue;
    flags[i] = 0;
    const float gain = model.confidence[i] / (model.confidence[i] + model.confidence[best]);
    model.points[best] += gain * (model.points[i] - model.points[best]).dot(model.normals[best]) * model.normals[best];
    model.normals[best] = (model.normals[best] + gain * (model.normals[i] - model.normals[best])).normalized();
    if (!model.colors.empty() && model.colors[i].allFinite()) {
      Eigen::Vector3f& color = model.colors[best];
      color = color.allFinite() ? Eigen::Vector3f(color + gain * (model.colors[i] - color)) : model.colors[i];
    }
    for (PointAttribute& attribute : model.attributes) {
      const auto channels = static_cast<std::size_t>(attribute.num_channels);
      for (std::size_t c = 0; c < channels; ++c) {
        float& value = attribute.values[best * channels + c];
        const float other = attribute.values[i * channels + c];
        if (std::isfinite(other)) value = std::isfinite(value) ? value + gain * (other - value) : other;
      }
    }
    model.confidence[best] += model.confidence[i];
    model.observations[best] =
        static_cast<std::uint8_t>(std::min(255, model.observations[best] + model.observations[i]));
    model.last_seen[best] = std::max(model.last_seen[best], model.last_seen[i]);
  }
  for (std::size_t i = 0; i < model.points.size(); ++i) {
    if (is_old[i] != 0) model.free_space_violations[i] = 0;
  }
  model.keep(flags);
  return flags;
}

}  // namespace nacre
