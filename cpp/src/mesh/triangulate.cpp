// Each point's neighbours in the Delaunay triangulation of its tangent plane make a fan of triangles; those on which
// all three corners agree are the surface (Gopi, Krishnan and Silva 2000); where they leave room, those on which two
// do, and those of one alone that close a notch. Small holes that remain are closed.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/check.hpp"
#include "base/limits.hpp"
#include "base/parallel.hpp"
#include "mesh/limits.hpp"
#include "mesh/spacing.hpp"
#include "nacre/kdtree.hpp"
#include "nacre/mesh.hpp"

namespace nacre {
namespace {

using Corners = std::array<std::int32_t, 3>;
using Vector2 = Eigen::Vector2d;
using Vector3 = Eigen::Vector3d;

constexpr std::int32_t nobody = -1;
constexpr std::int64_t points_per_block = 256;

// The neighbours around a point in turn, counter-clockwise; `nobody` where two have no triangle between them.
class Fan {
 public:
  void add(std::int32_t neighbor) { ring_[static_cast<std::size_t>(size_++)] = neighbor; }
  int size() const { return size_; }
  std::int32_t operator[](int i) const { return ring_[static_cast<std::size_t>(i < size_ ? i : i - size_)]; }
  bool has(std::int32_t from, std::int32_t to) const {
    for (int i = 0; i < size_; ++i) {
      if ((*this)[i] == from && (*this)[i + 1] == to) return true;
    }
    return false;
  }

 private:
  std::array<std::int32_t, 2 * mesh_limits::most_neighbors + 8> ring_;
  int size_ = 0;
};

// The Voronoi cell of a point among its neighbours in the tangent plane: a convex polygon, counter-clockwise.
class VoronoiCell {
 public:
  explicit VoronoiCell(double reach) {
    const double side = 2.0 * reach;
    corners_ = {{{-side, -side}, nobody}, {{side, -side}, nobody}, {{side, side}, nobody}, {{-side, side}, nobody}};
  }

  // Cuts off what is nearer to a neighbour: the nearest first, and each by a little more than the one before, so that
  // where four points lie on a circle all are neighbours.
  void cut(const Vector2& place, std::int32_t neighbor) {
    const double half = 0.5 * (1.0 - mesh_limits::same_circle * num_cut_) * place.squaredNorm();
    if (place == last_) return;  // two points in one place
    last_ = place;
    ++num_cut_;
    kept_.clear();
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      const Corner &a = corners_[i], &b = corners_[i + 1 == corners_.size() ? 0 : i + 1];
      const double beyond_a = a.place.dot(place) - half, beyond_b = b.place.dot(place) - half;
      if (beyond_a <= 0.0) kept_.push_back(a);
      if ((beyond_a <= 0.0) == (beyond_b <= 0.0)) continue;
      const Vector2 crossing = a.place + (b.place - a.place) * (beyond_a / (beyond_a - beyond_b));
      kept_.push_back({crossing, beyond_a <= 0.0 ? neighbor : a.next_edge});
    }
    std::swap(corners_, kept_);
  }

  // Whether a neighbour so far away may cut something off.
  bool reaches(double squared_distance) const {
    const double least = 0.25 * (1.0 - mesh_limits::same_circle * num_cut_) * squared_distance;
    return std::any_of(corners_.begin(), corners_.end(),
                       [&](const Corner& corner) { return corner.place.squaredNorm() >= least; });
  }

  // A corner between the edges of two neighbours is the middle of the circle through both and the point.
  Fan fan(double largest_circle) const {
    Fan result;
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      const Corner &edge = corners_[i], &next = corners_[i + 1 == corners_.size() ? 0 : i + 1];
      if (edge.next_edge == nobody) continue;
      result.add(edge.next_edge);
      if (next.next_edge == nobody || next.place.norm() > largest_circle) result.add(nobody);
    }
    return result;
  }

 private:
  struct Corner {
    Vector2 place;
    std::int32_t next_edge;  // whose edge goes on from here
  };
  std::vector<Corner> corners_, kept_;
  Vector2 last_ = Vector2::Zero();  // that was cut for
  int num_cut_ = 0;
};

// Edges that triangles have, each from its first corner to its second.
class EdgeSet {
 public:
  explicit EdgeSet(std::size_t most) {
    std::size_t capacity = 64;
    while (capacity < 2 * most) capacity *= 2;
    slots_.assign(capacity, none);
  }
  bool has(std::int32_t from, std::int32_t to) const { return slots_[place_of(key(from, to))] != none; }
  void add(std::int32_t from, std::int32_t to) { slots_[place_of(key(from, to))] = key(from, to); }

