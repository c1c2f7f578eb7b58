// Brightness on a surface, and how it changes along it.
#pragma once

#include <cstdint>
#include <vector>

#include "nacre/kdtree.hpp"
#include "nacre/types.hpp"

namespace nacre {

// Of red, green and blue (ITU-R BT.601).
inline float luma(const Eigen::Vector3f& color) { return color.dot(Eigen::Vector3f(0.299F, 0.587F, 0.114F)); }

// The same of each pixel, in whole numbers.
std::vector<std::uint8_t> brightness_of(const ColorsRef& colors);

// Points with a brightness each, as they were measured; those without one are not kept.
struct BrightCloud {
  Points points;
  Values brightness;

  BrightCloud(const PointsRef& points, const ValuesRef& brightness);
  // One of every `step` points, at random.
  BrightCloud thinned(std::int64_t step, std::uint64_t seed) const;
};

// At points with normals, the linear function on the tangent plane that fits the brightness of the nearest 16 points of
// a cloud, within a distance, best: Park, Zhou and Koltun 2017, section 4.1, with the value at the point free.
class ColorField {
 public:
  // The points and normals outlive it.
  ColorField(const BrightCloud& cloud, const Points& points, const Points& normals, double max_distance,
             int num_threads);

  // Of the points, where that has not been done.
  void fit(const std::vector<std::uint32_t>& rows);

  // Of points that it was fitted at.
  float brightness(Eigen::Index row) const { return brightness_[row]; }  // NaN where too few points are near
  Eigen::Vector3d gradient(Eigen::Index row) const { return gradient_.row(row).transpose().cast<double>(); }  // [1/m]

 private:
  void fit_one(std::uint32_t row, const std::int64_t* neighbors);

  KdTree tree_;
  BrightCloud cloud_;
  const Points& points_;
  const Points& normals_;
  double max_distance_;
  int num_threads_;
  std::vector<std::uint8_t> is_fitted_;
  Values brightness_;
  Points gradient_;
};

}  // namespace nacre
