/// Fusion of a registered depth frame into a point model, weighted by confidence.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nacre/camera.hpp"
#include "nacre/depth.hpp"
#include "nacre/types.hpp"

namespace nacre {

/// Values of a frame's pixels that are fused along with its points: an intensity, a temperature, class probabilities.
struct FrameAttribute {
  std::string name;
  Attributes values;  ///< height * width rows, row by row, one column a channel; values that are not finite are none
};

/// The same of a model's points.
struct PointAttribute {
  std::string name;
  int num_channels = 1;
  std::vector<float> values;  ///< num_channels for each point, NaN where never seen
};

/// A growing set of oriented points, one array an attribute; all arrays have the same length.
struct PointModel {
  std::vector<Eigen::Vector3f> points;   ///< world frame [m]
  std::vector<Eigen::Vector3f> normals;  ///< unit length, towards the cameras that saw the point
  std::vector<Eigen::Vector3f>
      colors;  ///< red green blue, 0 to 255, NaN where never seen; empty when no frame had colour
  std::vector<PointAttribute> attributes;  ///< those that any frame had, in the order in which they came
  std::vector<float> confidence;           ///< frontal observations that the point stands for
  std::vector<std::int32_t> last_seen;     ///< frame that last observed the point
  std::vector<std::uint8_t> observations;  ///< frames that observed the point, at most 255
  std::vector<std::uint8_t>
      free_space_violations;  ///< how often a camera saw through the point since it was last observed;
                              ///< of a point with few observations: how often one looked and did not find it

  std::int64_t size() const { return static_cast<std::int64_t>(points.size()); }
  /// Keeps the points whose flag is not 0, in order.
  void keep(const std::vector<std::uint8_t>& flags);
};

/// How fuse works.
struct FusionOptions {
  double support = 0.0;  ///< observations farther from a model point do not move it [m]; 0: from noise and pixels
  double max_angle = 1.0471976;       ///< nor do those whose normal differs more [rad]; 60 degrees
  double max_confidence = 1e6;        ///< a lower bound on the weight of new observations, for objects that change
  int min_observations = 3;           ///< a point that fewer frames observed is not confirmed
  int max_free_space_violations = 3;  ///< a point that was seen through so often goes; an unconfirmed one also where
                                      ///< cameras looked so often and did not find it
  double reference_sigma = 0.0;       ///< noise of an observation of weight 1 [m]; 0: the frame's median

  void check() const;  ///< throws std::invalid_argument naming the field, what was expected and the value
};

/// How many points of the model a frame changed.
struct FusionReport {
  std::int64_t num_updated = 0;
  std::int64_t num_inserted = 0;
  std::int64_t num_removed = 0;
};

/// Fuses a frame: model points that the camera observes move along their normals by the symmetric implicit
/// moving-least-squares residual; surface that the model lacks is inserted at the given spacing, but no denser than a
/// pixel and a half of the frame; points that the camera sees through, or that were never confirmed, are removed.
/// colors is empty or has a row per pixel; the frame has the camera's size. Colours and attributes are averaged with
/// the weights of the points, colours in the mean exposure of the frames 0 to frame_index; an attribute keeps its
/// number of channels from frame to frame.
FusionReport fuse(PointModel& model, const Frame& frame, const Camera& camera, const Pose& world_from_camera,
                  double spacing, std::int32_t frame_index, const FusionOptions& options = {},
                  const ColorsRef& colors = Colors(), int num_threads = 0,
                  const std::vector<FrameAttribute>& attributes = {});

/// Drops points until neighbours are at least `spacing` apart along the surface; earlier points stay.
void thin(PointModel& model, double spacing);

}  // namespace nacre
