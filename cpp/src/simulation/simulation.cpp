#include "nacre/simulation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "base/check.hpp"
#include "base/parallel.hpp"
#include "base/pose_check.hpp"
#include "base/random.hpp"
#include "simulation/limits.hpp"

namespace nacre {
namespace {

using Eigen::Vector3d;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr std::int64_t block_size = 1024;

struct WorldRay {
  Vector3d origin, direction;
};

// The mesh as the pixels of a camera see it.
class View {
 public:
  View(const MeshTree& mesh, const Camera& camera, const Pose& world_from_camera)
      : mesh_(mesh),
        camera_(camera),
        rotation_(world_from_camera.linear()),
        translation_(world_from_camera.translation()) {}

  std::int64_t num_pixels() const { return static_cast<std::int64_t>(width()) * height(); }
  int width() const { return camera_.width(); }
  int height() const { return camera_.height(); }
  double footprint(double depth) const { return std::abs(camera_.footprint(depth)); }
  Vector3d normal(std::int32_t triangle) const { return mesh_.normal(triangle); }
  MeshTree::Hit cast(const WorldRay& ray) const { return mesh_.cast(ray.origin, ray.direction); }

  WorldRay ray(std::int64_t pixel) const {
    const Ray ray = camera_.ray(static_cast<int>(pixel % width()), static_cast<int>(pixel / width()));
    return to_world({ray.origin_x, ray.origin_y, 0.0}, {ray.direction_x, ray.direction_y, ray.direction_z});
  }

  // Between pixel centres, by linear interpolation of the rays; beyond the border, by extrapolation.
  WorldRay ray(double u, double v) const {
    const int left = std::clamp(static_cast<int>(std::floor(u)), 0, std::max(0, width() - 2));
    const int top = std::clamp(static_cast<int>(std::floor(v)), 0, std::max(0, height() - 2));
    const int right = std::min(left + 1, width() - 1), bottom = std::min(top + 1, height() - 1);
    const double x = u - left, y = v - top;
    Vector3d origin = Vector3d::Zero(), direction = Vector3d::Zero();
    const auto add = [&](int column, int row, double weight) {
      const Ray ray = camera_.ray(column, row);
      origin += weight * Vector3d(ray.origin_x, ray.origin_y, 0.0);
      direction += weight * Vector3d(ray.direction_x, ray.direction_y, ray.direction_z);
    };
    add(left, top, (1.0 - x) * (1.0 - y));
    add(right, top, x * (1.0 - y));
    add(left, bottom, (1.0 - x) * y);
    add(right, bottom, x * y);
    return to_world(origin, direction);
  }

 private:
  WorldRay to_world(const Vector3d& origin, const Vector3d& direction) const {
    return {rotation_ * origin + translation_, rotation_ * direction};
  }

  const MeshTree& mesh_;
  const Camera& camera_;
  Eigen::Matrix3d rotation_;
  Vector3d translation_;
};

using Hits = std::vector<MeshTree::Hit>;

Hits cast_pixels(const View& view, int num_threads) {
  Hits hits(static_cast<std::size_t>(view.num_pixels()));
  parallel_for(view.num_pixels(), block_size, num_threads,
               [&](std::int64_t i) { hits[static_cast<std::size_t>(i)] = view.cast(view.ray(i)); });
  return hits;
}

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

// 1 for the pixels that may see a depth edge within `radius`: the corners of each square of four pixels through which
// an edge runs, and their neighbours where the radius is more than a pixel.
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

// The mean depth of a square of rays around pixel (u, v), weighted by a tent; NaN where all see the background. A tent
// is a box (the blur) over a box (the pixel, where the image is sampled down).
double mixed_depth(const View& view, int u, int v, double radius, double background) {
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
  return any ? sum / sum_weights : nan;
}

using Depths = std::vector<double>;

void mix_edges(const View& view, const MeshTree& mesh, const Hits& hits, const SimulationOptions& options,
               Depths& depths) {
  double background = options.background_depth;
  if (background == 0.0) {
    for (const MeshTree::Hit& hit : hits) background = std::max(background, hit.distance);
    background += simulation_limits::background_room * (mesh.upper() - mesh.lower()).norm();
  }
  const std::vector<std::uint8_t> edges = find_edges(view, hits, options.edge_mixing, options.num_threads);
  parallel_for(view.num_pixels(), 64, options.num_threads, [&](std::int64_t i) {
    if (!edges[static_cast<std::size_t>(i)]) return;
    depths[static_cast<std::size_t>(i)] = mixed_depth(
        view, static_cast<int>(i % view.width()), static_cast<int>(i / view.width()), options.edge_mixing, background);
  });
}

// What the sensor makes of a depth.
double measure(double depth, std::int64_t pixel, const SimulationOptions& options) {
  const auto counter = static_cast<std::uint64_t>(pixel);
  const double sigma = options.noise.sigma(depth);
  if (sigma > 0.0) depth += sigma * random_normal(options.seed, counter);
  if (options.quantization > 0.0) depth = std::round(depth / options.quantization) * options.quantization;
  constexpr std::uint64_t dropout_stream = std::uint64_t{1} << 63;
  const bool dropped =
      options.dropout > 0.0 && random_uniform(options.seed, dropout_stream | counter) < options.dropout;
  using Stored = std::numeric_limits<float>;
  return depth >= Stored::denorm_min() && depth <= Stored::max() && !dropped ? depth : nan;
}

}  // namespace

void SimulationOptions::check() const {
  const auto require_length = [](double value, const char* name) {
    require(std::isfinite(value) && value >= 0.0, name, "finite and at least 0", value);
  };
  require_length(noise.constant, "noise.constant");
  require_length(noise.quadratic, "noise.quadratic");
  require(std::isfinite(noise.offset), "noise.offset", "finite", noise.offset);
  require(noise.shared >= 0.0 && noise.shared < 1.0, "noise.shared", "a part from 0 to below 1", noise.shared);
  require(edge_mixing >= 0.0 && edge_mixing <= 16.0, "edge_mixing", "0 to 16 pixels", edge_mixing);
  require_length(background_depth, "background_depth");
  require_length(quantization, "quantization");
  require(dropout >= 0.0 && dropout <= 1.0, "dropout", "0 to 1", dropout);
  require(num_threads >= 0, "num_threads", "at least 0", num_threads);
}

DepthImage simulate_depth(const MeshTree& mesh, const Camera& camera, const Pose& world_from_camera,
                          const SimulationOptions& options) {
  options.check();
  require_rigid(world_from_camera, "world_from_camera");
  const View view(mesh, camera, world_from_camera);
  const Hits hits = cast_pixels(view, options.num_threads);
  Depths depths(hits.size());
  std::transform(hits.begin(), hits.end(), depths.begin(),
                 [](const MeshTree::Hit& hit) { return hit.triangle >= 0 ? hit.distance : nan; });
  if (options.edge_mixing > 0.0) mix_edges(view, mesh, hits, options, depths);

  DepthImage image(camera.height(), camera.width());
  parallel_for(view.num_pixels(), block_size, options.num_threads, [&](std::int64_t i) {
    image.data()[i] = static_cast<float>(measure(depths[static_cast<std::size_t>(i)], i, options));
  });
  return image;
}

}  // namespace nacre
