// A z-buffer of disks. Rows of the picture are independent blocks, and the disks of each row come in one order, so that
// the picture does not depend on the number of threads.
#include "nacre/rendering.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/check.hpp"
#include "base/numbers.hpp"
#include "base/parallel.hpp"
#include "simulation/box_sums.hpp"
#include "simulation/limits.hpp"

namespace nacre {

namespace {

using Eigen::Array4f;
using Eigen::Vector3f;
using std::int64_t;

constexpr int band_rows = 16;
constexpr int points_per_block = 4096;

struct Disk {
  std::int32_t row = -1, column = 0;   // of its center, in the picture with a border of max_radius
  float depth = 0.0f;                  // [pixels]
  float radius = 0.0f;                 // [pixels]
  Vector3f normal = Vector3f::Zero();  // right, down, away along the ray
  Vector3f color = Vector3f::Zero();

  bool is_reverse() const { return normal.z() > 0.0f; }
};

struct Pixel {
  float depth = infinity<float>;
  float weight = 0.0f;
  bool reverse = false;
  Vector3f normal = Vector3f::Zero();
  Vector3f color = Vector3f::Zero();

  bool is_covered() const { return weight > 0.0f; }
};

// In a perspective, depth is the logarithm of the distance, so that disks have the picture's scale at any depth.
Disk project(const PictureView& view, const Eigen::Vector3d& point, const Vector3f& normal, float radius) {
  const Eigen::Vector3d local = view.view_from_model * (point - view.center);
  const bool parallel = std::isinf(view.distance);
  const double ratio = parallel ? 1.0 : 1.0 + local.z() / view.distance;
  const double scale = view.metres_per_pixel * ratio;
  const double depth =
      parallel ? local.z() / scale : view.distance / view.metres_per_pixel * std::log(std::max(ratio, 1e-3));
  const double column = std::floor(local.x() / scale + view.width / 2.0) + simulation_limits::max_radius;
  const double row = std::floor(local.y() / scale + view.height / 2.0) + simulation_limits::max_radius;

  Disk disk;
  const bool inside = ratio > 1e-3 && column >= 0 && column < view.width + 2 * simulation_limits::max_radius &&
                      row >= 0 && row < view.height + 2 * simulation_limits::max_radius &&
                      std::abs(depth) < simulation_limits::max_depth;
  if (!inside) return disk;
  disk.row = static_cast<std::int32_t>(row);
  disk.column = static_cast<std::int32_t>(column);
  disk.depth = static_cast<float>(depth);

  Eigen::Vector3d facing = view.view_from_model * normal.cast<double>();
  if (!parallel) facing.z() += facing.head<2>().dot(local.head<2>()) / (local.z() + view.distance);
  const double length = facing.norm();
  disk.normal =
      length > 0.0 && std::isfinite(length) ? Vector3f((facing / length).cast<float>()) : Vector3f(0.0f, 0.0f, -1.0f);
  const float wanted =
      (disk.is_reverse() ? simulation_limits::reverse_radius : 1.0f) * static_cast<float>(radius / scale);
  disk.radius =
      std::min(std::max(simulation_limits::min_radius, wanted), static_cast<float>(simulation_limits::max_radius));
  return disk;
}

std::vector<Disk> project_all(const PointsDoubleRef& points, const PointsRef& normals, const ValuesRef& radii,
                              const PictureView& view, bool hide_reverse, int num_threads) {
  std::vector<Disk> disks(static_cast<std::size_t>(points.rows()));
  parallel_for(points.rows(), points_per_block, num_threads, [&](int64_t i) {
    Disk disk = project(view, points.row(i), normals.row(i), radii(i));
    if (hide_reverse && disk.is_reverse()) disk.row = -1;
    disks[static_cast<std::size_t>(i)] = disk;
  });
  return disks;
}

// The nearest disk of each pixel, row after row; row r has those from row_begin[r] to row_begin[r + 1].
struct DiskRows {
  std::vector<Disk> disks;
  std::vector<std::size_t> row_begin;
};

DiskRows nearest_per_pixel(const std::vector<Disk>& all, const ColorsRef& colors, const PictureView& view) {
  const int64_t width = view.width + 2 * simulation_limits::max_radius,
                height = view.height + 2 * simulation_limits::max_radius;
  std::vector<std::int32_t> nearest(static_cast<std::size_t>(width * height), -1);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].row < 0) continue;
    std::int32_t& best = nearest[static_cast<std::size_t>(all[i].row * width + all[i].column)];
    if (best < 0 || all[i].depth <= all[static_cast<std::size_t>(best)].depth) best = static_cast<std::int32_t>(i);
  }
  DiskRows rows;
  rows.row_begin.reserve(static_cast<std::size_t>(height) + 1);
  for (int64_t pixel = 0; pixel < width * height; ++pixel) {
    if (pixel % width == 0) rows.row_begin.push_back(rows.disks.size());
    const std::int32_t i = nearest[static_cast<std::size_t>(pixel)];
    if (i < 0) continue;
    rows.disks.push_back(all[static_cast<std::size_t>(i)]);
    if (colors.rows() > 0) rows.disks.back().color = colors.row(i).cast<float>() / 255.0f;
  }
  rows.row_begin.push_back(rows.disks.size());
  return rows;
}

