#include "nacre/mesh.hpp"

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "base/check.hpp"
#include "base/numbers.hpp"
#include "base/parallel.hpp"
#include "mesh/triangle_bvh.hpp"

namespace nacre {
namespace {

using Eigen::Vector3d;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr std::int64_t block_size = 1024;

struct Triangle {
  std::array<Eigen::Vector3f, 3> corners;
  std::int32_t id;
};

// A ray as the two tests want it. Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", JCGT 2013: the
// triangle is moved and sheared so that the ray becomes the axis `along`.
class PreparedRay {
 public:
  PreparedRay(const Vector3d& origin, const Vector3d& direction) : origin_(origin) {
    direction.cwiseAbs().maxCoeff(&along_);
    across_[0] = (along_ + 1) % 3;
    across_[1] = (along_ + 2) % 3;
    scale_ = 1.0 / direction[along_];
    shear_ = {direction[across_[0]] * scale_, direction[across_[1]] * scale_};
    for (int axis = 0; axis < 3; ++axis) {
      inverse_[axis] = 1.0 / direction[axis];
      near_[static_cast<std::size_t>(axis)] = std::signbit(direction[axis]) ? 1 : 0;
    }
  }

  // Where the ray enters a box before it has gone `limit`; infinity where it does not. Boxes are padded by more than
  // the rounding, and 0 * infinity, of a ray within the plane of a side, is NaN and leaves the interval as it is.
  double entry(const BvhNode& node, double limit) const {
    double enter = 0.0, leave = limit;
    for (int axis = 0; axis < 3; ++axis) {
      const std::size_t near = near_[static_cast<std::size_t>(axis)];
      const double from = (node.corners[near][axis] - origin_[axis]) * inverse_[axis];
      const double to = (node.corners[1 - near][axis] - origin_[axis]) * inverse_[axis];
      enter = enter < from ? from : enter;
      leave = to < leave ? to : leave;
    }
    return enter <= leave ? enter : infinity<double>;
  }

  // The distance to a triangle in units of |direction|; not positive where it is missed.
  double distance(const Triangle& triangle) const {
    std::array<double, 3> x, y, z;
    for (std::size_t i = 0; i < 3; ++i) {
      const Vector3d corner = triangle.corners[i].cast<double>() - origin_;
      z[i] = corner[along_];
      x[i] = corner[across_[0]] - shear_[0] * z[i];
      y[i] = corner[across_[1]] - shear_[1] * z[i];
    }
    const double u = x[2] * y[1] - y[2] * x[1], v = x[0] * y[2] - y[0] * x[2], w = x[1] * y[0] - y[1] * x[0];
    if ((u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0)) return 0.0;
    const double determinant = u + v + w;
    if (determinant == 0.0) return 0.0;
    return (u * z[0] + v * z[1] + w * z[2]) / determinant * scale_;
  }

