// What a depth frame says about points of a surface: the symmetric implicit moving-least-squares residual.
#pragma once

#include <algorithm>
#include <vector>

#include "nacre/fusion.hpp"
#include "simd/fusion_window.hpp"

namespace nacre {

// What the pixels around a surface point say about it.
struct Observation {
  float weight;
  float offset;            // along the point's normal [m]
  Eigen::Vector3f normal;  // not normalised
  Eigen::Vector3f color;   // 0 without colours
};

// Some of the pixels around one.
struct PixelWindow {
  static constexpr int size = 2 * simd::largest_window;
  std::int32_t first_u, first_v;  // may lie outside of the image
  int num_rows;
  std::uint16_t rows[size];  // bit b: the pixel b to the right of first_u
};

// Points of the camera frame to observe together, and then what was observed.
class ObservationBlock {
 public:
  static constexpr int capacity = 256;

  int size() const { return count_; }
  float sigma(int i) const { return sigma_[i]; }  // as given to add
  // Along the viewing ray, as far as takes a point one along its normal.
  Eigen::Vector3f ray(int i) const { return {ray_x_[i], ray_y_[i], ray_z_[i]}; }
  // Which pixels of a point's window show its surface, after observe_and_cover.
  PixelWindow cover(int i) const;
  Observation operator[](int i) const {
    return {weight_[i],
            offset_[i],
            {seen_normal_x_[i], seen_normal_y_[i], seen_normal_z_[i]},
            {red_[i], green_[i], blue_[i]}};
  }

 private:
  friend class SurfaceObserver;
  template <class T>
  using Column = T[capacity];

  int count_ = 0;
  Column<float> x_, y_, z_, normal_x_, normal_y_, normal_z_, ray_x_, ray_y_, ray_z_, sigma_, spacing_, radius_,
      largest_offset_;
  Column<std::int32_t> first_u_, first_v_, window_;  // as of simd::WindowQueries
  Column<float> cover_offset_;
  std::uint16_t cover_rows_[capacity * PixelWindow::size];
  Column<float> weight_, offset_, seen_normal_x_, seen_normal_y_, seen_normal_z_, red_, green_, blue_;
};

// The median of the noise over a frame's valid pixels [m]; 0 when there are none.
float median_sigma(const Frame& frame);

// Frames of a camera, each ready to be asked about points of the camera frame.
class SurfaceObserver {
 public:
  // Keeps references to its arguments.
  SurfaceObserver(const Camera& camera, const FusionOptions& options);

  // What is asked from now on is asked about this frame. colors has a row per pixel, or none.
  void look_at(const Frame& frame, const ColorsRef& colors, int num_threads);

  // Of a pixel: information relative to a frontal measurement of the reference noise.
  float weight(int u, int v) const { return image_.weight[v * image_.stride + u]; }

  bool has_colors() const { return image_.red != nullptr; }
  Eigen::Vector3f color(int u, int v) const {
    const std::int64_t pixel = v * image_.stride + u;
    return {image_.red[pixel], image_.green[pixel], image_.blue[pixel]};
  }

  // The same of a frontal measurement of some noise; sigma 0 stands for the reference.
  float frontal_weight(float sigma) const {
    const float ratio =
        sigma > 0.0F ? std::clamp(reference_sigma_ / sigma, simd::least_sigma_ratio, simd::largest_sigma_ratio) : 1.0F;
    return ratio * ratio;
  }

  // Whether a window around a point can say more than `least_weight` about it; false is certain.
  bool may_observe(const Eigen::Vector3f& point, std::int32_t pixel, float sigma, float least_weight) const;

  Eigen::Vector3f towards_camera(const Eigen::Vector3f& point) const;

  // Adds a point, whose noise is about sigma and whose neighbours are a spacing away, to a block that is not full;
  // pixel is where it projects to.
  void add(ObservationBlock& block, const Eigen::Vector3f& point, const Eigen::Vector3f& normal, std::int32_t pixel,
           float sigma, float spacing = 0.0F) const;
  // offset = sum of w (n_i + n_j) / 2 . (q_j - x_i) / sum of w over the pixels j around each point x_i of the block; it
  // vanishes to second order on constant curvature. The weights fall to 0 at the support's radius.
  void observe(ObservationBlock& block) const;
  // The same, and which pixels show each point's surface: within the spacing along it, the noise across it, and with a
  // normal within an angle of its own.
  void observe_and_cover(ObservationBlock& block, float least_cosine) const;

  // The layout of a plane of values, one a pixel: its size, and where a pixel is. Its borders are zeros.
  std::int64_t plane_size() const { return (height_ + 2 * simd::largest_window) * image_.stride; }
  std::int64_t plane_offset(int u, int v) const {
    return (v + simd::largest_window) * image_.stride + simd::largest_window + u;
  }
  // The weighted averages of three planes, one after the other, around the points i of the block, at
  // average[c * capacity + i].
  void observe_planes(ObservationBlock& block, const float* planes, float* average) const;

  // Whether every pixel around measures something farther than a margin behind a point.
  bool sees_through(const Eigen::Vector3f& point, std::int32_t pixel, float margin) const;

 private:
  void observe(ObservationBlock& block, const simd::SurfaceImage& image, float* const channels[3],
               const simd::WindowCover* cover) const;
  // Radius of the kernel at a depth: wide enough to average the noise, narrow enough to keep the shape.
  float support(float sigma, float footprint) const;

  const Camera& camera_;
  const FusionOptions& options_;
  int width_, height_;
  // What the windows around the pixels of a tile may see.
  struct Tile {
    float nearest, farthest;  // depth [m]
    float largest_weight;
  };
  static constexpr int tile_size = 16;  // [pixels]
  void summarise(int num_threads);

  int tiles_across_;
  std::vector<float> planes_;
  simd::SurfaceImage image_ = {};
  std::vector<Tile> tiles_;
  float least_cosine_;
  float reference_sigma_ = 0.0F;
};

}  // namespace nacre
