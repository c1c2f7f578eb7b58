/// Registration of two clouds: iterative closest point (ICP).
#pragma once

#include <cstdint>
#include <string>

#include "nacre/kdtree.hpp"
#include "nacre/types.hpp"

namespace nacre {

/// What a pair of points (p, q) costs.
enum class Metric {
  point_to_point,  ///< |p - q|^2, Besl and McKay 1992
  point_to_plane,  ///< ((p - q) . n_q)^2, Chen and Medioni 1992; solved for small angles, applied by Rodrigues
  symmetric,       ///< ((p - q) . (n_p + n_q))^2, Rusinkiewicz 2019
  paper            ///< point_to_plane as Blackburn, Kubacki and Stratton 2010 iterate it: every iteration draws its own
                   ///< sample_fraction, and max_distance is along the normal
};

/// How align works.
struct AlignOptions {
  Metric method = Metric::symmetric;
  int max_iterations = 40;       ///< on the shapes; what a brightness decides takes a few more
  double max_distance = 0.0;     ///< pairs farther apart are rejected in the first iteration [m]; 0: a quarter of the
                                 ///< target's diameter
  double final_distance = 0.0;   ///< the gate shrinks to this [m]; 0: from the spacing of the target and the residuals
  double gate_decay = 0.7;       ///< the gate is multiplied by this at each iteration; 1: it stays at max_distance
  double max_angle = 0.7853982;  ///< pairs whose normals differ more are rejected [rad]; 45 degrees
  bool robust = true;            ///< weights of Geman and McClure on the residuals, scaled by their median
  double sample_fraction = 1.0;  ///< part of the source points that is used
  int max_points = 10000;    ///< at most so many points of each cloud are looked at, where final_distance is 0; 0: all
  int max_samples = 5000;    ///< at most so many of them in the last iterations; 0: no limit
  int coarse_samples = 600;  ///< at most so many of them while the gate shrinks; 0: no limit
  bool keep_best = false;    ///< return the iterate of least rmse instead of the last (the paper's choice)
  double weak_threshold =
      0.002;               ///< directions whose eigenvalue of the scaled information, per pair, is smaller are weak
  std::uint64_t seed = 0;  ///< of the sampling
  int num_threads = 0;     ///< 0: all

  void check() const;  ///< throws std::invalid_argument naming the field, what was expected and the value
};

/// A cloud as align takes it. Empty normals are estimated where the method needs them; empty sigma means equal weights.
/// Where both clouds have a brightness, it decides the directions of the pose that the shapes leave open.
struct AlignCloud {
  PointsRef points;      ///< rows that are not finite are ignored
  PointsRef normals;     ///< unit length
  ValuesRef sigma;       ///< standard deviation of each point along its normal [m]
  ValuesRef brightness;  ///< of each point, on a scale to 255; NaN where unknown

  explicit AlignCloud(const PointsRef& points, const PointsRef& normals = Points(), const ValuesRef& sigma = Values(),
                      const ValuesRef& brightness = Values());
};

/// How a registration ended.
enum class AlignStatus {
  converged,       ///< the last steps were below the accuracy of the data
  max_iterations,  ///< still moving
  too_few_pairs,   ///< nothing, or too little, matched: the transform is the initial one
};
/// converged, max_iterations, too_few_pairs.
const char* to_string(AlignStatus status);

/// The outcome of align.
struct AlignResult {
  Pose target_from_source = Pose::Identity();
  AlignStatus status = AlignStatus::too_few_pairs;
  int iterations = 0;    ///< that were run: at most max_iterations, but where a brightness decides directions
  int num_inliers = 0;   ///< pairs inside the last gate, of the source points that were used
  double overlap = 0.0;  ///< num_inliers / source points that were used
  double rmse = 0.0;     ///< of the inliers' residuals along the normals (distances, for point_to_point) [m]
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< centroid of the inliers, target frame [m]
  /// Inverse covariance of the pose: a twist (rotation [rad], translation [m]) about `center`, in the target frame.
  /// Residuals count as the independent ones that they are worth; what the target errs by is not in it.
  Matrix6 information = Matrix6::Zero();
  /// One column per direction that the data does not determine: unit twists about `center` with the rotation in units
  /// of the inliers' extent. The pose keeps its initial value along them.
  Eigen::Matrix<double, 6, Eigen::Dynamic> weak_directions;

  bool converged() const { return status == AlignStatus::converged; }
};

/// The motion that brings source onto target. Never throws for data that allows no answer: see AlignStatus.
AlignResult align(const AlignCloud& source, const AlignCloud& target, const Pose& initial = Pose::Identity(),
                  const AlignOptions& options = {});

}  // namespace nacre
