#include "model/wlop_fusion.hpp"

#include <algorithm>
#include <cmath>

#include "base/parallel.hpp"
#include "model/paper_loop.hpp"
#include "nacre/kdtree.hpp"
#include "nacre/normals.hpp"
#include "spatial/hash_grid.hpp"

namespace nacre {
namespace {

PointsRef as_matrix(const std::vector<Eigen::Vector3f>& points) {
  return Eigen::Map<const Points>(points.empty() ? nullptr : points.front().data(),
                                  static_cast<Eigen::Index>(points.size()), 3);
}

PointModel to_world(const Frame& frame, const Pose& world_from_camera, std::int32_t frame_index) {
  const Eigen::Isometry3f transform(world_from_camera.cast<float>());
  PointModel result;
  for (const std::int32_t row : frame.valid) {
    // Single precision cannot tell the normal of what is extremely near or far.
    if (!(std::abs(frame.normals.row(row).squaredNorm() - 1.0F) < 0.01F)) continue;
    result.points.emplace_back(transform * Eigen::Vector3f(frame.points.row(row).transpose()));
    result.normals.emplace_back(transform.linear() * frame.normals.row(row).transpose());
  }
  result.confidence.assign(result.points.size(), 1.0F);
  result.last_seen.assign(result.points.size(), frame_index);
  result.observations.assign(result.points.size(), 1);
  result.free_space_violations.assign(result.points.size(), 0);
  return result;
}

// The repaired samples: the whole model, and the new points that it does not cover.
PointModel covering_samples(const PointModel& model, const PointModel& fresh, const ModelOptions& options,
                            double spacing) {
  PointModel samples = model;
  PointGrid grid(spacing, model.points.size() + fresh.points.size());
  for (const Eigen::Vector3f& point : model.points) grid.add(point);
  std::vector<std::uint8_t> flags(fresh.points.size(), 0);
  std::vector<Eigen::Vector3f> known = model.points;
  for (std::size_t i = 0; i < fresh.points.size() && static_cast<int>(known.size()) < options.max_points; ++i) {
    const bool is_known = grid.any_near(fresh.points[i], [&](std::int32_t k) {
      return (known[static_cast<std::size_t>(k)] - fresh.points[i]).norm() < static_cast<float>(spacing);
    });
    if (is_known) continue;
    flags[i] = 1;
    grid.add(fresh.points[i]);
    known.push_back(fresh.points[i]);
  }
  PointModel chosen = fresh;
  chosen.keep(flags);
  append(samples, chosen);
  return samples;
}

ConsolidateOptions consolidation_of(const ModelOptions& options) {
  ConsolidateOptions consolidation;
  const bool literal = options.fusion_method == FusionMethod::wlop;
  consolidation.method = literal ? ConsolidationMethod::wlop : ConsolidationMethod::wlop_plus;
  consolidation.radius = options.wlop.radius;
  consolidation.iterations = options.wlop.iterations;
  consolidation.mu = options.wlop.mu;
  consolidation.theta = options.wlop.theta;
  consolidation.num_threads = options.num_threads;
  return consolidation;
}

}  // namespace

void consolidate_frame(PointModel& model, const Frame& frame, const Pose& world_from_camera,
                       const ModelOptions& options, double spacing, std::int32_t frame_index) {
  const bool literal = options.fusion_method == FusionMethod::wlop;
  const PointModel fresh = to_world(frame, world_from_camera, frame_index);
  PointModel samples = literal ? PaperLoop{options, frame_index}.samples(model, fresh)
                               : covering_samples(model, fresh, options, spacing);
  PointModel points = model;
  append(points, fresh);

  // Which samples does the frame observe?
  const KdTree tree(as_matrix(fresh.points), options.num_threads);
  std::vector<std::uint8_t> unseen(samples.points.size(), 0);
  parallel_for(samples.size(), 256, options.num_threads, [&](std::int64_t i) {
    std::int64_t index = 0;
    double squared_distance = 0.0;
    const auto k = static_cast<std::size_t>(i);
    const Eigen::Vector3d point = samples.points[k].cast<double>();
    const int found = tree.nearest(point, 1, options.wlop.radius, &index, &squared_distance);
    // Of a thin sheet, the frame observes one side.
    unseen[k] = found == 0 || fresh.normals[static_cast<std::size_t>(index)].dot(samples.normals[k]) < 0.0F ? 1 : 0;
  });

  const ConsolidateOptions consolidation = consolidation_of(options);
  Points moved;
  if (literal) {
    moved = project_samples(as_matrix(samples.points), as_matrix(points.points), consolidation);
  } else {
    ProjectionHints hints;
    hints.point_weights = Eigen::Map<const Values>(points.confidence.data(), points.size());
    hints.sample_normals = as_matrix(samples.normals);
    hints.frozen = unseen;
    moved = project_samples(as_matrix(samples.points), as_matrix(points.points), consolidation, hints);
  }
  for (std::size_t i = 0; i < samples.points.size(); ++i) {
    samples.points[i] = moved.row(static_cast<Eigen::Index>(i)).transpose();
    if (unseen[i]) continue;
    samples.confidence[i] += 1.0F;
    samples.last_seen[i] = frame_index;
  }
  model = std::move(samples);
}

void renew_normals(PointModel& model, const ModelOptions& options) {
  const NormalOptions wanted = {options.wlop.normal_neighbors, options.wlop.normal_radius, options.num_threads};
  const Points normals = estimate_normals(as_matrix(model.points), wanted);
  for (std::size_t i = 0; i < model.normals.size(); ++i) {
    const Eigen::Vector3f normal = normals.row(static_cast<Eigen::Index>(i)).transpose();
    if (!normal.allFinite()) continue;
    model.normals[i] = normal.dot(model.normals[i]) < 0.0F ? Eigen::Vector3f(-normal) : normal;
  }
}

}  // namespace nacre
