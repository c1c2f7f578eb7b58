#include "camera/view_distance.hpp"

#include <algorithm>

#include "base/se3.hpp"
#include "base/statistics.hpp"
#include "camera/limits.hpp"

namespace nacre {

double median_depth(const Points& points) {
  return points.rows() > 0 ? static_cast<double>(median_of(points.col(2))) : 1.0;
}

double turn_distance(const Pose& a, const Pose& b) { return angle_between(a, b) / camera_limits::view_turn; }

double shift_distance(const Pose& a, const Pose& b, double depth) {
  return (a.translation() - b.translation()).norm() / (camera_limits::view_shift * depth);
}

double view_distance(const Pose& a, const Pose& b, double depth) {
  return std::max(turn_distance(a, b), shift_distance(a, b, depth));
}

}  // namespace nacre
