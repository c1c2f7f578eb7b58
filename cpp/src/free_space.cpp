#include "free_space.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace nacre {
namespace {

constexpr double points_per_cell = 6.0;
constexpr int most_cells = 256;  // across
constexpr float infinity = std::numeric_limits<float>::infinity();

bool is_finite(const PointsRef& points, Eigen::Index row) { return points.row(row).allFinite(); }

}  // namespace

FreeSpace::FreeSpace(const PointsRef& points, const Eigen::Vector3d& viewpoint) : viewpoint_(viewpoint) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Index count = 0;
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    if (!is_finite(points, i)) continue;
    sum += points.row(i).transpose().cast<double>();
    ++count;
  }
  const Eigen::Vector3d middle = count > 0 ? Eigen::Vector3d(sum / static_cast<double>(count)) : viewpoint_;
  axis_ = (middle - viewpoint_).normalized();
  if (count == 0 || !(axis_.norm() > 0.5)) {
    axis_ = Eigen::Vector3d::UnitZ();
    return;
  }
  right_ = axis_.unitOrthogonal();
  down_ = axis_.cross(right_);

  double low_u = infinity, low_v = infinity, high_u = -infinity, high_v = -infinity, squares = 0.0;
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    double u, v, range;
    const Eigen::Vector3d point = points.row(i).transpose().cast<double>();
    if (!is_finite(points, i) || !project(point, u, v, range)) continue;
    low_u = std::min(low_u, u);
    low_v = std::min(low_v, v);
    high_u = std::max(high_u, u);
    high_v = std::max(high_v, v);
    squares += (point - middle).squaredNorm() - std::pow((point - middle).dot(axis_), 2);
  }
  radius_ = std::sqrt(std::max(squares, 0.0) / static_cast<double>(count));
  const double extent = std::max({high_u - low_u, high_v - low_v, 1e-9});
  // A cloud fills about half of the rectangle around it.
  cell_ = std::sqrt(0.5 * std::max(high_u - low_u, 1e-9) * std::max(high_v - low_v, 1e-9) * points_per_cell /
                    static_cast<double>(count));
  cell_ = std::max(cell_, extent / most_cells);
  first_u_ = low_u;
  first_v_ = low_v;
  width_ = static_cast<int>((high_u - low_u) / cell_) + 1;
  height_ = static_cast<int>((high_v - low_v) / cell_) + 1;
  std::vector<Cell> single(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), {infinity, -infinity});
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    double u, v, range;
    if (!is_finite(points, i) || !project(points.row(i).transpose().cast<double>(), u, v, range)) continue;
    const auto column = static_cast<int>((u - first_u_) / cell_), row = static_cast<int>((v - first_v_) / cell_);
    Cell& cell = single[static_cast<std::size_t>(row * width_ + column)];
    cell.nearest = std::min(cell.nearest, static_cast<float>(range));
    cell.farthest = std::max(cell.farthest, static_cast<float>(range));
  }
  cells_.assign(single.size(), {infinity, -infinity});
  for (int row = 1; row + 1 < height_; ++row) {
    for (int column = 1; column + 1 < width_; ++column) {
      Cell around = {infinity, -infinity};
      int filled = 0;
      for (int k = 0; k < 9; ++k) {
        const Cell& cell = single[static_cast<std::size_t>((row + k / 3 - 1) * width_ + column + k % 3 - 1)];
        filled += cell.nearest < infinity ? 1 : 0;
        around.nearest = std::min(around.nearest, cell.nearest);
        around.farthest = std::max(around.farthest, cell.farthest);
      }
      if (filled >= 8) cells_[static_cast<std::size_t>(row * width_ + column)] = around;
    }
  }
}

bool FreeSpace::project(const Eigen::Vector3d& point, double& u, double& v, double& range) const {
  const Eigen::Vector3d ray = point - viewpoint_;
  range = ray.norm();
  if (!(range > 0.0)) return false;
  const double x = ray.dot(right_), y = ray.dot(down_), across = std::hypot(x, y);
  const double scale = across > 0.0 ? std::atan2(across, ray.dot(axis_)) / across : 0.0;
  u = x * scale;
  v = y * scale;
  return true;
}

FreeSpace::Seen FreeSpace::look(const Eigen::Vector3d& point, double tolerance) const {
  double u, v, range;
  if (width_ == 0 || !project(point, u, v, range)) return Seen::unknown;
  const double column = std::floor((u - first_u_) / cell_), row = std::floor((v - first_v_) / cell_);
  if (!(column >= 0.0 && column < width_ && row >= 0.0 && row < height_)) return Seen::unknown;
  const Cell& cell = cells_[static_cast<std::size_t>(static_cast<int>(row) * width_ + static_cast<int>(column))];
  if (!(cell.nearest < infinity)) return Seen::unknown;
  if (range < static_cast<double>(cell.nearest) - tolerance) return Seen::free;
  return range > static_cast<double>(cell.farthest) + tolerance ? Seen::hidden : Seen::near;
}

}  // namespace nacre
