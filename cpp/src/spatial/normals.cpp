#include "nacre/normals.hpp"

#include <algorithm>
#include <limits>
#include <vector>

#include "base/check.hpp"
#include "base/parallel.hpp"
#include "base/point_rows.hpp"
#include "simd/tree_plane_fit.hpp"
#include "spatial/bvh16.hpp"
#include "spatial/knn_batch.hpp"

namespace nacre {
namespace {

void fit_planes(const BlockTreeView<float>& tree, const simd::Neighborhoods& near, double (&normals)[3][16]) {
  simd::fit_planes_f32()(tree, near, normals);
}
void fit_planes(const BlockTreeView<double>& tree, const simd::Neighborhoods& near, double (&normals)[3][16]) {
  simd::fit_planes_f64()(tree, near, normals);
}

template <class T>
PointMatrix<T> estimate(const Eigen::Ref<const PointMatrix<T>>& points, const NormalOptions& options,
                        const Eigen::Vector3d& viewpoint) {
  require(options.k >= 3, "k", "at least 3", options.k);
  require(options.max_radius > 0, "max_radius", "positive", options.max_radius);
  require(viewpoint.allFinite(), "viewpoint", "finite", viewpoint.transpose());

  const BlockTree<T> tree(Rows<T>(points).data(), points.rows(), options.num_threads);
  PointMatrix<T> normals(points.rows(), 3);
  if (tree.num_points() < points.rows()) normals.setConstant(std::numeric_limits<T>::quiet_NaN());
  // All points are as many neighbours as any larger number.
  const int k = static_cast<int>(std::min<std::int64_t>(options.k, std::max<std::int64_t>(3, tree.num_points())));
  parallel_blocks(
      tree.num_points(), queries_per_task(k, 64 * block_points), options.num_threads,
      [&](auto, std::int64_t begin, std::int64_t end) {
        std::vector<std::uint32_t> slots(static_cast<std::size_t>(block_points) * static_cast<std::size_t>(k));
        simd::Neighborhoods near;
        near.slots = slots.data();
        near.stride = k;
        const simd::NearestSlotsTask task = {k, squared_bound(options.max_radius), slots.data(), near.counts};
        GroupQueries search(tree, task);
        for (std::int64_t first = begin; first < end; first += block_points) {
          const PointBlock<T>& block = tree.view().blocks[first / block_points];
          simd::QueryGroup group;
          group.size = static_cast<int>(std::min<std::int64_t>(block_points, end - first));
          for (int i = 0; i < block_points; ++i) {
            near.counts[i] = 0;
            group.row[i] = static_cast<std::uint32_t>(i);
            for (int axis = 0; axis < 3; ++axis)
              near.p[axis][i] = group.p[axis][i] = static_cast<double>(block.p[axis][i]);
          }
          const int size = group.size;
          search(group);
          double fitted[3][16];
          fit_planes(tree.view(), near, fitted);
          for (int i = 0; i < size; ++i) {
            const Eigen::Vector3d normal(fitted[0][i], fitted[1][i], fitted[2][i]);
            const Eigen::Vector3d point(near.p[0][i], near.p[1][i], near.p[2][i]);
            const double side = normal.dot(viewpoint - point) < 0 ? -1 : 1;
            normals.row(block.id[i]) = (side * normal).transpose().template cast<T>();
          }
        }
      });
  return normals;
}

}  // namespace

Points estimate_normals(const PointsRef& points, const NormalOptions& options, const Eigen::Vector3d& viewpoint) {
  return estimate<float>(points, options, viewpoint);
}

PointsDouble estimate_normals(const PointsDoubleRef& points, const NormalOptions& options,
                              const Eigen::Vector3d& viewpoint) {
  return estimate<double>(points, options, viewpoint);
}

}  // namespace nacre
