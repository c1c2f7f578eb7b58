#include "registration/color_field.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>

#include "base/parallel.hpp"
#include "base/point_rows.hpp"
#include "base/random.hpp"
#include "registration/limits.hpp"

namespace nacre {
BrightCloud::BrightCloud(const PointsRef& points_in, const ValuesRef& brightness_in) {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < brightness_in.size(); ++i) {
    if (std::isfinite(brightness_in[i]) && points_in.row(i).allFinite()) rows.push_back(i);
  }
  points = take_rows<Points>(points_in, rows);
  brightness = take_rows<Values>(brightness_in, rows);
}

BrightCloud BrightCloud::thinned(std::int64_t step, std::uint64_t seed) const {
  std::vector<Eigen::Index> rows;
  const auto part = static_cast<std::uint64_t>(step);
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const auto index = static_cast<std::uint64_t>(i);
    if (index % part == random_bits(seed, index / part) % part) rows.push_back(i);
  }
  return BrightCloud(take_rows<Points>(points, rows), take_rows<Values>(brightness, rows));
}

ColorField fit_color_field(const BrightCloud& cloud, const Points& points, const Points& normals, double max_distance,
                           int num_threads) {
  constexpr float unknown = std::numeric_limits<float>::quiet_NaN();
  ColorField field{Values::Constant(points.rows(), unknown), Points::Constant(points.rows(), 3, unknown)};
  const KdTree tree(cloud.points, num_threads);
  parallel_for(points.rows(), 64, num_threads, [&](std::int64_t i) {
    const Eigen::Vector3d point = points.row(i).transpose().cast<double>();
    const Eigen::Vector3d normal = normals.row(i).transpose().cast<double>();
    if (!point.allFinite() || !normal.allFinite()) return;
    std::int64_t neighbours[registration_limits::color_neighbors];
    double squared[registration_limits::color_neighbors];
    const int count = tree.nearest(point, registration_limits::color_neighbors, max_distance, neighbours, squared);
    if (count < registration_limits::least_color_neighbors) return;
    const Eigen::Vector3d across = normal.unitOrthogonal(), along = normal.cross(across);
    const double radius = std::sqrt(squared[count - 1]);
    // Unknowns: the value, and the slopes along two directions in units of the radius.
    Eigen::Matrix3d equations = 1e-3 * Eigen::Vector3d(0.0, 1.0, 1.0).asDiagonal().toDenseMatrix();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (int k = 0; k < count; ++k) {
      const Eigen::Vector3d d =
          (cloud.points.row(neighbours[k]).transpose().cast<double>() - point) / std::max(radius, 1e-12);
      const double falloff = 1.0 - 0.9 * squared[k] / std::max(radius * radius, 1e-24);
      const Eigen::Vector3d row(1.0, d.dot(across), d.dot(along));
      equations += falloff * row * row.transpose();
      right += falloff * static_cast<double>(cloud.brightness[neighbours[k]]) * row;
    }
    const Eigen::Vector3d fit = equations.ldlt().solve(right);
    field.brightness[i] = static_cast<float>(fit[0]);
    field.gradient.row(i) = ((fit[1] * across + fit[2] * along) / std::max(radius, 1e-12)).transpose().cast<float>();
  });
  return field;
}

}  // namespace nacre
