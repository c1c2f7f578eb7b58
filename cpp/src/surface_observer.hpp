// What a depth frame says about a point of a surface: the symmetric implicit moving-least-squares residual.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "nacre/fusion.hpp"

namespace nacre {

// What the pixels around a surface point say about it.
struct Observation {
  float weight = 0.0F;
  float offset = 0.0F;  // along the point's normal [m]
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  Eigen::Vector3f color = Eigen::Vector3f::Zero();
};

// A frame, ready to be asked about points of the camera frame.
class SurfaceObserver {
 public:
  SurfaceObserver(const Frame& frame, const Camera& camera, const FusionOptions& options, const ColorsRef& colors)
      : frame_(frame), camera_(camera), options_(options), colors_(colors) {
    reference_sigma_ = static_cast<float>(options.reference_sigma);
    if (!(reference_sigma_ > 0.0F)) {
      std::vector<float> sigma;
      for (const std::int32_t row : frame.valid) sigma.push_back(frame.sigma[row]);
      const auto middle = sigma.begin() + static_cast<std::ptrdiff_t>(sigma.size() / 2);
      if (!sigma.empty()) {
        std::nth_element(sigma.begin(), middle, sigma.end());
        reference_sigma_ = *middle;
      }
    }
    cos_max_angle_ = static_cast<float>(std::cos(options.max_angle));
  }

  bool has_colors() const { return colors_.rows() > 0; }

  // The pixel nearest to the projection of a point, or -1.
  std::int32_t pixel_of(const Eigen::Vector3f& point) const {
    const Eigen::Vector2d pixel = camera_.project(point.cast<double>());
    if (!(pixel.x() > -0.5 && pixel.y() > -0.5 && pixel.x() < frame_.width - 0.5 && pixel.y() < frame_.height - 0.5)) {
      return -1;
    }
    return static_cast<std::int32_t>(pixel.y() + 0.5) * frame_.width + static_cast<std::int32_t>(pixel.x() + 0.5);
  }

  Eigen::Vector3f towards_camera(const Eigen::Vector3f& point) const {
    if (camera_.model() == Camera::Model::orthographic) return {0.0F, 0.0F, -1.0F};
    return -point.normalized();
  }

  // Radius of the kernel at a depth: wide enough to average the noise, narrow enough to keep the shape.
  float support(float z, float sigma) const {
    if (options_.support > 0.0) return static_cast<float>(options_.support);
    const auto pixel = static_cast<float>(camera_.footprint(z));
    return std::clamp(5.0F * sigma, 2.5F * pixel, static_cast<float>(max_window) * pixel);
  }

  // The residual of the symmetric implicit moving-least-squares surface:
  // offset = sum of w (n_i + n_j) / 2 . (q_j - x_i) / sum of w; it vanishes to second order on constant curvature.
  Observation observe(const Eigen::Vector3f& point, const Eigen::Vector3f& normal, std::int32_t pixel,
                      float sigma) const {
    Observation sum;
    const float radius = support(point.z(), sigma);
    const float inverse_variance = 4.0F / (radius * radius);  // the kernel's standard deviation is half its radius
    const float largest_offset = std::max(radius, 4.0F * sigma);
    const int window = std::clamp(static_cast<int>(std::ceil(radius / camera_.footprint(point.z()))), 1, max_window);
    const int u = pixel % frame_.width, v = pixel / frame_.width;
    for (int y = std::max(0, v - window); y <= std::min(frame_.height - 1, v + window); ++y) {
      for (int x = std::max(0, u - window); x <= std::min(frame_.width - 1, u + window); ++x) {
        const Eigen::Index row = static_cast<Eigen::Index>(y) * frame_.width + x;
        const Eigen::Vector3f q = frame_.points.row(row).transpose();
        const Eigen::Vector3f q_normal = frame_.normals.row(row).transpose();
        const Eigen::Vector3f difference = q - point;
        const float along = difference.dot(normal);
        const float across_squared = difference.squaredNorm() - along * along;
        // Written so that NaN fails.
        if (!(across_squared < radius * radius && std::abs(along) < largest_offset &&
              q_normal.dot(normal) > cos_max_angle_)) {
          continue;
        }
        const float w = weight_of(row, q, q_normal) * std::exp(-0.5F * across_squared * inverse_variance);
        sum.weight += w;
        sum.offset += w * 0.5F * (normal + q_normal).dot(difference);
        sum.normal += w * q_normal;
        if (has_colors()) sum.color += w * colors_.row(row).transpose().cast<float>();
      }
    }
    if (sum.weight > 0.0F) {
      sum.offset /= sum.weight;
      sum.color /= sum.weight;
    }
    return sum;
  }

  // Whether every pixel around measures something behind a point.
  bool sees_through(const Eigen::Vector3f& point, std::int32_t pixel, float margin) const {
    const int u = pixel % frame_.width, v = pixel / frame_.width;
    if (u < 1 || v < 1 || u + 1 >= frame_.width || v + 1 >= frame_.height) return false;
    for (int y = v - 1; y <= v + 1; ++y) {
      for (int x = u - 1; x <= u + 1; ++x) {
        const float z = frame_.points(static_cast<Eigen::Index>(y) * frame_.width + x, 2);
        if (!(z > point.z() + margin)) return false;
      }
    }
    return true;
  }

  // An observation counts by its information, and less when it is oblique.
  float weight_of(Eigen::Index row, const Eigen::Vector3f& point, const Eigen::Vector3f& normal) const {
    const float ratio = reference_sigma_ / frame_.sigma[row];
    return std::max(0.0F, normal.dot(towards_camera(point))) * ratio * ratio;
  }

 private:
  static constexpr int max_window = 4;  // pixels on each side of a point that may observe it

  const Frame& frame_;
  const Camera& camera_;
  const FusionOptions& options_;
  const ColorsRef& colors_;
  float reference_sigma_ = 1.0F, cos_max_angle_ = 0.5F;
};

}  // namespace nacre
