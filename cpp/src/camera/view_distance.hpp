// How far apart views are.
#pragma once

#include "nacre/types.hpp"

namespace nacre {

// Of points in the camera frame [m]; 1 where there are none.
double median_depth(const Points& points);

// How far apart two views are of a surface at a depth [m]: 1 turns the camera by 0.2 rad, or moves it by 0.15 depths.
double view_distance(const Pose& a, const Pose& b, double depth);
// The larger of these two.
double turn_distance(const Pose& a, const Pose& b);
double shift_distance(const Pose& a, const Pose& b, double depth);

}  // namespace nacre
