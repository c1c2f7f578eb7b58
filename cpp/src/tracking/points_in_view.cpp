#include "tracking/points_in_view.hpp"

#include <cmath>
#include <limits>
#include <vector>

#include "base/parallel.hpp"
#include "base/random.hpp"
#include "registration/color_field.hpp"
#include "tracking/limits.hpp"

namespace nacre {
namespace {

using RowsOfBlock = std::vector<std::uint32_t>;

// Of each block of the model's points.
std::vector<RowsOfBlock> rows_in_view(const PointModel& model, const BlockIndex& blocks, const Camera& camera,
                                      const Pose& world_from_camera, std::int32_t oldest_frame, int num_threads) {
  constexpr std::int64_t block_size = PointProjection::capacity;
  const PointProjection projection(camera, world_from_camera);
  const auto width = static_cast<float>(camera.width()), height = static_cast<float>(camera.height());
  constexpr auto margin = static_cast<float>(tracking_limits::view_margin);
  const float margin_u = width * margin, margin_v = height * margin;
  const ViewVolume volume(camera, world_from_camera, tracking_limits::view_margin, 0.0,
                          std::numeric_limits<double>::infinity());
  const std::vector<PointRange> ranges = blocks.in_view(volume, oldest_frame);
  std::vector<RowsOfBlock> found(ranges.size());
  parallel_for(static_cast<std::int64_t>(ranges.size()), 1, num_threads, [&](std::int64_t number) {
    const PointRange& range = ranges[static_cast<std::size_t>(number)];
    const std::size_t first = range.first;
    PointProjection::Block block;
    projection.project(model.points[first].data(), model.normals[first].data(), range.count, block);
    std::uint32_t rows[block_size];
    std::size_t count = 0;
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(range.count); ++i) {
      rows[count] = static_cast<std::uint32_t>(first) + i;
      count += static_cast<std::size_t>((block.u[i] > -margin_u) & (block.u[i] < width + margin_u) &
                                        (block.v[i] > -margin_v) & (block.v[i] < height + margin_v) &
                                        (block.facing[i] > -0.5F) & (model.last_seen[first + i] >= oldest_frame));
    }
    found[static_cast<std::size_t>(number)].assign(rows, rows + count);
  });
  return found;
}

}  // namespace

PointsInView points_in_view(const PointModel& model, const BlockIndex& blocks, const Camera& camera,
                            const Pose& world_from_camera, std::int32_t oldest_frame, int num_threads) {
  const std::vector<RowsOfBlock> found =
      rows_in_view(model, blocks, camera, world_from_camera, oldest_frame, num_threads);
  std::size_t num_found = 0;
  for (const RowsOfBlock& rows : found) num_found += rows.size();
  const std::size_t step = (num_found + tracking_limits::most_target_points - 1) / tracking_limits::most_target_points;
  const auto count = static_cast<Eigen::Index>(step > 0 ? num_found / step : 0);
  PointsInView view{Points(count, 3), Points(count, 3), Values(model.colors.empty() ? 0 : count),
                    std::sqrt(static_cast<double>(std::max<std::size_t>(step, 1)))};
  // One of every `step`, at random.
  const auto is_chosen = [&](std::size_t index) { return index % step == random_bits(0, index / step) % step; };
  std::size_t index = 0;
  Eigen::Index k = 0;
  for (const RowsOfBlock& rows : found) {
    for (const std::uint32_t row : rows) {
      if (k == count || !is_chosen(index++)) continue;
      view.points.row(k) = model.points[row].transpose();
      if (view.brightness.size() > 0) view.brightness[k] = luma(model.colors[row]);
      view.normals.row(k++) = model.normals[row].transpose();
    }
  }
  return view;
}

}  // namespace nacre
