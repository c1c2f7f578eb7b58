// The model's points as a camera sees them, block by block.
#pragma once

#include "nacre/camera.hpp"
#include "simd/projection.hpp"

namespace nacre {

class PointProjection {
 public:
  static constexpr int capacity = 256;

  // The points of one block.
  struct Block {
    alignas(64) float x[capacity], y[capacity], z[capacity];
    alignas(64) float normal_x[capacity], normal_y[capacity], normal_z[capacity];
    alignas(64) float u[capacity], v[capacity];  // [pixels]; NaN where the point has no projection
    alignas(64) float facing[capacity];          // cosine between the normal and the direction to the camera
    alignas(64) std::int32_t pixel[capacity];    // the nearest of the image; -1 where the point has no projection
    alignas(64) std::int32_t inside[capacity];   // whether the point is in the image

    Eigen::Vector3f point(int i) const { return {x[i], y[i], z[i]}; }
    Eigen::Vector3f normal(int i) const { return {normal_x[i], normal_y[i], normal_z[i]}; }
  };

  PointProjection(const Camera& camera, const Pose& world_from_camera);

  // points and normals: count <= capacity times x, y, z, in the world frame.
  void project(const float* points, const float* normals, int count, Block& block) const;

 private:
  const Camera& camera_;
  simd::View view_;
};

}  // namespace nacre
