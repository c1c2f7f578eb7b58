// Which points of a model are a surface. Two layers that face one way within some spacings of each other cannot both be
// seen: the surer one stays. Points that belong to no surface, or have a normal that contradicts it, have no triangles.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/check.hpp"
#include "base/parallel.hpp"
#include "mesh/limits.hpp"
#include "mesh/spacing.hpp"
#include "nacre/kdtree.hpp"
#include "nacre/mesh.hpp"

namespace nacre {
namespace {

constexpr std::int64_t cover_block = 256;

// Points above or below one.
class Layer {
 public:
  void add(double angle, float confidence) {
    angles_[static_cast<std::size_t>(size_++)] = angle;
    sum_ += static_cast<double>(confidence);
  }
  bool covers(float confidence) { return size_ > 2 && static_cast<double>(confidence) * size_ < sum_ && surrounds(); }

 private:
  bool surrounds() {
    const auto end = angles_.begin() + size_;
    std::sort(angles_.begin(), end);
    double gap = angles_[0] + 2.0 * M_PI - *(end - 1);
    for (auto angle = angles_.begin(); angle + 1 != end; ++angle) gap = std::max(gap, *(angle + 1) - *angle);
    return gap < M_PI;
  }
  std::array<double, mesh_limits::covering_neighbors> angles_;
  int size_ = 0;
  double sum_ = 0.0;  // of confidence
};

struct Surface {
  const PointsRef& points;
  const Points& normals;
  const ValuesRef& confidence;

  Eigen::Vector3d point(std::int64_t i) const { return points.row(i).transpose().cast<double>(); }
  Eigen::Vector3d normal(std::int64_t i) const { return normals.row(i).transpose().cast<double>(); }

  bool is_covered(const KdTree& tree, std::int64_t i, std::int64_t* indices, double* squared) const {
    constexpr int k = mesh_limits::covering_neighbors + 1;  // and itself
    const int count = tree.nearest(point(i), k, KdTree::infinity, indices, squared);
    if (count <= mesh_limits::spacing_neighbors) return false;
    const double spacing = spacing_around(squared);
    const Eigen::Vector3d up = normal(i), right = up.unitOrthogonal(), ahead = up.cross(right);
    Layer above, below;
    for (int n = 1; n < count; ++n) {
      const std::int64_t j = indices[n];
      if (j == i || !(normal(j).dot(up) > mesh_limits::covering_cosine)) continue;
      const Eigen::Vector3d step = point(j) - point(i);
      const double height = step.dot(up), x = step.dot(right), y = step.dot(ahead);
      if (!(std::min(std::abs(height), std::abs(step.dot(normal(j)))) > mesh_limits::least_layer * spacing)) continue;
      if (std::hypot(x, y) > std::max(mesh_limits::covering_width * spacing, std::abs(height))) continue;
      (height > 0.0 ? above : below).add(std::atan2(y, x), confidence(j));
    }
    return above.covers(confidence(i)) || below.covers(confidence(i));
  }
};

std::vector<std::int64_t> uncovered(const Surface& surface, int num_threads) {
  const auto size = static_cast<std::size_t>(surface.points.rows());
  const KdTree tree(surface.points, num_threads);
  std::vector<std::uint8_t> is_kept(size, 0);
  parallel_blocks(
      surface.points.rows(), cover_block, num_threads, [&](std::int64_t, std::int64_t begin, std::int64_t end) {
        std::array<std::int64_t, mesh_limits::covering_neighbors + 1> indices;
        std::array<double, mesh_limits::covering_neighbors + 1> squared;
        for (std::int64_t i = begin; i < end; ++i) {
          is_kept[static_cast<std::size_t>(i)] =
              surface.normal(i).squaredNorm() > 0.0 && !surface.is_covered(tree, i, indices.data(), squared.data());
        }
      });
  std::vector<std::int64_t> rows;
  for (std::size_t i = 0; i < size; ++i) {
    if (is_kept[i] != 0) rows.push_back(static_cast<std::int64_t>(i));
  }
  return rows;
}

}  // namespace

PointFlags on_surface(const PointsRef& points, const PointsRef& normals, const ValuesRef& confidence, int num_threads) {
  require(normals.rows() == points.rows(), "normals", "one row per point", normals.rows());
  require(confidence.size() == points.rows(), "confidence", "one value per point", confidence.size());
  num_threads = resolve_threads(num_threads);
  const Points directions = normals.rowwise().normalized();
  const std::vector<std::int64_t> rows = uncovered({points, directions, confidence}, num_threads);
  Points kept_points(static_cast<Eigen::Index>(rows.size()), 3), kept_normals(kept_points.rows(), 3);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    kept_points.row(static_cast<Eigen::Index>(i)) = points.row(rows[i]);
    kept_normals.row(static_cast<Eigen::Index>(i)) = directions.row(rows[i]);
  }
  const PointNumbers parts = connected_parts(triangulate(kept_points, kept_normals, num_threads), kept_points.rows());
  std::vector<std::int64_t> sizes(rows.size(), 0);
  for (const std::int32_t part : parts) ++sizes[static_cast<std::size_t>(part)];
  PointFlags result = PointFlags::Zero(points.rows());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::int64_t size = sizes[static_cast<std::size_t>(parts[static_cast<Eigen::Index>(i)])];
    result[rows[i]] = size >= mesh_limits::least_part ? 1 : 0;
  }
  return result;
}

}  // namespace nacre
