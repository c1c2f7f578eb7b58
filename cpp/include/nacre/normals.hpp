/// Normals of unorganised points.
#pragma once

#include <limits>

#include "nacre/kdtree.hpp"
#include "nacre/types.hpp"

namespace nacre {

/// How estimate_normals works.
struct NormalOptions {
  int k = 16;                                                   ///< neighbours, the point itself included; at least 3
  double max_radius = std::numeric_limits<double>::infinity();  ///< farther neighbours are not used [m]
  int num_threads = 0;                                          ///< 0: all
};

/// The normal of the plane through each point's neighbours (least squares), unit length, towards the viewpoint. NaN for
/// points that are not finite, with fewer than 3 neighbours, or whose neighbours lie on a line or fill space. Throws
/// std::invalid_argument for k < 3, a radius that is not positive, or a viewpoint that is not finite.
Points estimate_normals(const PointsRef& points, const NormalOptions& options = {},
                        const Eigen::Vector3d& viewpoint = Eigen::Vector3d::Zero());
PointsDouble estimate_normals(const PointsDoubleRef& points, const NormalOptions& options = {},
                              const Eigen::Vector3d& viewpoint = Eigen::Vector3d::Zero());

}  // namespace nacre
