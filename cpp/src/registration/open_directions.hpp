// Directions of a pose that shape leaves open, decided by something else: brightnesses, outlines.
#pragma once

#include <vector>

#include "registration/gauss_newton.hpp"
#include "registration/weak_directions.hpp"

namespace nacre {

// A pose that was moved along open directions, and the rows that it rests on.
struct OpenFit {
  IcpResult result;
  std::vector<MotionRow> rows;
  double extent = 1.0;  // in units of which the rows' rotations are [m]
  double noise = 1.0;   // of the rows' residuals
  bool agrees = false;  // whether the rows may decide at all
};

class OpenDirectionSearch {
 public:
  virtual ~OpenDirectionSearch() = default;
  // From a pose at rest on the surface, along the given directions or, without any, all that geometry leaves open.
  virtual OpenFit fit(const IcpResult& geometric, const TwistBasis* only) = 0;
  // Which of some directions the rows determine.
  virtual Directions determined(const OpenFit& fit, const TwistBasis& open) const = 0;
};

// Continues a registration that has weak directions. Those that the search determines are no longer weak; along the
// others, and where the search does not agree, the pose stays as it was. What geometry determines is never left to it.
IcpResult determine_open_directions(const IcpResult& geometric, OpenDirectionSearch& search);

// Of all poses that differ in weak directions alone, the one that a camera at a guess comes to by the least motion of
// its own. lever: by how many metres it moves as soon as it turns by a radian.
Pose nearest_to(const Pose& guess, const IcpResult& result, double lever);

}  // namespace nacre