class Canvas {
 public:
  Canvas(const PictureView& view, int num_threads)
      : width_(view.width),
        height_(view.height),
        num_threads_(num_threads),
        pixels_(static_cast<std::size_t>(width_ * height_)) {}

  void draw(const DiskRows& rows) {
    parallel_blocks(height_, band_rows, num_threads_, [&](int64_t, int64_t begin, int64_t end) {
      for_disks(rows, begin, end, [&](const Disk& disk) { draw_depth(disk, begin, end); });
      for_disks(rows, begin, end, [&](const Disk& disk) { blend(disk, begin, end); });
    });
  }

  Picture shaded(bool has_colors) const {
    const std::vector<float> cavity = cavities();
    std::vector<Array4f> colors(pixels_.size());
    parallel_for(size(), points_per_block, num_threads_, [&](int64_t i) {
      const auto at = static_cast<std::size_t>(i);
      colors[at] = pixels_[at].is_covered() ? color_of(pixels_[at], cavity[at], has_colors) : Array4f::Zero();
    });
    Picture picture(size(), 4);
    parallel_for(height_, band_rows, num_threads_, [&](int64_t v) {
      for (int64_t u = 0; u < width_; ++u) {
        Array4f color = is_outline(u, v) ? blurred(colors, u, v) : colors[index(u, v)];
        if (color[3] > 0.0f) color.head<3>() /= color[3];
        picture.row(v * width_ + u) = (255.0f * color.min(1.0f) + 0.5f).cast<std::uint8_t>();
      }
    });
    return picture;
  }

 private:
  int64_t size() const { return width_ * height_; }
  std::size_t index(int64_t u, int64_t v) const { return static_cast<std::size_t>(v * width_ + u); }
  const Pixel& clamped(int64_t u, int64_t v) const {
    return pixels_[index(std::clamp<int64_t>(u, 0, width_ - 1), std::clamp<int64_t>(v, 0, height_ - 1))];
  }

  // body(disk) for each disk that may reach the rows [begin, end).
  template <class Body>
  static void for_disks(const DiskRows& rows, int64_t begin, int64_t end, Body&& body) {
    const std::size_t first = rows.row_begin[static_cast<std::size_t>(begin)];
    const std::size_t last = rows.row_begin[static_cast<std::size_t>(end + 2 * simulation_limits::max_radius)];
    for (std::size_t i = first; i < last; ++i) body(rows.disks[i]);
  }

  // body(pixel, depth, squared distance from the center in radii) for each pixel of a disk in the rows [begin, end).
  template <class Body>
  void for_pixels(const Disk& disk, int64_t begin, int64_t end, Body&& body) {
    const auto reach = static_cast<int64_t>(disk.radius);
    const int64_t row = disk.row - simulation_limits::max_radius, column = disk.column - simulation_limits::max_radius;
    const float tilt = disk.is_reverse() ? std::max(disk.normal.z(), simulation_limits::least_tilt)
                                         : std::min(disk.normal.z(), -simulation_limits::least_tilt);
    const float slope_x = -disk.normal.x() / tilt, slope_y = -disk.normal.y() / tilt;
    const float squared_radius = disk.radius * disk.radius, per_square = 1.0f / squared_radius;
    const float a = 1.0f + slope_x * slope_x;
    for (int64_t v = std::max(begin, row - reach); v <= std::min(end - 1, row + reach); ++v) {
      // Inside are the dx between the roots of dx^2 + dy^2 + rise^2 = radius^2.
      const auto dy = static_cast<float>(v - row);
      const float b = slope_x * slope_y * dy, c = (1.0f + slope_y * slope_y) * dy * dy - squared_radius;
      const float discriminant = b * b - a * c;
      if (discriminant < 0.0f) continue;
      const float half_width = std::sqrt(discriminant) / a, middle = static_cast<float>(column) - b / a;
      const auto first = std::max<int64_t>(0, static_cast<int64_t>(std::ceil(middle - half_width)));
      const auto last = std::min(width_ - 1, static_cast<int64_t>(std::floor(middle + half_width)));
      for (int64_t u = first; u <= last; ++u) {
        const auto dx = static_cast<float>(u - column);
        const float rise = slope_x * dx + slope_y * dy;
        body(pixels_[index(u, v)], disk.depth + rise, (dx * dx + dy * dy + rise * rise) * per_square);
      }
    }
  }

  void draw_depth(const Disk& disk, int64_t begin, int64_t end) {
    for_pixels(disk, begin, end, [&](Pixel& pixel, float depth, float) {
      if (!(depth < pixel.depth)) return;
      pixel.depth = depth;
      pixel.reverse = disk.is_reverse();
    });
  }

  // Adds a disk where it lies at the drawn surface; its weight falls towards its rim.
  void blend(const Disk& disk, int64_t begin, int64_t end) {
    for_pixels(disk, begin, end, [&](Pixel& pixel, float depth, float squared) {
      if (depth > pixel.depth + disk.radius + 0.5f || disk.is_reverse() != pixel.reverse) return;
      const float inner = 1.0f - squared, weight = inner * inner * inner + 0.02f;
      pixel.weight += weight;
      pixel.normal += weight * disk.normal;
      pixel.color += weight * disk.color;
    });
  }

