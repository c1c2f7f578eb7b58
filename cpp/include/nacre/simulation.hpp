/// A depth camera looking at a triangle mesh.
#pragma once

#include <cstdint>

#include "nacre/camera.hpp"
#include "nacre/depth.hpp"
#include "nacre/mesh.hpp"
#include "nacre/types.hpp"

namespace nacre {

struct SimulationOptions {
  NoiseModel noise;               ///< Gaussian, along the depth value; all zero: none
  double edge_mixing = 0.0;       ///< width of the blur that mixes depths across edges [pixels]; 0: none. The image is
                                  ///< rendered finer, blurred and sampled down, as the paper did
  double background_depth = 0.0;  ///< what silhouettes mix with [m]; 0: a little behind the farthest visible point
  double quantization = 0.0;      ///< depth is rounded to multiples of this [m]; 0: none
  double dropout = 0.0;           ///< part of the pixels that give no measurement
  std::uint64_t seed = 0;         ///< of noise and dropout: the same seed gives the same image for any thread count
  int num_threads = 0;            ///< 0: all

  void check() const;  ///< throws std::invalid_argument naming the field, what was expected and the value
};

/// The depth image [m] that the camera sees, in the camera's depth kind; NaN where a ray hits nothing. Without noise
/// and mixing each pixel is exact: the first intersection of its ray with the mesh.
DepthImage simulate_depth(const MeshTree& mesh, const Camera& camera, const Pose& world_from_camera,
                          const SimulationOptions& options = {});

}  // namespace nacre
