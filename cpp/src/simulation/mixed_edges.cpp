#include "simulation/mixed_edges.hpp"

#include <algorithm>
#include <cmath>

#include "base/parallel.hpp"
#include "simulation/limits.hpp"

namespace nacre {
namespace {

using Eigen::Vector3d;

// The depth at which a ray meets the plane of the triangle that another ray hit.
double depth_on_plane(const WorldRay& ray, const WorldRay& other, double other_depth, const Vector3d& normal) {
  return normal.dot(other.origin + other_depth * other.direction - ray.origin) / normal.dot(ray.direction);
}

// Whether one surface, bent at most once, can run through both pixels: the step of depth between them lies between the
// steps along the tangent planes of the two, give or take a pixel's width.
bool is_connected(const View& view, const Hits& hits, std::int64_t a, std::int64_t b) {
  const MeshTree::Hit hit_a = hits[static_cast<std::size_t>(a)], hit_b = hits[static_cast<std::size_t>(b)];
  if (hit_a.triangle == hit_b.triangle) return true;
  if (hit_a.triangle < 0 || hit_b.triangle < 0) return false;
  const WorldRay ray_a = view.ray(a), ray_b = view.ray(b);
  const double step = hit_b.distance - hit_a.distance;
  const double step_a = depth_on_plane(ray_b, ray_a, hit_a.distance, view.normal(hit_a.triangle)) - hit_a.distance;
  const double step_b = hit_b.distance - depth_on_plane(ray_a, ray_b, hit_b.distance, view.normal(hit_b.triangle));
  const double tolerance = view.footprint(std::min(hit_a.distance, hit_b.distance));
  return step >= std::min(step_a, step_b) - tolerance && step <= std::max(step_a, step_b) + tolerance;
}

}  // namespace

std::vector<std::uint8_t> find_edges(const View& view, const Hits& hits, double radius, int num_threads) {
  const int width = view.width(), height = view.height();
  const auto pixel = [width](int u, int v) { return static_cast<std::int64_t>(v) * width + u; };
  std::vector<std::uint8_t> starts(hits.size(), 0);  // 1: not connected to the right, 2: to the pixel below
  parallel_for(height, 8, num_threads, [&](std::int64_t row) {
    const int v = static_cast<int>(row);
    for (int u = 0; u < width; ++u) {
      int breaks = 0;
      if (u + 1 < width && !is_connected(view, hits, pixel(u, v), pixel(u + 1, v))) breaks |= 1;
      if (v + 1 < height && !is_connected(view, hits, pixel(u, v), pixel(u, v + 1))) breaks |= 2;
      starts[static_cast<std::size_t>(pixel(u, v))] = static_cast<std::uint8_t>(breaks);
    }
  });
  std::vector<std::uint8_t> edges(hits.size(), 0);
  const int reach = static_cast<int>(std::ceil(radius)) - 1;
  const auto mark = [&](int left, int top, int right, int bottom) {
    for (int v = std::max(0, top - reach); v <= std::min(height - 1, bottom + reach); ++v) {
      for (int u = std::max(0, left - reach); u <= std::min(width - 1, right + reach); ++u) {
        edges[static_cast<std::size_t>(pixel(u, v))] = 1;
      }
    }
  };
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const int breaks = starts[static_cast<std::size_t>(pixel(u, v))];
      if (breaks & 1) mark(u, v - 1, u + 1, v + 1);
      if (breaks & 2) mark(u - 1, v, u + 1, v + 1);
    }
  }
  return edges;
}

double background_of(const View& view, const Hits& hits, double given) {
  if (given > 0.0) return given;
  double farthest = 0.0;
  for (const MeshTree::Hit& hit : hits) farthest = std::max(farthest, hit.distance);
  return farthest + simulation_limits::background_room * view.diagonal();
}

double mixed_depth(const View& view, double u, double v, double radius, double background) {
  using simulation_limits::rays_per_radius;
  double sum = 0.0, sum_weights = 0.0;
  bool any = false;
  for (int row = -rays_per_radius; row < rays_per_radius; ++row) {
    for (int column = -rays_per_radius; column < rays_per_radius; ++column) {
      const double x = (column + 0.5) / rays_per_radius, y = (row + 0.5) / rays_per_radius;
      const double weight = (1.0 - std::abs(x)) * (1.0 - std::abs(y));
      const MeshTree::Hit hit = view.cast(view.ray(u + radius * x, v + radius * y));
      any = any || hit.triangle >= 0;
      sum += weight * (hit.triangle >= 0 ? hit.distance : background);
      sum_weights += weight;
    }
  }
  return any ? sum / sum_weights : not_measured;
}

}  // namespace nacre
