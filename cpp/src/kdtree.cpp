#include "nacre/kdtree.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <variant>

#include "block_tree.hpp"
#include "check.hpp"
#include "parallel.hpp"
#include "warm_search.hpp"

namespace nacre {
namespace {

constexpr std::int64_t queries_per_block = 128;

template <class T>
std::variant<BlockTree<float>, BlockTree<double>> make_tree(const Eigen::Ref<const PointMatrix<T>>& points,
                                                            int num_threads) {
  require(points.rows() < static_cast<Eigen::Index>(no_id), "points", "fewer than 2^32 - 1 points", points.rows());
  return BlockTree<T>(points, num_threads);
}

// The queries in an order in which each is near the one before, those that are not finite last.
template <class T>
std::vector<IndexedPoint<T>> visiting_order(const Eigen::Ref<const PointMatrix<T>>& queries, int num_threads) {
  require(queries.rows() < static_cast<Eigen::Index>(no_id), "queries", "fewer than 2^32 - 1 points", queries.rows());
  std::vector<IndexedPoint<T>> order = finite_points<T>(queries);
  kd_order(order, num_threads);
  for (Eigen::Index i = 0; order.size() < static_cast<std::size_t>(queries.rows()); ++i) {
    if (queries.row(i).allFinite()) continue;
    order.push_back({{queries(i, 0), queries(i, 1), queries(i, 2)}, static_cast<std::uint32_t>(i)});
  }
  return order;
}

template <class T>
Eigen::Vector3d position(const IndexedPoint<T>& point) {
  return {point.p[0], point.p[1], point.p[2]};
}

void require_distance(const char* name, double distance) {
  require(distance >= 0, name, "a distance of at least 0", distance);
}

}  // namespace

struct KdTree::Impl {
  std::int64_t size;
  std::variant<BlockTree<float>, BlockTree<double>> tree;

  template <class T>
  Neighbors query(const Eigen::Ref<const PointMatrix<T>>& queries, int k, double max_distance, int num_threads) const {
    require(k >= 1, "k", "at least 1", k);
    require_distance("max_distance", max_distance);
    const std::vector<IndexedPoint<T>> order = visiting_order<T>(queries, num_threads);
    Neighbors result;
    result.distances.resize(queries.rows(), k);
    result.indices.resize(queries.rows(), k);
    const auto run = [&](const auto& blocks) {
      parallel_blocks(queries.rows(), queries_per_block, num_threads, [&](auto, std::int64_t begin, std::int64_t end) {
        WarmSearch search(blocks, k, max_distance);
        for (std::int64_t i = begin; i < end; ++i) {
          const IndexedPoint<T>& point = order[static_cast<std::size_t>(i)];
          const int found = search(position(point));
          double* distances = result.distances.row(point.id).data();
          std::int64_t* indices = result.indices.row(point.id).data();
          for (int j = 0; j < found; ++j) {
            distances[j] = std::sqrt(search[j].d2);
            indices[j] = search[j].id;
          }
          std::fill(distances + found, distances + k, infinity);
          std::fill(indices + found, indices + k, size);
        }
      });
    };
    std::visit(run, tree);
    return result;
  }

  template <class T>
  RadiusNeighbors query_radius(const Eigen::Ref<const PointMatrix<T>>& queries, double radius, int num_threads) const {
    require_distance("radius", radius);
    const double bound = squared_bound(radius);
    const std::vector<IndexedPoint<T>> order = visiting_order<T>(queries, num_threads);
    const auto num_queries = static_cast<std::size_t>(queries.rows());
    RadiusNeighbors result;
    result.offsets.assign(num_queries + 1, 0);

    // The searches run in visiting order; then each query's neighbours move to the caller's order.
    std::vector<std::vector<Found>> found_by_block((num_queries + queries_per_block - 1) / queries_per_block);
    const auto run = [&](const auto& blocks) {
      parallel_blocks(queries.rows(), queries_per_block, num_threads, [&](auto block, auto begin, auto end) {
        std::vector<Found>& found = found_by_block[static_cast<std::size_t>(block)];
        for (std::int64_t i = begin; i < end; ++i) {
          const IndexedPoint<T>& point = order[static_cast<std::size_t>(i)];
          const std::size_t before = found.size();
          WithinRadius within(bound, found);
          blocks.search(position(point), within);
          std::sort(found.begin() + static_cast<std::ptrdiff_t>(before), found.end());
          result.offsets[point.id + 1] = static_cast<std::int64_t>(found.size() - before);
        }
      });
    };
    std::visit(run, tree);
    for (std::size_t i = 0; i < num_queries; ++i) result.offsets[i + 1] += result.offsets[i];
    result.indices.resize(static_cast<std::size_t>(result.offsets.back()));
    result.distances.resize(result.indices.size());
    parallel_blocks(queries.rows(), queries_per_block, num_threads, [&](auto block, auto begin, auto end) {
      auto found = found_by_block[static_cast<std::size_t>(block)].cbegin();
      for (std::int64_t i = begin; i < end; ++i) {
        const std::uint32_t row = order[static_cast<std::size_t>(i)].id;
        for (auto j = static_cast<std::size_t>(result.offsets[row]);
             j < static_cast<std::size_t>(result.offsets[row + 1]); ++j, ++found) {
          result.indices[j] = found->id;
          result.distances[j] = std::sqrt(found->d2);
        }
      }
    });
    return result;
  }
};

KdTree::KdTree(const PointsRef& points, int num_threads)
    : impl_(new Impl{points.rows(), make_tree<float>(points, num_threads)}) {}
KdTree::KdTree(const PointsDoubleRef& points, int num_threads)
    : impl_(new Impl{points.rows(), make_tree<double>(points, num_threads)}) {}
KdTree::~KdTree() = default;
KdTree::KdTree(KdTree&&) noexcept = default;
KdTree& KdTree::operator=(KdTree&&) noexcept = default;

std::int64_t KdTree::size() const { return impl_->size; }

Neighbors KdTree::query(const PointsRef& queries, int k, double max_distance, int num_threads) const {
  return impl_->query<float>(queries, k, max_distance, num_threads);
}
Neighbors KdTree::query(const PointsDoubleRef& queries, int k, double max_distance, int num_threads) const {
  return impl_->query<double>(queries, k, max_distance, num_threads);
}

RadiusNeighbors KdTree::query_radius(const PointsRef& queries, double radius, int num_threads) const {
  return impl_->query_radius<float>(queries, radius, num_threads);
}
RadiusNeighbors KdTree::query_radius(const PointsDoubleRef& queries, double radius, int num_threads) const {
  return impl_->query_radius<double>(queries, radius, num_threads);
}

int KdTree::nearest(const Eigen::Vector3d& query, int k, double max_distance, std::int64_t* indices,
                    double* squared_distances) const {
  require(k >= 1, "k", "at least 1", k);
  require_distance("max_distance", max_distance);
  constexpr int small_k = 32;
  std::array<Found, small_k> on_stack;
  std::vector<Found> on_heap(k > small_k ? static_cast<std::size_t>(k) : 0);
  Found* found = k > small_k ? on_heap.data() : on_stack.data();
  KNearest nearest(k, squared_bound(max_distance), found);
  std::visit([&](const auto& blocks) { blocks.search(query, nearest); }, impl_->tree);
  for (int j = 0; j < nearest.size(); ++j) {
    indices[j] = found[j].id;
    squared_distances[j] = found[j].d2;
  }
  return nearest.size();
}

}  // namespace nacre
