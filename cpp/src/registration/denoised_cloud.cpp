#include "registration/denoised_cloud.hpp"

#include <algorithm>
#include <cmath>

#include "base/limits.hpp"
#include "base/parallel.hpp"
#include "base/statistics.hpp"
#include "nacre/normals.hpp"
#include "registration/limits.hpp"
#include "spatial/subset.hpp"

namespace nacre {
namespace {

constexpr std::int64_t cloud_block = 256;

Points normals_of(const GlobalCloud& cloud, int num_threads) {
  if (cloud.normals.rows() > 0) return cloud.normals;
  NormalOptions options;
  options.num_threads = num_threads;
  return estimate_normals(cloud.points, options, cloud.viewpoint.value_or(Eigen::Vector3d::Zero()));
}

// The median distance of near points from a point's tangent plane, as a standard deviation.
double roughness(const Points& points, const Points& normals, int num_threads) {
  const Eigen::Index step = std::max<Eigen::Index>(1, points.rows() / registration_limits::roughness_probes);
  Points probes(points.rows() / step, 3);
  for (Eigen::Index i = 0; i < probes.rows(); ++i) probes.row(i) = points.row(i * step);
  const Neighbors near = KdTree(points, num_threads).query(PointsRef(probes), 4, KdTree::infinity, num_threads);
  std::vector<float> offsets;
  for (Eigen::Index i = 0; i < probes.rows(); ++i) {
    for (Eigen::Index k = 0; k < near.indices.cols(); ++k) {
      const std::int64_t row = near.indices(i, k);
      if (row >= points.rows() || row == i * step) continue;
      const float offset = (points.row(row) - probes.row(i)).dot(normals.row(i * step));
      if (std::isfinite(offset)) offsets.push_back(std::abs(offset));
    }
  }
  if (offsets.empty()) return 0.0;
  return mad_to_sigma * static_cast<double>(median_of(std::move(offsets))) / std::sqrt(2.0);
}

// Moves points, which are some rows of a cloud, to the mean of their neighbours.
void denoise(const PointsRef& all, const Points& all_normals, const std::vector<std::int64_t>& rows, int num_threads,
             Points& points, const Points& normals) {
  const Neighbors near =
      KdTree(all, num_threads)
          .query(PointsRef(points), registration_limits::mean_neighbors, KdTree::infinity, num_threads);
  constexpr auto cosine = static_cast<float>(base_limits::same_surface_cosine);
  parallel_for(points.rows(), cloud_block, num_threads, [&](std::int64_t i) {
    float sum = 0.0F, count = 0.0F;
    for (Eigen::Index k = 0; k < near.indices.cols(); ++k) {
      const std::int64_t row = near.indices(i, k);
      if (row >= all.rows()) break;
      if (!(std::abs(all_normals.row(row).dot(normals.row(i))) > cosine)) continue;
      sum += (all.row(row) - all.row(rows[static_cast<std::size_t>(i)])).dot(normals.row(i));
      count += 1.0F;
    }
    const Eigen::RowVector3f mean = points.row(i) + sum / count * normals.row(i);
    if (mean.allFinite()) points.row(i) = mean;  // it is not where nothing is near, nor where normals are no directions
  });
}

}  // namespace

DenoisedCloud::DenoisedCloud(const GlobalCloud& cloud, const GlobalAlignOptions& options, bool is_noisy) {
  const PointsRef& all = cloud.points;
  const Points all_normals = normals_of(cloud, options.num_threads);
  const std::int64_t most = options.max_points > 0 ? options.max_points : all.rows();
  const std::vector<std::int64_t> rows = choose_rows(all, most, options.seed, options.num_threads);
  points.resize(static_cast<Eigen::Index>(rows.size()), 3);
  normals.resize(points.rows(), 3);
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    points.row(i) = all.row(rows[static_cast<std::size_t>(i)]);
    normals.row(i) = all_normals.row(rows[static_cast<std::size_t>(i)]);
  }
  if (points.rows() == 0) return;

  if (is_noisy) denoise(all, all_normals, rows, options.num_threads, points, normals);
  noise = roughness(points, normals, options.num_threads);
  if (cloud.normals.rows() == 0 && !cloud.viewpoint) normals.resize(0, 3);
}

}  // namespace nacre
