// What is known about the space in front of a cloud, behind it and beside it, that was seen from one place.
#pragma once

#include <vector>

#include "base/numbers.hpp"
#include "nacre/types.hpp"

namespace nacre {

// A range image of a cloud, in the azimuthal equidistant projection about the direction to its middle.
class FreeSpace {
 public:
  enum class Seen {
    beyond,   // no surface was seen anywhere near its direction
    unknown,  // at the outline of what was seen
    free,     // the viewpoint looks through the point, at something behind
    near,     // about where a surface was seen
    hidden,   // behind what was seen
  };

  // Points that are not finite are left out.
  FreeSpace(const PointsRef& points, const Eigen::Vector3d& viewpoint);

  Seen look(const Eigen::Vector3d& point, double tolerance) const;
  const Eigen::Vector3d& viewpoint() const { return viewpoint_; }
  const Eigen::Vector3d& axis() const { return axis_; }  // from the viewpoint to the cloud's middle
  double radius() const { return radius_; }              // of the cloud about the axis, root mean square [m]

 private:
  struct Projection {
    Eigen::Matrix<double, 2, 1, Eigen::DontAlign> uv;  // [rad]
    double range;
  };
  // What is known of a cell from its own points and those around it.
  struct Cell {
    float nearest = infinity<float>, farthest = -nearest;
    bool is_known = false, is_reached = false;
  };

  Projection project(const Eigen::Vector3d& point) const;
  std::size_t index_of(const Projection& projection) const;
  void fill_cells(const std::vector<Projection>& projections);

  Eigen::Vector3d viewpoint_, axis_, right_, down_;
  Eigen::Matrix<double, 2, 1, Eigen::DontAlign> first_;
  double radius_ = 0.0, cell_ = 1.0;
  int width_ = 0, height_ = 0;
  std::vector<Cell> cells_;
};

}  // namespace nacre
