#include "outlines/match.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "base/limits.hpp"
#include "base/parallel.hpp"
#include "base/statistics.hpp"
#include "camera/limits.hpp"
#include "outlines/limits.hpp"

namespace nacre {
namespace {

// How far behind a point of a surface a camera saw something, along its normal [m], averaged over the pixels around;
// NaN where it saw nothing, none outside of the image. All in the camera frame.
std::optional<double> distance_behind(const DepthView& view, const Camera& camera, const Eigen::Vector3d& point,
                                      const Eigen::Vector3d& normal) {
  const Eigen::Vector2d pixel = camera.project(point);
  if (!(pixel.x() > 1.0 && pixel.y() > 1.0 && pixel.x() < camera.width() - 2 && pixel.y() < camera.height() - 2)) {
    return std::nullopt;
  }
  const int u = static_cast<int>(std::lround(pixel.x())), v = static_cast<int>(std::lround(pixel.y()));
  double sum = 0.0;
  int count = 0;
  for (int y = v - 1; y <= v + 1; ++y) {
    for (int x = u - 1; x <= u + 1; ++x) {
      const double z = static_cast<double>(view.depth[y * camera.width() + x]);
      if (!std::isfinite(z)) continue;
      sum -= (unproject(camera, x, y, z) - point).dot(normal);
      ++count;
    }
  }
  return sum / count;
}

bool is_contradicted(const OutlinePoint& edge, const DepthView& view, const Camera& camera, double pixel,
                     double noise) {
  const bool is_orthographic = camera.model() == Camera::Model::orthographic;
  const Eigen::Vector3d sight_line = is_orthographic ? Eigen::Vector3d::UnitZ() : edge.point.normalized();
  if (!(-edge.normal.dot(sight_line) > static_cast<double>(camera_limits::least_facing))) return false;
  const double tolerance = pixel + base_limits::noise_sigmas * noise;
  const auto here =
      distance_behind(view, camera, edge.point - outlines_limits::look_across * pixel * edge.outward, edge.normal);
  if (!here) return false;
  const Visibility inside = visibility(*here, tolerance);
  if (inside == Visibility::seen_through || inside == Visibility::unknown) return true;
  const auto beyond =
      distance_behind(view, camera, edge.point + outlines_limits::look_across * pixel * edge.outward, edge.normal);
  return beyond && visibility(*beyond, tolerance) == Visibility::agrees;
}

}  // namespace

std::vector<OutlinePoint> moved(std::vector<OutlinePoint> outline, const Pose& pose) {
  for (OutlinePoint& edge : outline) {
    edge = {pose * edge.point, pose.linear() * edge.normal, pose.linear() * edge.outward, edge.pixel};
  }
  return outline;
}

double median_pixel(const std::vector<OutlinePoint>& outline) {
  std::vector<double> pixels;
  pixels.reserve(outline.size());
  for (const OutlinePoint& edge : outline) pixels.push_back(edge.pixel);
  return median_of(std::move(pixels));
}

std::vector<int> nearest_edges(const std::vector<OutlinePoint>& outline, const std::vector<OutlinePoint>& others,
                               double gate, int num_threads) {
  std::vector<std::pair<double, int>> by_x;
  by_x.reserve(others.size());
  for (std::size_t k = 0; k < others.size(); ++k) by_x.emplace_back(others[k].point.x(), static_cast<int>(k));
  std::sort(by_x.begin(), by_x.end());
  std::vector<int> nearest(outline.size(), -1);
  parallel_for(static_cast<std::int64_t>(outline.size()), 32, num_threads, [&](std::int64_t row) {
    const auto i = static_cast<std::size_t>(row);
    const OutlinePoint& edge = outline[i];
    double least = gate * gate;
    const double x = edge.point.x();
    for (auto at = std::lower_bound(by_x.begin(), by_x.end(), std::pair(x - gate, 0));
         at != by_x.end() && at->first <= x + gate; ++at) {
      const OutlinePoint& other = others[static_cast<std::size_t>(at->second)];
      const double squared = (other.point - edge.point).squaredNorm();
      const bool is_nearer = squared < least || (squared == least && at->second < nearest[i]);
      if (!is_nearer || other.outward.dot(edge.outward) < base_limits::same_surface_cosine ||
          other.normal.dot(edge.normal) < base_limits::same_surface_cosine) {
        continue;
      }
      least = squared;
      nearest[i] = at->second;
    }
  });
  return nearest;
}

double agreement_of(const std::vector<OutlinePoint>& outline, const std::vector<int>& matches, const DepthView& view,
                    const Camera& camera, double pixel, double noise) {
  const std::vector<OutlinePoint> seen = moved(outline, view.world_from_camera.inverse());
  std::size_t agree = 0, contradicted = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (matches[i] >= 0) {
      ++agree;
    } else if (is_contradicted(seen[i], view, camera, pixel, noise)) {
      ++contradicted;
    }
  }
  return agree > 0 ? static_cast<double>(agree) / static_cast<double>(agree + contradicted) : 0.0;
}

}  // namespace nacre