 private:
  Vector3d origin_, inverse_;
  Eigen::Vector2d shear_;
  double scale_;
  int along_;
  std::array<int, 2> across_;
  std::array<std::size_t, 3> near_;
};

Vector3d closest_on_segment(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  const Vector3d ab = b - a;
  const double length2 = ab.squaredNorm();
  return length2 > 0.0 ? Vector3d(a + std::clamp((p - a).dot(ab) / length2, 0.0, 1.0) * ab) : a;
}

Vector3d closest_on_triangle(const Vector3d& p, const Triangle& triangle) {
  const Vector3d a = triangle.corners[0].cast<double>(), b = triangle.corners[1].cast<double>(),
                 c = triangle.corners[2].cast<double>();
  const Vector3d normal = (b - a).cross(c - a);
  const double length2 = normal.squaredNorm();
  const Vector3d pa = a - p, pb = b - p, pc = c - p;
  if (length2 > 0.0 && normal.dot(pa.cross(pb)) >= 0.0 && normal.dot(pb.cross(pc)) >= 0.0 &&
      normal.dot(pc.cross(pa)) >= 0.0) {
    return p + normal * (normal.dot(pa) / length2);
  }
  Vector3d best = closest_on_segment(p, a, b);
  for (const Vector3d& point : {closest_on_segment(p, b, c), closest_on_segment(p, c, a)}) {
    if ((point - p).squaredNorm() < (best - p).squaredNorm()) best = point;
  }
  return best;
}

void check_mesh(const PointsRef& vertices, const TrianglesRef& triangles) {
  require(triangles.rows() > 0, "triangles", "at least one triangle", triangles.rows());
  require(vertices.allFinite(), "vertices", "finite", "NaN or infinity");
  const std::int32_t smallest = triangles.minCoeff(), largest = triangles.maxCoeff();
  require(smallest >= 0, "triangles", "vertex indices from 0", smallest);
  require(largest < vertices.rows(), "triangles", "indices of " + std::to_string(vertices.rows()) + " vertices",
          largest);
}

std::vector<Triangle> gather(const PointsRef& vertices, const TrianglesRef& triangles) {
  std::vector<Triangle> gathered(static_cast<std::size_t>(triangles.rows()));
  for (Eigen::Index i = 0; i < triangles.rows(); ++i) {
    Triangle& triangle = gathered[static_cast<std::size_t>(i)];
    triangle.id = static_cast<std::int32_t>(i);
    for (int corner = 0; corner < 3; ++corner) {
      triangle.corners[static_cast<std::size_t>(corner)] = vertices.row(triangles(i, corner)).transpose();
    }
  }
  return gathered;
}

Box box_of(const Triangle& triangle) {
  Box box;
  for (const Eigen::Vector3f& corner : triangle.corners) box.extend(corner);
  return box;
}

// Boxes a little too large, so that the rounding of the box test never hides a hit of the triangle test.
std::vector<Box> padded_boxes(const std::vector<Triangle>& triangles) {
  std::vector<Box> boxes;
  boxes.reserve(triangles.size());
  float largest = 0.0F;
  for (const Triangle& triangle : triangles) {
    boxes.push_back(box_of(triangle));
    largest = std::max({largest, boxes.back().lower.cwiseAbs().maxCoeff(), boxes.back().upper.cwiseAbs().maxCoeff()});
  }
  const Eigen::Vector3f pad = Eigen::Vector3f::Constant(2e-7F * largest);
  for (Box& box : boxes) {
    box.lower -= pad;
    box.upper += pad;
  }
  return boxes;
}

}  // namespace

struct MeshTree::Impl {
  explicit Impl(std::vector<Triangle> input) : bvh(padded_boxes(input)), triangles(std::move(input)) {
    sorted.reserve(triangles.size());
    for (const std::int32_t id : bvh.order()) sorted.push_back(triangles[static_cast<std::size_t>(id)]);
    Box box;
    for (const Triangle& triangle : triangles) box.extend(box_of(triangle));
    lower = box.lower.cast<double>();
    upper = box.upper.cast<double>();
  }

