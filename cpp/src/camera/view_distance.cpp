#include "camera/view_distance.hpp"

#include <algorithm>

#include "base/se3.hpp"
#include "base/statistics.hpp"
#include "camera/limits.hpp"

namespace nacre {

double median_depth(const Points& points) {
  return points.rows() > 0 ? static_cast<double>(median_of(points.col(2))) : 1.0;
}

double view_distance(const Pose& a, const Pose& b, double depth) {
  const double angle = angle_between(a, b);
  return std::max(angle / camera_limits::view_turn,
                  (a.translation() - b.translation()).norm() / (camera_limits::view_shift * depth));
}

}  // namespace nacre