  // Multiplied by its opacity.
  static Array4f color_of(const Pixel& pixel, float cavity, bool has_colors) {
    static const Vector3f front(0.95f, 0.925f, 0.885f), reverse(0.72f, 0.52f, 0.38f);
    static const Vector3f key_light(-0.55f, -0.65f, -0.52f);  // towards the light: from the upper left, in front
    const float length = pixel.normal.norm();
    const Vector3f normal = length > 0.0f ? Vector3f(pixel.normal / length) : Vector3f::Zero();
    const float toward = -normal.z(), side = toward < 0.0f ? -1.0f : 1.0f;
    const float lambert = 0.8f * std::abs(toward) + 0.2f * std::max(side * normal.dot(key_light), 0.0f);
    const float brown = std::clamp(-4.0f * toward - 0.6f, 0.0f, 1.0f);
    const Vector3f base =
        has_colors ? Vector3f(pixel.color / pixel.weight) : Vector3f((1.0f - brown) * front + brown * reverse);
    const float shade = has_colors ? 0.55f + 0.45f * lambert : 0.22f + 0.78f * lambert;
    const Vector3f lit = (shade * cavity * base).array().max(0.0f).min(1.0f);
    return {lit.x(), lit.y(), lit.z(), 1.0f};
  }

  // Each pixel's brightness by its depth against its surroundings (Luft et al. 2006), a small and a large one.
  std::vector<float> cavities() const {
    std::vector<float> factor(pixels_.size(), 1.0f);
    const int64_t reach = std::max<int64_t>(std::min(width_, height_) / 60, 2);
    for (const auto& [radius, strength] : {std::pair<int64_t, double>{reach, 0.30}, {3 * reach, 0.25}}) {
      PixelSums sums(pixels_.size(), PixelSum::Zero());
      for (std::size_t i = 0; i < pixels_.size(); ++i) {
        if (pixels_[i].is_covered()) sums[i] = PixelSum(pixels_[i].depth, 1.0);
      }
      sum_boxes(sums, width_, radius, num_threads_);
      sum_boxes(sums, width_, radius, num_threads_);  // two boxes make a tent, which leaves no visible border
      parallel_for(size(), points_per_block, num_threads_, [&, r = radius, s = strength](int64_t i) {
        const auto at = static_cast<std::size_t>(i);
        if (!pixels_[at].is_covered()) return;
        const double behind = (pixels_[at].depth - sums[at][0] / sums[at][1]) / static_cast<double>(r);
        factor[at] *= static_cast<float>(1.0 - s * std::tanh(std::max(behind, -0.3)));
      });
    }
    return factor;
  }

  // Whether depth jumps to a neighbor.
  bool is_outline(int64_t u, int64_t v) const {
    const Pixel& pixel = pixels_[index(u, v)];
    const auto differs = [&](const Pixel& other) {
      if (pixel.is_covered() != other.is_covered()) return true;
      return pixel.is_covered() && std::abs(other.depth - pixel.depth) > simulation_limits::outline_step;
    };
    return differs(clamped(u - 1, v)) || differs(clamped(u + 1, v)) || differs(clamped(u, v - 1)) ||
           differs(clamped(u, v + 1));
  }

  Array4f blurred(const std::vector<Array4f>& colors, int64_t u, int64_t v) const {
    constexpr float kernel[] = {0.25f, 0.5f, 0.25f};
    Array4f sum = Array4f::Zero();
    for (int64_t dv = -1; dv <= 1; ++dv) {
      for (int64_t du = -1; du <= 1; ++du) {
        const auto at = static_cast<std::size_t>(&clamped(u + du, v + dv) - pixels_.data());
        sum += kernel[dv + 1] * kernel[du + 1] * colors[at];
      }
    }
    return sum;
  }

  int64_t width_, height_;
  int num_threads_;
  std::vector<Pixel> pixels_;
};

}  // namespace

Picture render_points(const PointsDoubleRef& points, const PointsRef& normals, const ColorsRef& colors,
                      const ValuesRef& radii, const PictureView& view, bool hide_reverse, int num_threads) {
  require(normals.rows() == points.rows(), "normals", "one row per point", normals.rows());
  require(colors.rows() == points.rows() || colors.rows() == 0, "colors", "one row per point, or none", colors.rows());
  require(radii.rows() == points.rows(), "radii", "one per point", radii.rows());
  require(view.width > 0, "width", "positive", view.width);
  require(view.height > 0, "height", "positive", view.height);
  require(view.metres_per_pixel > 0.0, "metres_per_pixel", "positive", view.metres_per_pixel);
  require(view.distance > 0.0, "distance", "positive", view.distance);
  Canvas canvas(view, num_threads);
  canvas.draw(nearest_per_pixel(project_all(points, normals, radii, view, hide_reverse, num_threads), colors, view));
  return canvas.shaded(colors.rows() > 0);
}

}  // namespace nacre
