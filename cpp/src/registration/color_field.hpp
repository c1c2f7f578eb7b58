// Brightness on a surface, and how it changes along it.
#pragma once

#include <vector>

#include "nacre/kdtree.hpp"
#include "nacre/types.hpp"

namespace nacre {

// Of red, green and blue (ITU-R BT.601).
inline float luma(const Eigen::Vector3f& color) { return color.dot(Eigen::Vector3f(0.299F, 0.587F, 0.114F)); }

// Points with a brightness each, as they were measured; those without one are not kept.
struct BrightCloud {
  Points points;
  Values brightness;

  BrightCloud(const PointsRef& points, const ValuesRef& brightness);
  // One of every `step` points, at random.
  BrightCloud thinned(std::int64_t step, std::uint64_t seed) const;
};

struct ColorField {
  Values brightness;  // NaN where too few points are near
  Points gradient;    // along the surface [1/m]
};

// At each point with a normal, the linear function on the tangent plane that fits the brightness of the nearest 16
// points within a distance best: Park, Zhou and Koltun 2017, section 4.1, with the value at the point free.
ColorField fit_color_field(const BrightCloud& cloud, const Points& points, const Points& normals, double max_distance,
                           int num_threads);

}  // namespace nacre