  Bvh bvh;
  std::vector<Triangle> triangles;  // in the caller's order
  std::vector<Triangle> sorted;     // leaf after leaf
  Vector3d lower, upper;
};

MeshTree::MeshTree(const PointsRef& vertices, const TrianglesRef& triangles) {
  check_mesh(vertices, triangles);
  impl_ = std::make_unique<Impl>(gather(vertices, triangles));
}
MeshTree::~MeshTree() = default;
MeshTree::MeshTree(MeshTree&&) noexcept = default;
MeshTree& MeshTree::operator=(MeshTree&&) noexcept = default;

MeshTree::Hit MeshTree::cast(const Vector3d& origin, const Vector3d& direction) const {
  if (!origin.allFinite() || !direction.allFinite() || direction.isZero(0.0)) return {};
  const PreparedRay ray(origin, direction);
  Hit hit;
  double nearest = infinity<double>;
  impl_->bvh.walk([&](const BvhNode& node) { return ray.entry(node, nearest); }, [&] { return nearest; },
                  [&](std::int32_t first, std::int32_t count) {
                    for (std::int32_t i = first; i < first + count; ++i) {
                      const Triangle& triangle = impl_->sorted[static_cast<std::size_t>(i)];
                      const double distance = ray.distance(triangle);
                      if (!(distance > 0.0) || distance > nearest) continue;
                      if (distance < nearest || triangle.id < hit.triangle) hit = {distance, triangle.id};
                      nearest = distance;
                    }
                  });
  return hit;
}

MeshTree::Closest MeshTree::closest(const Vector3d& point) const {
  if (!point.allFinite()) return {Vector3d::Constant(nan), -1, nan};
  Closest best;
  double nearest = infinity<double>;
  const auto box_distance = [&](const BvhNode& node) {
    const Vector3d outside = (node.corners[0].cast<double>() - point)
                                 .cwiseMax(point - node.corners[1].cast<double>())
                                 .cwiseMax(Vector3d::Zero());
    return outside.squaredNorm();
  };
  impl_->bvh.walk(
      box_distance, [&] { return nearest; },
      [&](std::int32_t first, std::int32_t count) {
        for (std::int32_t i = first; i < first + count; ++i) {
          const Triangle& triangle = impl_->sorted[static_cast<std::size_t>(i)];
          const Vector3d candidate = closest_on_triangle(point, triangle);
          const double distance = (candidate - point).squaredNorm();
          if (distance > nearest || (distance == nearest && triangle.id > best.triangle)) continue;
          nearest = distance;
          best.point = candidate;
          best.triangle = triangle.id;
        }
      });
  if (best.triangle < 0) return {Vector3d::Constant(nan), -1, nan};
  best.distance = std::sqrt(nearest);
  return best;
}

MeshTree::Hits MeshTree::cast(const PointsDoubleRef& origins, const PointsDoubleRef& directions,
                              int num_threads) const {
  require(origins.rows() == directions.rows(), "directions", std::to_string(origins.rows()) + " rows, one per origin",
          directions.rows());
  Hits hits{Eigen::VectorXd(origins.rows()), Eigen::Matrix<std::int32_t, Eigen::Dynamic, 1>(origins.rows())};
  parallel_for(origins.rows(), block_size, num_threads, [&](Eigen::Index i) {
    const Hit hit = cast(Vector3d(origins.row(i)), Vector3d(directions.row(i)));
    hits.distances[i] = hit.triangle >= 0 ? hit.distance : nan;
    hits.triangles[i] = hit.triangle;
  });
  return hits;
}

MeshTree::ClosestPoints MeshTree::closest(const PointsDoubleRef& points, int num_threads) const {
  const Eigen::Index n = points.rows();
  ClosestPoints result{PointsDouble(n, 3), PointsDouble(n, 3), Eigen::VectorXd(n),
                       Eigen::Matrix<std::int32_t, Eigen::Dynamic, 1>(n)};
  parallel_for(n, block_size, num_threads, [&](Eigen::Index i) {
    const Closest found = closest(Vector3d(points.row(i)));
    result.points.row(i) = found.point.transpose();
    result.normals.row(i) = found.triangle >= 0 ? normal(found.triangle) : found.point;
    result.distances[i] = found.distance;
    result.triangles[i] = found.triangle;
  });
  return result;
}

Vector3d MeshTree::normal(std::int32_t triangle) const {
  const auto& corners = impl_->triangles[static_cast<std::size_t>(triangle)].corners;
  const Vector3d a = corners[0].cast<double>();
  const Vector3d normal = (corners[1].cast<double>() - a).cross(corners[2].cast<double>() - a);
  const double length = normal.norm();
  return length > 0.0 ? Vector3d(normal / length) : Vector3d::Zero();
}

const Vector3d& MeshTree::lower() const { return impl_->lower; }
const Vector3d& MeshTree::upper() const { return impl_->upper; }

}  // namespace nacre
