// What a depth frame says about a point of a surface: the symmetric implicit moving-least-squares residual.
#pragma once

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

// The median of the noise over a frame's valid pixels [m]; 0 when there are none.
float median_sigma(const Frame& frame);

// A frame, ready to be asked about points of the camera frame. Keeps references to its arguments.
class SurfaceObserver {
 public:
  SurfaceObserver(const Frame& frame, const Camera& camera, const FusionOptions& options, const ColorsRef& colors,
                  int num_threads);

  bool has_colors() const { return colors_.rows() > 0; }

  // The pixel nearest to the projection of a point, or -1.
  std::int32_t pixel_of(const Eigen::Vector3f& point) const;

  Eigen::Vector3f towards_camera(const Eigen::Vector3f& point) const;

  // offset = sum of w (n_i + n_j) / 2 . (q_j - x_i) / sum of w over the pixels j around `pixel`, where x_i is the
  // point; it vanishes to second order on constant curvature. The weights fall to 0 at the support's radius.
  Observation observe(const Eigen::Vector3f& point, const Eigen::Vector3f& normal, std::int32_t pixel,
                      float sigma) const;

  // Whether every pixel around measures something farther than a margin behind a point.
  bool sees_through(const Eigen::Vector3f& point, std::int32_t pixel, float margin) const;

 private:
  // One pixel in one half of a cache line.
  struct alignas(32) Pixel {
    float x, y, z;
    float normal_x, normal_y, normal_z;
    float weight;  // information relative to a frontal measurement of the reference noise; 0 where there is none
  };

  // Radius of the kernel at a depth: wide enough to average the noise, narrow enough to keep the shape.
  float support(float z, float sigma) const;

  static constexpr int max_window = 4;  // pixels on each side of a point that may observe it

  const Camera& camera_;
  const FusionOptions& options_;
  const ColorsRef& colors_;
  int width_, height_;
  std::vector<Pixel> pixels_;
  float cos_max_angle_;
};

}  // namespace nacre
