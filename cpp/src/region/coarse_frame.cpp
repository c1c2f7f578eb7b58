#include "region/coarse_frame.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "camera/limits.hpp"
#include "region/limits.hpp"

namespace nacre {
namespace {

int side_of_cells(int width, int height, const CellBudget& budget) {
  int side = 1;
  while ((width / side) * (height / side) > budget.most_cells && side < budget.largest_step) ++side;
  return side;
}

struct Offset {
  int u, v;
  int rank() const { return u * u + v * v; }
};

// From the corner of a cell to its pixels, in half pixels from its middle: the nearest first.
std::vector<Offset> pixels_of_cell(int side) {
  std::vector<Offset> pixels;
  for (int v = 0; v < side; ++v) {
    for (int u = 0; u < side; ++u) pixels.push_back({2 * u - side + 1, 2 * v - side + 1});
  }
  std::stable_sort(pixels.begin(), pixels.end(), [](const Offset& a, const Offset& b) { return a.rank() < b.rank(); });
  for (Offset& pixel : pixels) pixel = {(pixel.u + side - 1) / 2, (pixel.v + side - 1) / 2};
  return pixels;
}

}  // namespace

MaskImage pixels_without(const std::vector<std::uint8_t>& is_left_out, const CoarseFrame& cells, int width,
                         int height) {
  MaskImage pixels(height, width);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      pixels(v, u) = is_left_out[static_cast<std::size_t>(v / cells.step * cells.width + u / cells.step)] ? 0 : 1;
    }
  }
  return pixels;
}

Camera coarse_camera(const Camera& camera, const CellBudget& budget) {
  const int side = side_of_cells(camera.width(), camera.height(), budget);
  const int width = (camera.width() + side - 1) / side, height = (camera.height() + side - 1) / side;
  if (camera.model() == Camera::Model::orthographic) {
    return Camera::orthographic(width, height, side * camera.pixel_size());
  }
  const auto middle = [&](double pixel) { return (pixel - 0.5 * (side - 1)) / side; };
  return Camera::pinhole(width, height, camera.fx() / side, camera.fy() / side, middle(camera.cx()),
                         middle(camera.cy()), camera.distortion(), DepthKind::z);
}

CoarseFrame::CoarseFrame(const Frame& frame, const Camera& camera, const MaskRef& mask, const CellBudget& budget)
    : step(side_of_cells(frame.width, frame.height, budget)) {
  width = (frame.width + step - 1) / step;
  height = (frame.height + step - 1) / step;
  cells.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const std::vector<Offset> pixels = pixels_of_cell(step);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      Cell& cell = cells[static_cast<std::size_t>(y * width + x)];
      // The pixel nearest to the middle, one with a normal before all without.
      for (const Offset& pixel : pixels) {
        const int u = x * step + pixel.u, v = y * step + pixel.v;
        if (u >= frame.width || v >= frame.height) continue;
        const int row = v * frame.width + u;
        if (!(frame.points(row, 2) > 0.0F) || (mask.size() > 0 && mask(v, u) == 0)) continue;
        const bool has_normal = std::isfinite(frame.normals(row, 0));
        if (has_normal || !cell.has_point()) cell.pixel = row;
        if (has_normal) break;
      }
      if (!cell.has_point()) continue;
      cell.point = frame.points.row(cell.pixel).transpose();
      const Eigen::Vector3f normal = frame.normals.row(cell.pixel).transpose();
      if (normal.allFinite()) cell.normal = normal;
      const float sigma = frame.sigma[cell.pixel];
      cell.sigma = std::isfinite(sigma) ? sigma : 0.0F;
      cell.footprint = static_cast<float>(step * camera.footprint(cell.point.z()));
    }
  }
}

double mean_pixel_motion(const CoarseFrame& cells, const Pose& before_from_now) {
  double sum = 0.0;
  std::int64_t count = 0;
  for (const Cell& cell : cells.cells) {
    if (!cell.has_point()) continue;
    const Eigen::Vector3d point = cell.point.cast<double>(), ray = point.normalized();
    const Eigen::Vector3d motion = before_from_now * point - point;
    sum += (motion - motion.dot(ray) * ray).norm() * cells.step / cell.footprint;
    ++count;
  }
  return count > 0 ? sum / static_cast<double>(count) : 0.0;
}

bool are_linked(const Cell& a, const Cell& b, int steps) {
  const float reach =
      static_cast<float>(camera_limits::steepest) * static_cast<float>(steps) * std::min(a.footprint, b.footprint);
  return (a.point - b.point).squaredNorm() < reach * reach;
}

std::vector<std::int32_t> border_cells(const CoarseFrame& frame, const std::vector<std::int32_t>& group,
                                       std::size_t num_groups) {
  std::vector<std::int32_t> count(num_groups, 0);
  const auto visit = [&](int u, int v) {
    const int x = std::clamp(u, region_limits::image_border, frame.width - 1 - region_limits::image_border),
              y = std::clamp(v, region_limits::image_border, frame.height - 1 - region_limits::image_border);
    const std::int32_t number = group[static_cast<std::size_t>(y * frame.width + x)];
    if (number >= 0) ++count[static_cast<std::size_t>(number)];
  };
  if (std::min(frame.width, frame.height) <= 2 * region_limits::image_border) return count;
  for (int u = 0; u < frame.width; ++u) visit(u, 0), visit(u, frame.height - 1);
  for (int v = 1; v + 1 < frame.height; ++v) visit(0, v), visit(frame.width - 1, v);
  return count;
}

CellGroups connect(const CoarseFrame& frame, const std::vector<std::uint8_t>& side) {
  CellGroups groups;
  groups.group.assign(side.size(), -1);
  std::vector<int> open;
  for (int start = 0; start < frame.size(); ++start) {
    const auto first = static_cast<std::size_t>(start);
    if (side[first] == 0 || groups.group[first] >= 0 || !frame[start].has_point()) continue;
    const auto number = static_cast<std::int32_t>(groups.size.size());
    groups.size.push_back(0);
    groups.group[first] = number;
    open.assign(1, start);
    while (!open.empty()) {
      const int i = open.back();
      open.pop_back();
      ++groups.size.back();
      frame.for_neighbours(i, region_limits::link_reach, [&](int j, int steps) {
        const auto k = static_cast<std::size_t>(j);
        if (side[k] != side[first] || groups.group[k] >= 0 || !are_linked(frame[i], frame[j], steps)) return;
        groups.group[k] = number;
        open.push_back(j);
      });
    }
  }
  return groups;
}

}  // namespace nacre
