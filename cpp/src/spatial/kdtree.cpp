#include "nacre/kdtree.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <variant>

#include "base/check.hpp"
#include "base/numbers.hpp"
#include "base/parallel.hpp"
#include "base/point_rows.hpp"
#include "spatial/bvh16.hpp"
#include "spatial/hilbert_order.hpp"
#include "spatial/knn_batch.hpp"

namespace nacre {
namespace {

using Tree = std::variant<BlockTree<float>, BlockTree<double>>;

template <class T>
Tree make_tree(const Eigen::Ref<const PointMatrix<T>>& points, int num_threads) {
  require(points.rows() < static_cast<Eigen::Index>(no_id), "points", "fewer than 2^32 - 1 points", points.rows());
  return BlockTree<T>(Rows<T>(points).data(), points.rows(), num_threads);
}

// Whether the queries are the points of the tree, row by row, and all of them: one that is not finite is not in it.
template <class T>
bool are_points_of(const BlockTree<T>& tree, const Rows<T>& queries, int num_threads) {
  const PointBlock<T>* const blocks = tree.view().blocks;
  std::atomic<bool> equal{queries.size() == tree.num_points()};
  parallel_blocks(equal ? tree.num_points() : 0, 4096, num_threads, [&](auto, std::int64_t begin, std::int64_t end) {
    for (std::int64_t slot = begin; slot < end && equal.load(std::memory_order_relaxed); slot += block_points) {
      const PointBlock<T>& block = blocks[slot / block_points];
      bool same = true;
      for (int lane = 0; same && lane < std::min<std::int64_t>(block_points, end - slot); ++lane) {
        const std::uint32_t id = block.id[lane];
        same = id < queries.size() && queries[id][0] == block.p[0][lane] && queries[id][1] == block.p[1][lane] &&
               queries[id][2] == block.p[2][lane];
      }
      if (!same) equal = false;
    }
  });
  return equal;
}
template <class T, class Query>
bool are_points_of(const BlockTree<T>&, const Rows<Query>&, int) {
  return false;
}

Neighbors room_for(Eigen::Index queries, int k) {
  Neighbors found;
  if (k < 1) return found;
  found.distances.resize(queries, k);
  found.indices.resize(queries, k);
  return found;
}

void require_distance(const char* name, double distance) {
  require(distance >= 0, name, "a distance of at least 0", distance);
}

}  // namespace

struct KdTree::Impl {
  std::int64_t size;
  Tree tree;

  template <class T>
  void query(const Rows<T>& queries, int k, double max_distance, int num_threads, std::int64_t* indices,
             double* distances, float* float_distances) const {
    require(k >= 1, "k", "at least 1", k);
    require_distance("max_distance", max_distance);
    require(queries.size() < static_cast<std::int64_t>(no_id), "queries", "fewer than 2^32 - 1 points", queries.size());
    const simd::NearestTask task = {k, squared_bound(max_distance), size, indices, distances, float_distances};
    std::visit([&](const auto& blocks) { answer(blocks, task, queries, num_threads); }, tree);
  }

  template <class T>
  RadiusNeighbors query_radius(const Rows<T>& queries, double radius, int num_threads) const {
    constexpr std::int64_t queries_per_block = 128;
    require_distance("radius", radius);
    require(queries.size() < static_cast<std::int64_t>(no_id), "queries", "fewer than 2^32 - 1 points", queries.size());
    const double bound = squared_bound(radius);
    const Buffer<std::uint32_t> order = spatial_order(queries.data(), queries.size(), num_threads);
    const auto num_finite = static_cast<std::int64_t>(order.size());
    RadiusNeighbors result;
    result.offsets.assign(static_cast<std::size_t>(queries.size()) + 1, 0);

    // The searches run in visiting order; then each query's neighbours move to the caller's order.
    std::vector<std::vector<Found>> found_by_block((order.size() + queries_per_block - 1) / queries_per_block);
    const auto run = [&](const auto& blocks) {
      parallel_blocks(num_finite, queries_per_block, num_threads, [&](auto block, auto begin, auto end) {
        std::vector<Found>& found = found_by_block[static_cast<std::size_t>(block)];
        for (std::int64_t i = begin; i < end; ++i) {
          const std::uint32_t row = order[static_cast<std::size_t>(i)];
          const std::size_t before = found.size();
          WithinRadius within(bound, found);
          blocks.search(queries.position(row), within);
          std::sort(found.begin() + static_cast<std::ptrdiff_t>(before), found.end());
          result.offsets[row + std::size_t{1}] = static_cast<std::int64_t>(found.size() - before);
        }
      });
    };
    std::visit(run, tree);
    for (std::size_t i = 1; i < result.offsets.size(); ++i) result.offsets[i] += result.offsets[i - 1];
    result.indices.resize(static_cast<std::size_t>(result.offsets.back()));
    result.distances.resize(result.indices.size());
    parallel_blocks(num_finite, queries_per_block, num_threads, [&](auto block, auto begin, auto end) {
      auto found = found_by_block[static_cast<std::size_t>(block)].cbegin();
      for (std::int64_t i = begin; i < end; ++i) {
        const std::size_t row = order[static_cast<std::size_t>(i)];
        for (auto j = static_cast<std::size_t>(result.offsets[row]);
             j < static_cast<std::size_t>(result.offsets[row + 1]); ++j, ++found) {
          result.indices[j] = found->id;
          result.distances[j] = std::sqrt(found->d2);
        }
      }
    });
    return result;
  }