 private:
  static constexpr std::uint64_t none = ~std::uint64_t{0};
  static std::uint64_t key(std::int32_t from, std::int32_t to) {
    return static_cast<std::uint64_t>(from) << 32U | static_cast<std::uint32_t>(to);
  }
  std::size_t place_of(std::uint64_t edge) const {
    std::size_t place = static_cast<std::size_t>((edge * 0x9E3779B97F4A7C15U) >> 20U) & (slots_.size() - 1);
    while (slots_[place] != none && slots_[place] != edge) place = (place + 1) & (slots_.size() - 1);
    return place;
  }
  std::vector<std::uint64_t> slots_;
};

class Triangulation {
 public:
  Triangulation(const PointsRef& points, const PointsRef& normals, int num_threads)
      : points_(points),
        normals_(normals),
        fans_(static_cast<std::size_t>(points.rows())),
        spacing_(static_cast<std::size_t>(points.rows()), 0.0F) {
    for (std::int32_t i = 0; i < points_.rows(); ++i) normals_.row(i).normalize();
    make_fans(num_threads);
  }

  std::vector<Corners> surface() {
    std::vector<Corners> doubtful, lone;
    for (std::int32_t i = 0; i < points_.rows(); ++i) collect(i, doubtful, lone);
    EdgeSet edges(3 * (triangles_.size() + doubtful.size() + lone.size()) + 1);
    for (const Corners& corners : triangles_) {
      for (std::size_t k = 0; k < 3; ++k) edges.add(corners[k], corners[(k + 1) % 3]);
    }
    for (const Corners& corners : doubtful) add(corners, edges);
    for (const Corners& corners : lone) {
      if (num_shared(corners, edges) >= 2) add(corners, edges);
    }
    const auto is_flake = [&](const Corners& corners) { return num_shared(corners, edges) == 0; };
    triangles_.erase(std::remove_if(triangles_.begin(), triangles_.end(), is_flake), triangles_.end());
    close_holes(edges);
    return std::move(triangles_);
  }

 private:
  Vector3 point(std::int32_t i) const { return points_.row(i).transpose().cast<double>(); }
  Vector3 normal(std::int32_t i) const { return normals_.row(i).transpose().cast<double>(); }

  void make_fans(int num_threads) {
    const KdTree tree(points_, num_threads);
    parallel_blocks(points_.rows(), points_per_block, num_threads,
                    [&](std::int64_t, std::int64_t begin, std::int64_t end) {
                      for (std::int64_t i = begin; i < end; ++i) make_fan(tree, static_cast<std::int32_t>(i));
                    });
  }

  void make_fan(const KdTree& tree, std::int32_t i) {
    constexpr int k = mesh_limits::most_neighbors + 1;  // and itself
    std::array<std::int64_t, k> indices;
    std::array<double, k> squared;
    const int count =
        normal(i).squaredNorm() > 0.0 ? tree.nearest(point(i), k, KdTree::infinity, indices.data(), squared.data()) : 0;
    if (count <= mesh_limits::spacing_neighbors) return;
    const double spacing = spacing_around(squared.data()), largest_circle = mesh_limits::largest_circle * spacing;
    spacing_[static_cast<std::size_t>(i)] = static_cast<float>(spacing);
    if (!(spacing > 0.0)) return;

    const Vector3 up = normal(i), right = up.unitOrthogonal(), ahead = up.cross(right);
    VoronoiCell cell(largest_circle);
    for (std::size_t n = 0; n < static_cast<std::size_t>(count); ++n) {
      const auto j = static_cast<std::int32_t>(indices[n]);
      if (!(normal(j).dot(up) >= base_limits::same_side_cosine)) continue;
      if (squared[n] == 0.0 && j < i) return;  // the other point in this place has the triangles
      const Vector3 step = point(j) - point(i);
      const Vector2 along(step.dot(right), step.dot(ahead));
      const double length = along.norm();
      if (!(length > 0.0) || std::abs(step.dot(up)) > mesh_limits::steepest * length) continue;
      if (!cell.reaches(squared[n])) break;
      cell.cut(along * (step.norm() / length), j);  // as far away as it is
    }
    fans_[static_cast<std::size_t>(i)] = cell.fan(largest_circle);
  }

