#include "registration/color_field.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/parallel.hpp"
#include "base/point_rows.hpp"
#include "base/random.hpp"
#include "registration/limits.hpp"

namespace nacre {

std::vector<std::uint8_t> brightness_of(const ColorsRef& colors) {
  std::vector<std::uint8_t> brightness(static_cast<std::size_t>(colors.rows()));
  for (Eigen::Index i = 0; i < colors.rows(); ++i) {
    const int sum = 77 * colors(i, 0) + 150 * colors(i, 1) + 29 * colors(i, 2);  // luma in parts of 256
    brightness[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>((sum + 128) >> 8);
  }
  return brightness;
}

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

ColorField::ColorField(const BrightCloud& cloud, const Points& points, const Points& normals, double max_distance,
                       int num_threads)
    : tree_(cloud.points, num_threads),
      cloud_(cloud),
      points_(points),
      normals_(normals),
      max_distance_(max_distance),
      num_threads_(num_threads),
      is_fitted_(static_cast<std::size_t>(points.rows())),
      brightness_(Values::Constant(points.rows(), std::numeric_limits<float>::quiet_NaN())),
      gradient_(Points::Zero(points.rows(), 3)) {}

void ColorField::fit(const std::vector<std::uint32_t>& rows) {
  const int k = registration_limits::color_neighbors;
  std::vector<std::uint32_t> missing;
  for (const std::uint32_t row : rows) {
    if (std::exchange(is_fitted_[row], std::uint8_t{1}) == 0) missing.push_back(row);
  }
  const Points queries = take_rows<Points>(points_, missing);
  std::vector<std::int64_t> neighbors(missing.size() * static_cast<std::size_t>(k));
  std::vector<float> distances(neighbors.size());
  tree_.query_into(queries, k, max_distance_, num_threads_, neighbors.data(), distances.data());
  parallel_for(queries.rows(), 64, num_threads_,
               [&](std::int64_t i) { fit_one(missing[static_cast<std::size_t>(i)], neighbors.data() + k * i); });
}

void ColorField::fit_one(std::uint32_t row, const std::int64_t* neighbors) {
  const Eigen::Vector3d point = points_.row(row).transpose().cast<double>();
  const Eigen::Vector3d normal = normals_.row(row).transpose().cast<double>();
  const std::int64_t* end =
      std::find(neighbors, neighbors + registration_limits::color_neighbors, cloud_.points.rows());
  if (end - neighbors < registration_limits::least_color_neighbors || !normal.allFinite()) return;
  const auto offset = [&](std::int64_t neighbor) {
    return Eigen::Vector3d(cloud_.points.row(neighbor).transpose().cast<double>() - point);
  };
  const Eigen::Vector3d across = normal.unitOrthogonal(), along = normal.cross(across);
  const double radius = std::max(offset(*(end - 1)).norm(), 1e-12);
  // Unknowns: the value, and the slopes along two directions in units of the radius.
  Eigen::Matrix3d equations = 1e-3 * Eigen::Vector3d(0.0, 1.0, 1.0).asDiagonal().toDenseMatrix();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  std::for_each(neighbors, end, [&](std::int64_t neighbor) {
    const Eigen::Vector3d d = offset(neighbor) / radius;
    const double falloff = 1.0 - registration_limits::color_falloff * d.squaredNorm();
    const Eigen::Vector3d terms(1.0, d.dot(across), d.dot(along));
    equations += falloff * terms * terms.transpose();
    right += falloff * static_cast<double>(cloud_.brightness[neighbor]) * terms;
  });
  const Eigen::Vector3d found = equations.ldlt().solve(right);
  brightness_[row] = static_cast<float>(found[0]);
  gradient_.row(row) = ((found[1] * across + found[2] * along) / radius).transpose().cast<float>();
}

}  // namespace nacre
