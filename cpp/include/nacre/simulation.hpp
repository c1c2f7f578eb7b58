/// A depth camera looking at a triangle mesh.
#pragma once

#include <cstdint>

#include "nacre/camera.hpp"
#include "nacre/depth.hpp"
#include "nacre/mesh.hpp"
#include "nacre/types.hpp"

namespace nacre {

/// Errors of a kind of depth camera, which neighbouring pixels and successive images share. Made for pinhole cameras.
enum class Sensor {
  none,
  stereo,            ///< two infrared cameras, as RealSense D400
  structured_light,  ///< a camera and a projector, as the first Kinect
  time_of_flight,    ///< as the second Kinect and Azure Kinect
  phone_lidar        ///< few points, and an image that is filled in between them, as iPhones give it
};

/// What a simulated camera does to depth.
struct SimulationOptions {
  Sensor sensor = Sensor::none;
  NoiseModel noise;          ///< Gaussian, along the depth value; all zero: none
  double edge_mixing = 0.0;  ///< pixels within this distance of a depth edge see both sides of it [pixels]; 0: none
  double background_depth = 0.0;  ///< what silhouettes mix with [m]; 0: behind the farthest visible point, by a tenth
                                  ///< of the diagonal of the mesh's bounding box
  double quantization = 0.0;      ///< depth is rounded to multiples of this [m]; 0: none
  double dropout = 0.0;           ///< part of the pixels that give no measurement
  std::uint64_t seed = 0;         ///< of an image: the same seed gives the same image for any thread count
  std::uint64_t sensor_seed = 0;  ///< of the errors that all images of one sensor share
  int num_threads = 0;            ///< 0: all

  void check() const;  ///< throws std::invalid_argument naming the field, what was expected and the value
};

/// The depth image [m] that the camera sees, in the camera's depth kind; NaN where a ray hits nothing. Each pixel is
/// exact: the first intersection of its ray with the mesh. Rays start at depth 0, those of an orthographic camera too.
///
/// With edge_mixing, a pixel beside a depth edge (a jump that the surfaces on either side do not explain) is what a
/// finer image gives when it is blurred and sampled down: the mean of rays around it, weighted by a tent of that
/// radius, where a ray that hits nothing sees the background. Pixels that see nothing but background stay NaN; pixels
/// away from edges stay exact. A sensor measures by itself what it sees, instead. Then come noise, quantization and
/// dropout; depths that they make negative or 0 become NaN.
DepthImage simulate_depth(const MeshTree& mesh, const Camera& camera, const Pose& world_from_camera,
                          const SimulationOptions& options = {});

}  // namespace nacre
