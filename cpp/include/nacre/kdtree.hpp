/// Exact nearest neighbours.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "nacre/types.hpp"

namespace nacre {

using PointsDouble = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
using PointsDoubleRef = Eigen::Ref<const PointsDouble>;

/// k nearest neighbours of each query: row q lists them nearest first; where fewer exist, index = tree size and
/// distance = infinity.
struct Neighbors {
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> distances;  ///< [m]
  Eigen::Matrix<std::int64_t, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> indices;
};

/// All neighbours within a radius, each query's after the other's: query q owns the entries
/// [offsets[q], offsets[q + 1]), nearest first.
struct RadiusNeighbors {
  std::vector<std::int64_t> offsets;
  std::vector<std::int64_t> indices;
  std::vector<double> distances;  ///< [m]
};

/// A k-d tree over a copy of the points. Exact: distances are compared in double precision, equal distances by the
/// smaller index. Points that are not finite are never found; a query that is not finite finds nothing. Immutable, so
/// any number of threads may query it. Batches of queries may come in any order: they are visited in an order of their
/// own, and answered in the caller's. num_threads = 0 uses all; no result depends on it.
class KdTree {
 public:
  explicit KdTree(const PointsRef& points, int num_threads = 0);
  explicit KdTree(const PointsDoubleRef& points, int num_threads = 0);
  ~KdTree();
  KdTree(KdTree&&) noexcept;
  KdTree& operator=(KdTree&&) noexcept;

  std::int64_t size() const;

  /// The k nearest within max_distance (inclusive). Throws std::invalid_argument for k < 1 or a negative distance.
  Neighbors query(const PointsRef& queries, int k, double max_distance = infinity, int num_threads = 0) const;
  Neighbors query(const PointsDoubleRef& queries, int k, double max_distance = infinity, int num_threads = 0) const;

  /// The same into the caller's memory, k entries a query; distances in the precision of the queries.
  void query_into(const PointsRef& queries, int k, double max_distance, int num_threads, std::int64_t* indices,
                  float* distances) const;
  void query_into(const PointsDoubleRef& queries, int k, double max_distance, int num_threads, std::int64_t* indices,
                  double* distances) const;

  /// All within the radius (inclusive). Throws std::invalid_argument for a negative radius.
  RadiusNeighbors query_radius(const PointsRef& queries, double radius, int num_threads = 0) const;
  RadiusNeighbors query_radius(const PointsDoubleRef& queries, double radius, int num_threads = 0) const;

  /// The k nearest of one point within max_distance (inclusive) into the caller's memory, k entries each; returns how
  /// many were found. For use inside loops: up to k = 32 nothing is allocated, a max_distance that is just large enough
  /// (the distance to the last neighbour, say) saves most of the search, and so does asking for nearby queries in turn.
  int nearest(const Eigen::Vector3d& query, int k, double max_distance, std::int64_t* indices,
              double* squared_distances) const;

  static constexpr double infinity = std::numeric_limits<double>::infinity();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace nacre