 private:
  template <class T, class Query>
  static void answer(const BlockTree<T>& blocks, const simd::NearestTask& task, const Rows<Query>& queries,
                     int num_threads) {
    const bool in_tree_order = are_points_of(blocks, queries, num_threads);
    const Buffer<std::uint32_t> order =
        in_tree_order ? Buffer<std::uint32_t>() : spatial_order(queries.data(), queries.size(), num_threads);
    const std::int64_t num_finite = in_tree_order ? blocks.num_points() : static_cast<std::int64_t>(order.size());
    const std::int64_t per_block =
        queries_per_task(task.k, std::clamp<std::int64_t>(num_finite / 64 / 16 * 16, 128, 2048));
    parallel_blocks(num_finite, per_block, num_threads, [&](auto, std::int64_t begin, std::int64_t end) {
      GroupQueries search(blocks, task);
      for (std::int64_t first = begin; first < end; first += 16) {
        simd::QueryGroup group;
        group.size = static_cast<int>(std::min<std::int64_t>(16, end - first));
        for (int i = 0; i < group.size; ++i) {
          const auto place = static_cast<std::size_t>(first + i);
          group.row[i] = in_tree_order ? blocks.id(static_cast<std::uint32_t>(place)) : order[place];
          for (int axis = 0; axis < 3; ++axis) group.p[axis][i] = static_cast<double>(queries[group.row[i]][axis]);
        }
        search(group);
      }
    });
    if (num_finite == queries.size()) return;
    parallel_for(queries.size(), 16384, num_threads, [&](std::int64_t row) {
      if (queries.is_finite(row)) return;
      std::fill_n(task.indices + row * task.k, task.k, task.missing);
      if (task.distances != nullptr) std::fill_n(task.distances + row * task.k, task.k, infinity);
      if (task.float_distances != nullptr) {
        std::fill_n(task.float_distances + row * task.k, task.k, nacre::infinity<float>);
      }
    });
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
  Neighbors found = room_for(queries.rows(), k);
  impl_->query<float>(queries, k, max_distance, num_threads, found.indices.data(), found.distances.data(), nullptr);
  return found;
}
Neighbors KdTree::query(const PointsDoubleRef& queries, int k, double max_distance, int num_threads) const {
  Neighbors found = room_for(queries.rows(), k);
  impl_->query<double>(queries, k, max_distance, num_threads, found.indices.data(), found.distances.data(), nullptr);
  return found;
}

void KdTree::query_into(const PointsRef& queries, int k, double max_distance, int num_threads, std::int64_t* indices,
                        float* distances) const {
  impl_->query<float>(queries, k, max_distance, num_threads, indices, nullptr, distances);
}
void KdTree::query_into(const PointsDoubleRef& queries, int k, double max_distance, int num_threads,
                        std::int64_t* indices, double* distances) const {
  impl_->query<double>(queries, k, max_distance, num_threads, indices, distances, nullptr);
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
  const std::int64_t room = room_for_nearest(impl_->size, k);
  std::array<Found, few_neighbors> on_stack;
  std::vector<Found> on_heap(room > few_neighbors ? static_cast<std::size_t>(room) : 0);
  Found* found = room > few_neighbors ? on_heap.data() : on_stack.data();
  const double bound = squared_bound(max_distance);
  const int count =
      std::visit([&](const auto& blocks) { return find_nearest(blocks, query, k, bound, found); }, impl_->tree);
  for (int j = 0; j < count; ++j) {
    indices[j] = found[j].id;
    squared_distances[j] = found[j].d2;
  }
  return count;
}

}  // namespace nacre
