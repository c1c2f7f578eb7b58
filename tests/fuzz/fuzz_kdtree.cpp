// Neighbours of any points, against comparing all with all.
#include <algorithm>
#include <cmath>
#include <utility>

#include "bytes.hpp"

namespace {

using namespace nacre;
using Found = std::vector<std::pair<double, std::int64_t>>;

template <class Matrix>
Found compare_all(const Matrix& points, const Eigen::Vector3d& query, double max_distance) {
  Found found;
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const Eigen::Vector3d point = points.row(i).transpose().template cast<double>();
    if (!point.allFinite() || !query.allFinite()) continue;
    const Eigen::Vector3d d = point - query;
    const double squared = d.x() * d.x() + d.y() * d.y() + d.z() * d.z();
    if (std::sqrt(squared) <= max_distance) found.emplace_back(squared, i);
  }
  std::sort(found.begin(), found.end());
  return found;
}

// Squares that overflow or vanish cannot be told apart.
template <class Matrix>
bool is_moderate(const Matrix& points) {
  for (Eigen::Index i = 0; i < points.size(); ++i) {
    const double size = std::abs(static_cast<double>(points.data()[i]));
    if (std::isfinite(size) && size != 0.0 && (size > 1e100 || size < 1e-100)) return false;
  }
  return true;
}

template <class Matrix>
void compare(nacre_fuzz::Bytes& bytes) {
  const Matrix points = bytes.rows<Matrix>(600);
  Matrix queries = bytes.rows<Matrix>(40);
  if (bytes.boolean()) queries = points.topRows(std::min<Eigen::Index>(points.rows(), 40));
  const int k = bytes.byte() >= 240 ? bytes.integer(-1, 2000) : bytes.integer(1, 70);
  const double reach = bytes.boolean() ? KdTree::infinity : bytes.number();
  const int threads = bytes.threads();
  const KdTree tree(points, threads);
  NACRE_HOLDS(tree.size() == points.rows());
  const Neighbors near = tree.query(queries, k, reach, threads);
  const RadiusNeighbors within = tree.query_radius(queries, reach, threads);
  NACRE_HOLDS(near.indices.rows() == queries.rows() && near.indices.cols() == k);
  NACRE_HOLDS(static_cast<Eigen::Index>(within.offsets.size()) == queries.rows() + 1);
  const bool is_exact = is_moderate(points) && is_moderate(queries) && (std::isinf(reach) || reach > 1e-100);
  for (Eigen::Index q = 0; q < queries.rows(); ++q) {
    const Eigen::Vector3d query = queries.row(q).transpose().template cast<double>();
    const Found expected = compare_all(points, query, reach);
    const std::int64_t begin = within.offsets[static_cast<std::size_t>(q)];
    const std::int64_t count = within.offsets[static_cast<std::size_t>(q) + 1] - begin;
    NACRE_HOLDS(count >= 0);
    if (is_exact) NACRE_HOLDS(count == static_cast<std::int64_t>(expected.size()));
    for (int rank = 0; rank < k; ++rank) {
      const std::int64_t index = near.indices(q, rank);
      NACRE_HOLDS(index >= 0 && index <= tree.size());
      if (!is_exact) continue;
      const bool exists = rank < static_cast<int>(expected.size());
      NACRE_HOLDS(index == (exists ? expected[static_cast<std::size_t>(rank)].second : tree.size()));
      if (exists) NACRE_HOLDS(within.indices[static_cast<std::size_t>(begin + rank)] == index);
    }
    if (k > 0 && k <= 70) {
      std::int64_t indices[70];
      double squared[70];
      const int found = tree.nearest(query, k, reach, indices, squared);
      NACRE_HOLDS(!is_exact || found == std::min<int>(k, static_cast<int>(expected.size())));
    }
  }
}

}  // namespace

NACRE_FUZZ_TARGET(bytes) {
  if (bytes.boolean()) {
    compare<Points>(bytes);
  } else {
    compare<PointsDouble>(bytes);
  }
}
