#include "registration/range_image.hpp"

#include <algorithm>
#include <cmath>

#include "base/numbers.hpp"
#include "registration/limits.hpp"

namespace nacre {

FreeSpace::FreeSpace(const PointsRef& points, const Eigen::Vector3d& viewpoint) : viewpoint_(viewpoint) {
  std::vector<Eigen::Vector3d> finite;
  finite.reserve(static_cast<std::size_t>(points.rows()));
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    if (!points.row(i).allFinite()) continue;
    finite.push_back(points.row(i).transpose().cast<double>());
    middle += finite.back();
  }
  if (!finite.empty()) middle /= static_cast<double>(finite.size());
  axis_ = (middle - viewpoint_).normalized();
  if (finite.empty() || !(axis_.norm() > 0.5)) {
    axis_ = Eigen::Vector3d::UnitZ();
    return;
  }
  right_ = axis_.unitOrthogonal();
  down_ = axis_.cross(right_);

  std::vector<Projection> projections;
  projections.reserve(finite.size());
  Eigen::Vector2d low = Eigen::Vector2d::Constant(infinity<float>), high = -low;
  double squares = 0.0;
  for (const Eigen::Vector3d& point : finite) {
    projections.push_back(project(point));
    low = low.cwiseMin(projections.back().uv);
    high = high.cwiseMax(projections.back().uv);
    squares += (point - middle).cross(axis_).squaredNorm();
  }
  radius_ = std::sqrt(squares / static_cast<double>(finite.size()));
  // A cloud fills about half of the rectangle around it.
  const Eigen::Vector2d extent = (high - low).cwiseMax(1e-9);
  cell_ = std::max(
      std::sqrt(0.5 * extent.prod() * registration_limits::points_per_cell / static_cast<double>(finite.size())),
      extent.maxCoeff() / registration_limits::most_cells);
  first_ = low.array() - (registration_limits::uncertain_cells + 1) * cell_;
  width_ = static_cast<int>(extent.x() / cell_) + 2 * registration_limits::uncertain_cells + 3;
  height_ = static_cast<int>(extent.y() / cell_) + 2 * registration_limits::uncertain_cells + 3;
  fill_cells(projections);
}

void FreeSpace::fill_cells(const std::vector<Projection>& projections) {
  struct Range {
    float nearest = infinity<float>, farthest = -infinity<float>;
  };
  std::vector<Range> single(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  for (const Projection& projection : projections) {
    Range& range = single[index_of(projection)];
    range.nearest = std::min(range.nearest, static_cast<float>(projection.range));
    range.farthest = std::max(range.farthest, static_cast<float>(projection.range));
  }
  cells_.resize(single.size());
  for (int row = registration_limits::uncertain_cells; row < height_ - registration_limits::uncertain_cells; ++row) {
    for (int column = registration_limits::uncertain_cells; column < width_ - registration_limits::uncertain_cells;
         ++column) {
      Cell cell;
      int filled = 0;
      for (int v = -registration_limits::uncertain_cells; v <= registration_limits::uncertain_cells; ++v) {
        for (int u = -registration_limits::uncertain_cells; u <= registration_limits::uncertain_cells; ++u) {
          const Range& range = single[static_cast<std::size_t>((row + v) * width_ + column + u)];
          if (!(range.nearest < infinity<float>)) continue;
          cell.is_reached = true;
          if (std::max(std::abs(u), std::abs(v)) > 1) continue;
          ++filled;
          cell.nearest = std::min(cell.nearest, range.nearest);
          cell.farthest = std::max(cell.farthest, range.farthest);
        }
      }
      cell.is_known = filled >= registration_limits::least_filled_cells;
      cells_[static_cast<std::size_t>(row * width_ + column)] = cell;
    }
  }
}

FreeSpace::Projection FreeSpace::project(const Eigen::Vector3d& point) const {
  const Eigen::Vector3d ray = point - viewpoint_;
  const Eigen::Vector2d across(ray.dot(right_), ray.dot(down_));
  const double length = across.norm();
  const double scale = length > 0.0 ? std::atan2(length, ray.dot(axis_)) / length : 0.0;
  return {across * scale, ray.norm()};
}

// The number of the cell, that of one that nothing reaches where there is none.
std::size_t FreeSpace::index_of(const Projection& projection) const {
  const double column = (projection.uv.x() - first_.x()) / cell_, row = (projection.uv.y() - first_.y()) / cell_;
  if (!(column >= 0.0 && column < width_ && row >= 0.0 && row < height_)) return 0;
  return static_cast<std::size_t>(static_cast<int>(row) * width_ + static_cast<int>(column));
}

FreeSpace::Seen FreeSpace::look(const Eigen::Vector3d& point, double tolerance) const {
  if (cells_.empty()) return Seen::unknown;
  const Projection projection = project(point);
  const Cell& cell = cells_[index_of(projection)];
  if (!cell.is_reached) return Seen::beyond;
  if (!cell.is_known) return Seen::unknown;
  if (projection.range < static_cast<double>(cell.nearest) - tolerance) return Seen::free;
  return projection.range > static_cast<double>(cell.farthest) + tolerance ? Seen::hidden : Seen::near;
}

}  // namespace nacre
