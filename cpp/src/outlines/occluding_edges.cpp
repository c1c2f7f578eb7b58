#include "outlines/occluding_edges.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "base/limits.hpp"
#include "base/linear_algebra.hpp"
#include "base/parallel.hpp"
#include "camera/limits.hpp"
#include "outlines/limits.hpp"

namespace nacre {
namespace {

class OutlineSearch {
 public:
  OutlineSearch(const DepthView& sight, const Camera& camera)
      : sight_(sight),
        camera_(camera),
        measured_(sight.measured.size() > 0 ? sight.measured : sight.depth),
        width_(camera.width()),
        height_(camera.height()),
        gap_(std::max(outlines_limits::window_radius + 2, std::max(width_, height_) / 16)) {}

  // Whether beside a pixel nothing was measured, or something farther.
  bool is_candidate(int u, int v) const {
    const double z = depth(u, v);
    if (!std::isfinite(z) || u < gap_ || v < gap_ || u + gap_ >= width_ || v + gap_ >= height_) return false;
    const double step = z + tolerance(u, v, 1.0);
    const auto ends = [&](int x, int y) { return !(depth(x, y) <= step); };
    return ends(u - 1, v) || ends(u + 1, v) || ends(u, v - 1) || ends(u, v + 1);
  }

  std::optional<OutlinePoint> look(int u, int v) const {
    // The pixels of the same surface: each point an affine function of the pixel.
    const double z = depth(u, v);
    constexpr int side = 2 * outlines_limits::window_radius + 1;
    Eigen::Vector3d points[side * side];
    Eigen::Vector2d pixels[side * side];
    int count = 0, inside = 0;
    Eigen::Vector2d offset = Eigen::Vector2d::Zero();
    for (int y = -outlines_limits::window_radius; y <= outlines_limits::window_radius; ++y) {
      for (int x = -outlines_limits::window_radius; x <= outlines_limits::window_radius; ++x) {
        if (x * x + y * y > outlines_limits::window_radius * outlines_limits::window_radius + 1) continue;
        ++inside;
        const double distance = std::sqrt(static_cast<double>(x * x + y * y));
        if (!(std::abs(depth(u + x, v + y) - z) <= tolerance(u, v, distance))) continue;
        points[count] = unproject(camera_, u + x, v + y, depth(u + x, v + y));
        pixels[count] = Eigen::Vector2d(x, y);
        offset += pixels[count++];
      }
    }
    if (count < outlines_limits::least_filled * inside) return std::nullopt;
    offset /= count;
    const double length = offset.norm();
    if (length < outlines_limits::least_offset * outlines_limits::window_radius ||
        length > outlines_limits::most_offset * outlines_limits::window_radius)
      return std::nullopt;
    const Eigen::Vector2d inward = offset / length;

    Eigen::Matrix4d products = Eigen::Matrix4d::Zero();
    Eigen::Matrix<double, 4, 3> sums = Eigen::Matrix<double, 4, 3>::Zero();
    for (int i = 0; i < count; ++i) {
      const double depth_in = inward.dot(pixels[i]);
      const Eigen::Vector4d row(1.0, pixels[i].x(), pixels[i].y(), depth_in * depth_in);
      products += row * row.transpose();
      sums += row * points[i].transpose();
    }
    const Eigen::Matrix3d plane = solve_symmetric_columns(products.topLeftCorner<3, 3>(), sums.topRows<3>());
    const Eigen::Vector3d origin = plane.row(0), across = plane.row(1), down = plane.row(2);
    OutlinePoint found;
    found.point = origin;
    found.normal = across.cross(down).normalized();
    const Eigen::Vector3d sight_line =
        camera_.model() == Camera::Model::orthographic ? Eigen::Vector3d::UnitZ() : origin.normalized();
    if (found.normal.dot(sight_line) > 0.0) found.normal = -found.normal;
    if (!(-found.normal.dot(sight_line) > static_cast<double>(camera_limits::least_facing))) return std::nullopt;
    const Eigen::Vector3d along = across * -inward.y() + down * inward.x();
    found.outward = along.cross(found.normal).normalized();
    const Eigen::Vector3d outwards = -(across * inward.x() + down * inward.y());
    if (found.outward.dot(outwards) < 0.0) found.outward = -found.outward;
    found.pixel = found.outward.dot(outwards);

    // Whether the surface bends towards its outline.
    const Eigen::Matrix4d inverse = solve_symmetric_columns(products, Eigen::Matrix4d::Identity());
    const Eigen::Vector3d bend = (inverse * sums).row(3);
    const double half = 0.25 * outlines_limits::window_radius * outlines_limits::window_radius,
                 sigma = static_cast<double>(sight_.sigma[v * width_ + u]);
    const double sag = std::abs(bend.dot(found.normal)) * half;
    const double by_noise = outlines_limits::sag_sigmas * sigma * std::sqrt(inverse(3, 3)) * half;
    if (sag > std::max(0.5 * camera_.footprint(z), by_noise)) return std::nullopt;

    // What begins beyond it.
    for (int step = 1; step <= gap_; ++step) {
      const int x = static_cast<int>(std::lround(-inward.x() * step)),
                y = static_cast<int>(std::lround(-inward.y() * step));
      const double behind = depth(u + x, v + y) - (origin + across * x + down * y).z();
      if (!std::isfinite(behind)) continue;
      if (step <= 2 && std::abs(behind) < tolerance(u, v, 0.0)) continue;
      if (!(behind > tolerance(u, v, 1.0))) return std::nullopt;
      break;
    }
    const std::optional<double> end = surface_end(u, v, origin, across, down, -inward);
    if (!end) return std::nullopt;
    found.point += *end * outwards;
    return found;
  }

