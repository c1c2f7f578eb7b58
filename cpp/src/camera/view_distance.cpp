#include "camera/view_distance.hpp"

#include <algorithm>

#include "base/se3.hpp"
#include "base/statistics.hpp"

namespace nacre {

double median_depth(const Points& points) {
  return points.rows() > 0 ? static_cast<double>(median_of(points.col(2))) : 1.0;
}

double view_distance(const Pose& a, const Pose& b, double depth) {
  constexpr double turn = 0.2, part_of_depth = 0.15;
  const double angle = angle_between(a, b);
  return std::max(angle / turn, (a.translation() - b.translation()).norm() / (part_of_depth * depth));
}

}  // namespace nacre
