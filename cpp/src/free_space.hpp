// What is known about the space in front of and behind a cloud that was seen from one place.
#pragma once

#include <vector>

#include "nacre/types.hpp"

namespace nacre {

// A range image of a cloud, in the azimuthal equidistant projection about the direction to its middle.
class FreeSpace {
 public:
  enum class Seen {
    unknown,  // no surface was seen around there
    free,     // the viewpoint looks through the point, at something behind
    near,     // about where a surface was seen
    hidden,   // behind what was seen
  };

  FreeSpace(const PointsRef& points, const Eigen::Vector3d& viewpoint);

  Seen look(const Eigen::Vector3d& point, double tolerance) const;
  const Eigen::Vector3d& viewpoint() const { return viewpoint_; }
  const Eigen::Vector3d& axis() const { return axis_; }
  double radius() const { return radius_; }  // of the cloud across the axis, root mean square [m]

 private:
  struct Cell {
    float nearest, farthest;
  };
  bool project(const Eigen::Vector3d& point, double& u, double& v, double& range) const;

  Eigen::Vector3d viewpoint_, axis_, right_, down_;
  double radius_ = 0.0, first_u_ = 0.0, first_v_ = 0.0, cell_ = 1.0;
  int width_ = 0, height_ = 0;
  std::vector<Cell> cells_;  // of each and its eight neighbours; nearest > farthest where too few of them have points
};

}  // namespace nacre
