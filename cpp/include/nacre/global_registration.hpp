/// Registration of two clouds without a first guess.
#pragma once

#include <cstdint>
#include <optional>

#include "nacre/registration.hpp"

namespace nacre {

/// How align_global works.
struct GlobalAlignOptions {
  int num_rotations = 288;       ///< spread over all rotations, from which the search starts
  int num_candidates = 16;       ///< of them are refined
  double tolerance = 0.0;        ///< surfaces agree within it, along their normals [m]; 0: from their noise and size
  double max_angle = 0.5235988;  ///< and where their normals differ by less [rad]; 30 degrees
  double min_overlap = 0.15;     ///< of the part of a cloud's points that agree, of the cloud where it is more
  double min_consistency = 0.7;  ///< agreeing points, of those and the ones that contradict; see GlobalAlignResult
  double max_residual = 0.8;     ///< of the last registration, as a part of the tolerance
  double max_rivalry = 0.7;      ///< score of the best different motion, as a part of the best
  bool outlines = false;         ///< nothing but the clouds was to be seen from their viewpoints: what lies beyond the
                                 ///< other's outline contradicts
  int max_points = 10000;        ///< at most so many points of each cloud are looked at; 0: all
  int max_samples = 2000;        ///< at most so many of them are matched
  int coarse_samples = 250;      ///< and so many in the search
  std::uint64_t seed = 0;        ///< of the choice of samples
  int num_threads = 0;           ///< 0: all

  void check() const;  ///< throws std::invalid_argument naming the field, what was expected and the value
};

/// A cloud, and the place that it was seen from where there is one. Empty normals are estimated.
struct GlobalCloud {
  PointsRef points;                          ///< rows that are not finite are ignored
  PointsRef normals;                         ///< unit length, on the side that the surface is seen from
  std::optional<Eigen::Vector3d> viewpoint;  ///< [m]; nothing is between it and the points

  explicit GlobalCloud(const PointsRef& points, const PointsRef& normals = Points(),
                       const std::optional<Eigen::Vector3d>& viewpoint = std::nullopt);
};

/// What a search came to.
enum class GlobalAlignStatus {
  found,           ///< one motion, and no other, explains both clouds
  ambiguous,       ///< several different motions explain them about as well
  not_found,       ///< no motion does; the result is the best there is
  too_few_points,  ///< nothing to search with: the motion is the identity
};
/// found, ambiguous, not_found, too_few_points.
const char* to_string(GlobalAlignStatus status);

/// The outcome of align_global.
struct GlobalAlignResult {
  GlobalAlignStatus status = GlobalAlignStatus::too_few_points;
  AlignResult alignment;     ///< of the last registration
  double overlap = 0.0;      ///< part of the points that agree, of the cloud where it is more
  double consistency = 0.0;  ///< agreeing points, of those and the ones that the other cloud's viewpoint sees through
                             ///< or that should be seen from there and are not
  double rivalry = 0.0;      ///< score of the best different motion / score of this one
  double tolerance = 0.0;    ///< that was used [m]

  bool found() const { return status == GlobalAlignStatus::found; }
};

/// The motion that brings source onto target, wherever they are. Starts iterative closest point from rotations spread
/// over all (super-Fibonacci spirals, Alexa 2022), keeps what agrees best in both directions, and accepts it or not.
/// Never throws for data that allows no answer.
GlobalAlignResult align_global(const GlobalCloud& source, const GlobalCloud& target,
                               const GlobalAlignOptions& options = {});

}  // namespace nacre
