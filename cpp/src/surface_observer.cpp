#include "surface_observer.hpp"

#include <algorithm>
#include <cmath>

#include "parallel.hpp"

namespace nacre {

float median_sigma(const Frame& frame) {
  if (frame.valid.empty()) return 0.0F;
  std::vector<float> values;
  values.reserve(frame.valid.size());
  for (const std::int32_t row : frame.valid) values.push_back(frame.sigma[row]);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

SurfaceObserver::SurfaceObserver(const Frame& frame, const Camera& camera, const FusionOptions& options,
                                 const ColorsRef& colors, int num_threads)
    : camera_(camera),
      options_(options),
      colors_(colors),
      width_(frame.width),
      height_(frame.height),
      pixels_(static_cast<std::size_t>(frame.points.rows())),
      cos_max_angle_(static_cast<float>(std::cos(options.max_angle))) {
  const float reference =
      options.reference_sigma > 0.0 ? static_cast<float>(options.reference_sigma) : median_sigma(frame);
  parallel_for(frame.points.rows(), 4096, num_threads, [&](std::int64_t row) {
    const Eigen::Vector3f point = frame.points.row(row).transpose(), normal = frame.normals.row(row).transpose();
    const float ratio = reference / frame.sigma[row];
    const float weight = normal.dot(towards_camera(point)) * ratio * ratio;
    pixels_[static_cast<std::size_t>(row)] = {
        point.x(), point.y(), point.z(), normal.x(), normal.y(), normal.z(), weight > 0.0F ? weight : 0.0F};
  });
}

std::int32_t SurfaceObserver::pixel_of(const Eigen::Vector3f& point) const {
  const Eigen::Vector2d pixel = camera_.project(point.cast<double>());
  if (!(pixel.x() > -0.5 && pixel.y() > -0.5 && pixel.x() < width_ - 0.5 && pixel.y() < height_ - 0.5)) return -1;
  return static_cast<std::int32_t>(pixel.y() + 0.5) * width_ + static_cast<std::int32_t>(pixel.x() + 0.5);
}

Eigen::Vector3f SurfaceObserver::towards_camera(const Eigen::Vector3f& point) const {
  if (camera_.model() == Camera::Model::orthographic) return {0.0F, 0.0F, -1.0F};
  return -point.normalized();
}

float SurfaceObserver::support(float z, float sigma) const {
  if (options_.support > 0.0) return static_cast<float>(options_.support);
  const auto pixel = static_cast<float>(camera_.footprint(z));
  return std::clamp(6.0F * sigma, 3.0F * pixel, static_cast<float>(max_window) * pixel);
}

Observation SurfaceObserver::observe(const Eigen::Vector3f& point, const Eigen::Vector3f& normal, std::int32_t pixel,
                                     float sigma) const {
  const float radius = support(point.z(), sigma);
  const float squared_radius = radius * radius, inverse_squared_radius = 1.0F / squared_radius;
  const float largest_offset = std::max(radius, 4.0F * sigma);
  const int window = std::clamp(static_cast<int>(std::ceil(radius / camera_.footprint(point.z()))), 1, max_window);
  const int u = pixel % width_, v = pixel / width_;
  const int first_u = std::max(0, u - window), last_u = std::min(width_ - 1, u + window);

  Observation sum;
  for (int y = std::max(0, v - window); y <= std::min(height_ - 1, v + window); ++y) {
    const std::size_t line = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_);
    for (int x = first_u; x <= last_u; ++x) {
      const std::size_t row = line + static_cast<std::size_t>(x);
      const Pixel& q = pixels_[row];
      const Eigen::Vector3f difference(q.x - point.x(), q.y - point.y(), q.z - point.z());
      const Eigen::Vector3f q_normal(q.normal_x, q.normal_y, q.normal_z);
      const float along = difference.dot(normal);
      const float across_squared = difference.squaredNorm() - along * along;
      const bool counts = (q.weight > 0.0F) & (across_squared < squared_radius) & (std::abs(along) < largest_offset) &
                          (q_normal.dot(normal) > cos_max_angle_);
      if (!counts) continue;
      const float falloff = 1.0F - across_squared * inverse_squared_radius;
      const float w = q.weight * falloff * falloff;
      sum.weight += w;
      sum.offset += w * 0.5F * (along + q_normal.dot(difference));
      sum.normal += w * q_normal;
      if (has_colors()) sum.color += w * colors_.row(static_cast<Eigen::Index>(row)).transpose().cast<float>();
    }
  }
  if (sum.weight > 0.0F) {
    sum.offset /= sum.weight;
    sum.color /= sum.weight;
  }
  return sum;
}

bool SurfaceObserver::sees_through(const Eigen::Vector3f& point, std::int32_t pixel, float margin) const {
  const int u = pixel % width_, v = pixel / width_;
  if (u < 1 || v < 1 || u + 1 >= width_ || v + 1 >= height_) return false;
  for (int y = v - 1; y <= v + 1; ++y) {
    for (int x = u - 1; x <= u + 1; ++x) {
      const Pixel& q =
          pixels_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)];
      if (!(q.z > point.z() + margin)) return false;
    }
  }
  return true;
}

}  // namespace nacre