  // The triangles of a point's fan: of the surface where both others have them, doubtful where one has, else lone.
  void collect(std::int32_t i, std::vector<Corners>& doubtful, std::vector<Corners>& lone) {
    const Fan& fan = fans_[static_cast<std::size_t>(i)];
    for (int k = 0; k < fan.size(); ++k) {
      const std::int32_t a = fan[k], b = fan[k + 1];
      if (a == nobody || b == nobody || a == b) continue;
      const bool has_a = fans_[static_cast<std::size_t>(a)].has(b, i),
                 has_b = fans_[static_cast<std::size_t>(b)].has(i, a);
      if (has_a && has_b) {
        if (i < a && i < b) triangles_.push_back({i, a, b});
      } else if (has_a || has_b) {
        if (i < (has_a ? a : b)) doubtful.push_back({i, a, b});
      } else {
        lone.push_back({i, a, b});
      }
    }
  }

  // Edges that have a triangle on their other side.
  static int num_shared(const Corners& corners, const EdgeSet& edges) {
    int count = 0;
    for (std::size_t k = 0; k < 3; ++k) count += edges.has(corners[(k + 1) % 3], corners[k]) ? 1 : 0;
    return count;
  }

  // Where none of its edges is another's.
  bool add(const Corners& corners, EdgeSet& edges) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (edges.has(corners[k], corners[(k + 1) % 3])) return false;
    }
    for (std::size_t k = 0; k < 3; ++k) edges.add(corners[k], corners[(k + 1) % 3]);
    triangles_.push_back(corners);
    return true;
  }

  // Along the border of a hole, the point after each; `nobody` where there is none, or more than one.
  std::vector<std::int32_t> borders(const EdgeSet& edges) const {
    constexpr std::int32_t several = -2;
    std::vector<std::int32_t> after(fans_.size(), nobody);
    for (const Corners& corners : triangles_) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::int32_t from = corners[k], to = corners[(k + 1) % 3];
        if (edges.has(to, from)) continue;
        std::int32_t& next = after[static_cast<std::size_t>(to)];
        next = next == nobody ? from : several;
      }
    }
    std::replace(after.begin(), after.end(), several, nobody);
    return after;
  }

  void close_holes(EdgeSet& edges) {
    std::vector<std::int32_t> after = borders(edges), hole;
    for (std::int32_t first = 0; first < static_cast<std::int32_t>(after.size()); ++first) {
      hole.clear();
      std::int32_t i = first;
      do {
        hole.push_back(i);
        i = after[static_cast<std::size_t>(i)];
      } while (i != nobody && i != first && hole.size() <= mesh_limits::longest_hole);
      if (i != first || hole.size() < 3 || hole.size() > mesh_limits::longest_hole) continue;
      for (const std::int32_t corner : hole) after[static_cast<std::size_t>(corner)] = nobody;
      close(hole, edges);
    }
  }

  // The triangle of the smallest circle first.
  void close(std::vector<std::int32_t>& hole, EdgeSet& edges) {
    while (hole.size() >= 3) {
      const std::size_t size = hole.size();
      std::size_t best = size;
      double smallest = 0.0;
      for (std::size_t k = 0; k < size; ++k) {
        const double radius = filling(hole[(k + size - 1) % size], hole[k], hole[(k + 1) % size]);
        if (radius > 0.0 && (best == size || radius < smallest)) {
          best = k;
          smallest = radius;
        }
      }
      if (best == size) return;
      if (!add({hole[(best + size - 1) % size], hole[best], hole[(best + 1) % size]}, edges)) return;
      if (size == 3) return;
      hole.erase(hole.begin() + static_cast<std::ptrdiff_t>(best));
    }
  }

  // The radius of the circle through three points of a border, where a triangle may close it; else 0.
  double filling(std::int32_t a, std::int32_t b, std::int32_t c) const {
    const Vector3 ab = point(b) - point(a), bc = point(c) - point(b), ca = point(a) - point(c), across = ab.cross(bc);
    const Vector3 mean = normal(a) + normal(b) + normal(c);
    const double twice_area = across.norm();
    if (!(across.dot(mean) > mesh_limits::least_turned * twice_area * mean.norm())) return 0.0;
    const double radius = ab.norm() * bc.norm() * ca.norm() / (2.0 * twice_area);
    return radius <= mesh_limits::largest_filling * static_cast<double>(spacing_[static_cast<std::size_t>(b)]) ? radius
                                                                                                               : 0.0;
  }

  PointsRef points_;
  Points normals_;
  std::vector<Fan> fans_;
  std::vector<float> spacing_;
  std::vector<Corners> triangles_;
};

}  // namespace

Triangles triangulate(const PointsRef& points, const PointsRef& normals, int num_threads) {
  require(normals.rows() == points.rows(), "normals", "one row per point", normals.rows());
  const std::vector<Corners> corners = Triangulation(points, normals, resolve_threads(num_threads)).surface();
  Triangles triangles(static_cast<Eigen::Index>(corners.size()), 3);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k)
      triangles(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) = corners[i][k];
  }
  return triangles;
}

}  // namespace nacre
