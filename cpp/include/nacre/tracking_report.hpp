/// What a frame's registration to the model came to.
#pragma once

#include <string>

#include "nacre/types.hpp"

namespace nacre {

/// What became of a frame.
enum class FrameStatus {
  tracked,      ///< registered and fused
  weak,         ///< registered, but the data leaves a direction of the pose open: not fused
  lost,         ///< not registered: the model is as it was before
  relocalised,  ///< registered again after being lost, and fused
};
const char* to_string(FrameStatus status);  ///< TRACKED, WEAK, LOST, RELOCALISED

/// Where the camera was, and what speaks for it. Of earlier frames figures are in single precision, but for the pose.
struct TrackingReport {
  FrameStatus status = FrameStatus::lost;
  std::string reason;                         ///< why the frame is weak or lost; empty otherwise
  Pose world_from_camera = Pose::Identity();  ///< of a lost frame: the last known pose
  int num_inliers = 0;
  double overlap = 0.0;      ///< part of the frame that matches the model
  double consistency = 0.0;  ///< part of the model's points in view that the frame does not see through
  double score = 0.0;        ///< of the registration: that it is right, against chance: what the residuals tell a
                             ///< match, times overlap^2 consistency^4 (^12 far from all guesses), less
                             ///< where residuals of neighbours agree beyond noise
  double rmse = 0.0;         ///< of the inliers, along the normals [m]
  Eigen::Vector3d center = Eigen::Vector3d::Zero();          ///< see AlignResult; world frame
  Matrix6 information = Matrix6::Zero();                     ///< see AlignResult
  Eigen::Matrix<double, 6, Eigen::Dynamic> weak_directions;  ///< see AlignResult

  bool is_on_plane = false;  ///< found by the search on the plane on which an object was turned

  /// That the registration is right, by its score; of a lost frame, that the best one was, which was not taken. On a
  /// plane scores tell little, and it is the part of such views that are right. NaN where the pose came without a
  /// registration.
  double probability() const;
};

}  // namespace nacre
