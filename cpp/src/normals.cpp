#include "nacre/normals.hpp"

#include <cmath>
#include <limits>

#include "block_tree.hpp"
#include "check.hpp"
#include "parallel.hpp"
#include "rows.hpp"
#include "warm_search.hpp"

namespace nacre {
namespace {

// A neighbourhood is a line where the sum of the products of its variances is below this share of their sum's square:
// about where the second variance is below this share of the first.
constexpr double line_share = 0.005;
// It fills space where the variance along the normal is above this share of the sum of the three (1/3 is isotropic;
// "surface variation", Pauly, Gross and Kobbelt 2002). Among 16 random points of a plane whose noise is half their
// spacing, one neighbourhood in a thousand is above; a limit on the ratio of the two smallest variances that refuses as
// few would let twice as many isotropic neighbourhoods through.
constexpr double space_share = 0.22;

const Eigen::Vector3d no_normal = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());

// The columns of the adjugate of a symmetric matrix.
Eigen::Matrix3d adjugate(const Eigen::Matrix3d& c) {
  Eigen::Matrix3d columns;
  columns << c.col(1).cross(c.col(2)), c.col(2).cross(c.col(0)), c.col(0).cross(c.col(1));
  return columns;
}

// The direction of the least variance, or no_normal where the points are on a line or fill space.
Eigen::Vector3d plane_normal(const Eigen::Matrix3d& covariance) {
  const double trace = covariance.trace();
  if (!(trace > 0)) return no_normal;
  const Eigen::Matrix3d c = covariance / trace;
  const Eigen::Matrix3d cofactors = adjugate(c);
  const double minors = cofactors.trace(), determinant = c.col(0).dot(cofactors.col(0));
  if (!(minors > line_share)) return no_normal;

  // The least variance is the first root of v^3 - v^2 + minors v - determinant; Newton's steps from 0 approach it from
  // below, where the cubic has no extremum; towards a double root each halves the distance.
  double v = 0;
  for (int i = 0; i < 50; ++i) {
    const double step = (((v - 1) * v + minors) * v - determinant) / ((3 * v - 2) * v + minors);
    v -= step;
    if (!(v <= space_share)) return no_normal;
    if (std::abs(step) < 1e-15) break;
  }
  // (c - v I) has its eigenvector in its kernel, so that every column of the adjugate is a multiple of it.
  const Eigen::Matrix3d normals = adjugate(c - v * Eigen::Matrix3d::Identity());
  int longest;
  normals.diagonal().maxCoeff(&longest);
  return normals.col(longest).normalized();
}

template <class T>
PointMatrix<T> estimate(const Eigen::Ref<const PointMatrix<T>>& points, const NormalOptions& options,
                        const Eigen::Vector3d& viewpoint) {
  require(options.k >= 3, "k", "at least 3", options.k);
  require(options.max_radius > 0, "max_radius", "positive", options.max_radius);
  require(viewpoint.allFinite(), "viewpoint", "finite", viewpoint.transpose());

  const BlockTree<T> tree(Rows<T>(points).data(), points.rows(), options.num_threads);
  PointMatrix<T> normals = PointMatrix<T>::Constant(points.rows(), 3, std::numeric_limits<T>::quiet_NaN());
  parallel_blocks(tree.num_points(), 256, options.num_threads, [&](std::int64_t, std::int64_t begin, std::int64_t end) {
    WarmSearch search(tree, options.k, options.max_radius);
    for (auto slot = static_cast<std::uint32_t>(begin); slot < end; ++slot) {
      const Eigen::Vector3d point = tree.position(slot);
      const int found = search(point);
      if (found < 3) continue;
      // Sums of the steps from the point itself keep their digits however far the origin is.
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
      for (int j = 0; j < found; ++j) {
        const Eigen::Vector3d step = tree.position(search[j].slot) - point;
        sum += step;
        products += step.lazyProduct(step.transpose());
      }
      Eigen::Vector3d normal = plane_normal(products - sum * sum.transpose() / found);
      if (normal.dot(viewpoint - point) < 0) normal = -normal;
      normals.row(tree.id(slot)) = normal.transpose().template cast<T>();
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
