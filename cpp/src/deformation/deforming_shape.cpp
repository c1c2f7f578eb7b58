#include "deformation/deforming_shape.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/kept_rows.hpp"
#include "base/parallel.hpp"
#include "deformation/limits.hpp"
#include "deformation/node_growth.hpp"

namespace nacre {
namespace {

// So that what the first frame shows gets about so many nodes.
double first_node_spacing(std::size_t num_points, double spacing) {
  const double points_per_node = static_cast<double>(num_points) / deformation_limits::first_nodes;
  return spacing * std::max(deformation_limits::node_spacings, std::sqrt(points_per_node));
}

}  // namespace

// The model is as the field says.
void DeformingShape::show(PointModel& model, int num_threads) {
  bent_ = warped(field_, canonical_.points, canonical_.normals, num_threads);
  model.points = bent_.points;
  model.normals = bent_.normals;
}

std::vector<std::uint8_t> DeformingShape::was_bending() const {
  if (states_.size() < 2) return {};
  const NodeStates &earlier = states_[states_.size() - 2], &last = states_.back();
  std::vector<std::uint8_t> flags;
  for (std::size_t node = 0; node < earlier.size(); ++node) flags.push_back(earlier[node] != last[node] ? 1 : 0);
  return flags;
}

void DeformingShape::bend(PointModel& model, int num_threads) {
  nodes_before_ = field_.nodes;
  nodes_bent_.clear();
  is_bent_ = false;
  canonical_ = {std::move(model.points), std::move(model.normals)};
  show(model, num_threads);
}

WarpFit DeformingShape::follow(PointModel& model, const std::vector<std::int32_t>& in_view, const ShownSurface& shown,
                               int num_threads) {
  const WarpFit fit = register_warp(field_, canonical_, in_view, shown, num_threads, was_bending(), model.colors);
  is_bent_ = fit.is_bent;
  if (!fit.is_whole) nodes_bent_ = fit.bent;
  show(model, num_threads);
  return fit;
}

bool DeformingShape::follow_at_any_rate(PointModel& model, int num_threads) {
  if (nodes_bent_.empty()) return false;
  field_.nodes = std::exchange(nodes_bent_, {});
  is_bent_ = true;
  show(model, num_threads);
  return true;
}

void DeformingShape::go_back(PointModel& model, int num_threads) {
  field_.nodes = nodes_before_;
  is_bent_ = false;
  show(model, num_threads);
}

void DeformingShape::keep(const std::vector<std::uint8_t>& flags) {
  // Without those that are new, which are behind and are kept.
  const std::vector<KeptRun> runs =
      runs_of({flags.begin(), flags.begin() + static_cast<std::ptrdiff_t>(field_.bindings.size())});
  for (OrientedPoints* shape : {&canonical_, &bent_}) {
    keep_runs(shape->points, runs);
    keep_runs(shape->normals, runs);
  }
  keep_runs(field_.bindings, runs);
}

void DeformingShape::unbend(PointModel& model, const Pose& world_from_camera, double spacing,
                            const std::function<float(float)>& spacing_of, std::int32_t frame, int num_threads) {
  constexpr std::int64_t block_size = 1024;
  const std::size_t num_known = field_.bindings.size();
  if (field_.nodes.empty() && !model.points.empty())
    field_.node_spacing = first_node_spacing(model.points.size(), spacing);
  const Eigen::Isometry3f camera_from_world(world_from_camera.inverse().cast<float>());
  std::vector<float> spacings;
  for (std::size_t i = num_known; i < model.points.size(); ++i) {
    spacings.push_back(spacing_of((camera_from_world * model.points[i]).z()));
  }
  grow(field_, {model.points, model.normals, spacings, model.last_seen, frame, spacing});
  canonical_.points.resize(model.points.size());
  canonical_.normals.resize(model.points.size());
  parallel_for(static_cast<std::int64_t>(model.points.size()), block_size, num_threads, [&](std::int64_t number) {
    const auto i = static_cast<std::size_t>(number);
    const bool has_changed =
        i >= num_known || model.points[i] != bent_.points[i] || model.normals[i] != bent_.normals[i];
    if (!has_changed) return;
    const OrientedPoint rest = unwarped(field_.at(field_.bindings[i]), {model.points[i], model.normals[i]});
    canonical_.points[i] = rest.point;
    canonical_.normals[i] = rest.normal;
  });
  model.points = std::move(canonical_.points);
  model.normals = std::move(canonical_.normals);
  canonical_ = bent_ = {};
}

void DeformingShape::end_frame() { states_.push_back(field_.states()); }

}  // namespace nacre