 private:
  // How far from a pixel, along a direction of the image, a flat surface ends [pixels]: half way from the last pixel
  // that sees it to the first that sees something else or nothing. Pixels between them see both sides of the edge, if
  // they are not too many: others see a side of the same body at a grazing angle. None where the surface goes on.
  std::optional<double> surface_end(int u, int v, const Eigen::Vector3d& origin, const Eigen::Vector3d& across,
                                    const Eigen::Vector3d& down, const Eigen::Vector2d& direction) const {
    const double off = base_limits::noise_sigmas * static_cast<double>(sight_.sigma[v * width_ + u]) +
                       0.5 * camera_.footprint(depth(u, v));
    double last = 0.0;
    for (double at = 0.5 * outlines_limits::smear_step; at < gap_; at += outlines_limits::smear_step) {
      const int x = static_cast<int>(std::lround(direction.x() * at)),
                y = static_cast<int>(std::lround(direction.y() * at));
      const double z = measured(u + x, v + y);
      if (std::isfinite(z) && std::abs(z - (origin + across * x + down * y).z()) < off) {
        last = at;
        continue;
      }
      // The same surface as its neighbour's on the far side?
      const int next_x = static_cast<int>(std::lround(direction.x() * (at + 1.0))),
                next_y = static_cast<int>(std::lround(direction.y() * (at + 1.0)));
      const double next = measured(u + next_x, v + next_y);
      const bool is_other = !std::isfinite(z) || (std::isfinite(next) && std::abs(next - z) < tolerance(u, v, 1.0));
      if (is_other) return last + 0.5 * std::min(at - last, outlines_limits::most_smeared);
    }
    return std::nullopt;
  }

  double measured(int u, int v) const {
    const double z = static_cast<double>(measured_[v * width_ + u]);
    return z > 0.0 ? z : std::numeric_limits<double>::quiet_NaN();
  }
  double depth(int u, int v) const { return static_cast<double>(sight_.depth[v * width_ + u]); }
  double tolerance(int u, int v, double distance) const {
    return camera_limits::steepest * camera_.footprint(depth(u, v)) * distance +
           base_limits::noise_sigmas * static_cast<double>(sight_.sigma[v * width_ + u]);
  }

  const DepthView& sight_;
  const Camera& camera_;
  const Values& measured_;
  int width_, height_;
  int gap_;  // across which something is looked for [pixels]
};

}  // namespace

bool is_cut_off(const Values& depth, const Camera& camera) {
  const int width = camera.width(), height = camera.height();
  int count = 0;
  const auto look = [&](int u, int v) { count += static_cast<int>(std::isfinite(depth[v * width + u])); };
  for (int u = 0; u < width; ++u) {
    look(u, outlines_limits::border_pixels);
    look(u, height - 1 - outlines_limits::border_pixels);
  }
  for (int v = 0; v < height; ++v) {
    look(outlines_limits::border_pixels, v);
    look(width - 1 - outlines_limits::border_pixels, v);
  }
  return 10 * count > 2 * (width + height);
}

Eigen::Vector3d unproject(const Camera& camera, int u, int v, double z) {
  const Ray ray = camera.ray(u, v);
  const double scale = z / static_cast<double>(ray.direction_z);
  return {static_cast<double>(ray.origin_x) + scale * static_cast<double>(ray.direction_x),
          static_cast<double>(ray.origin_y) + scale * static_cast<double>(ray.direction_y), z};
}

std::vector<OutlinePoint> find_outline(const DepthView& sight, const Camera& camera, std::size_t most,
                                       int num_threads) {
  std::vector<OutlinePoint> outline;
  if (sight.depth.size() == 0) return outline;
  const OutlineSearch search(sight, camera);
  std::vector<std::vector<int>> rows(static_cast<std::size_t>(camera.height()));
  parallel_for(camera.height(), 8, num_threads, [&](std::int64_t v) {
    for (int u = 0; u < camera.width(); ++u) {
      if (search.is_candidate(u, static_cast<int>(v))) rows[static_cast<std::size_t>(v)].push_back(u);
    }
  });
  std::vector<std::pair<int, int>> pixels;
  for (std::size_t v = 0; v < rows.size(); ++v) {
    for (const int u : rows[v]) pixels.emplace_back(u, static_cast<int>(v));
  }
  const std::size_t step = (pixels.size() + most - 1) / most;
  std::vector<std::optional<OutlinePoint>> found(step > 0 ? pixels.size() / step : 0);
  parallel_for(static_cast<std::int64_t>(found.size()), 64, num_threads, [&](std::int64_t i) {
    const auto& pixel = pixels[static_cast<std::size_t>(i) * step];
    found[static_cast<std::size_t>(i)] = search.look(pixel.first, pixel.second);
  });
  for (const auto& point : found) {
    if (point) outline.push_back(*point);
  }
  return outline;
}

}  // namespace nacre
