#include "tracking/confidence_noise.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/numbers.hpp"
#include "base/statistics.hpp"
#include "camera/limits.hpp"
#include "camera/point_projection.hpp"
#include "depth/limits.hpp"
#include "fusion/limits.hpp"
#include "tracking/limits.hpp"

namespace nacre {

void ConfidenceNoise::add(const MaskImage& confidence, const Frame& frame, const PointModel& model,
                          const Pose& world_from_camera, const Camera& camera) {
  if (confidence.size() == 0 || model.size() == 0) return;
  const Factors known = factors();
  std::array<std::vector<float>, std::tuple_size<Factors>::value> residuals;
  const PointProjection view(camera, world_from_camera);
  PointProjection::Block point;
  const std::int64_t step = 1 + model.size() / tracking_limits::most_judged_points;
  for (std::int64_t i = 0; i < model.size(); i += step) {
    const auto k = static_cast<std::size_t>(i);
    view.project(model.points[k].data(), model.normals[k].data(), 1, point);
    if (!point.inside[0] || !(point.facing[0] > fusion_limits::least_facing)) continue;
    const std::int32_t pixel = point.pixel[0];
    const Eigen::Vector3f difference = frame.points.row(pixel).transpose() - point.point(0);
    const float residual = std::abs(difference.dot(point.normal(0)));
    if (!(residual < static_cast<float>(camera_limits::another_surface) * point.z[0])) continue;
    const std::uint8_t level = confidence.data()[pixel];
    residuals[level].push_back(residual * known[level] / frame.sigma[pixel]);
  }
  for (std::size_t level = 0; level < levels_.size(); ++level) {
    if (static_cast<std::int64_t>(residuals[level].size()) < tracking_limits::least_judged) continue;
    const double scale = static_cast<double>(median_of(std::move(residuals[level])));
    if (!(scale > 0.0)) continue;
    Level& mean = levels_[level];
    mean.count = std::min(mean.count + 1.0, depth_limits::most_frames);
    mean.log_scale += (std::log(scale) - mean.log_scale) / mean.count;
  }
}

// Of a level that no frame has told of yet it is that of the nearest that one has.
ConfidenceNoise::Factors ConfidenceNoise::factors() const {
  double best = infinity<double>;
  for (const Level& level : levels_) {
    if (level.count > 0.0) best = std::min(best, level.log_scale);
  }
  Factors result;
  result.fill(1.0F);
  if (best == infinity<double>) return result;
  for (int i = 0; i < static_cast<int>(levels_.size()); ++i) {
    for (int away = 0; away < 2 * static_cast<int>(levels_.size()); ++away) {
      const int other = i + (away % 2 == 0 ? away / 2 : -(away + 1) / 2);
      if (other < 0 || other >= static_cast<int>(levels_.size())) continue;
      const Level& level = levels_[static_cast<std::size_t>(other)];
      if (!(level.count > 0.0)) continue;
      result[static_cast<std::size_t>(i)] = static_cast<float>(std::exp(level.log_scale - best));
      break;
    }
  }
  return result;
}

void ConfidenceNoise::scale(const MaskImage& confidence, Frame& frame) const {
  if (confidence.size() == 0) return;
  const Factors known = factors();
  for (Eigen::Index i = 0; i < frame.sigma.size(); ++i) frame.sigma[i] *= known[confidence.data()[i]];
}

}  // namespace nacre
