#include "fusion/fuse.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "base/check.hpp"
#include "base/concatenate.hpp"
#include "base/limits.hpp"
#include "base/parallel.hpp"
#include "base/pose_check.hpp"
#include "camera/limits.hpp"
#include "camera/point_projection.hpp"
#include "camera/point_spacing.hpp"
#include "depth/depth_view.hpp"
#include "fusion/attribute_fusion.hpp"
#include "fusion/exposure.hpp"
#include "fusion/insertion.hpp"
#include "fusion/limits.hpp"
#include "fusion/observable.hpp"
#include "fusion/same_surface.hpp"
#include "spatial/hash_grid.hpp"

namespace nacre {
namespace {

void count_up(std::uint8_t& count) { count = static_cast<std::uint8_t>(std::min(255, count + 1)); }

// Whether a point beside the image stands for surface within it: where points are farther apart than windows reach.
bool reaches_image(const PointProjection::Block& points, int i, const Camera& camera, double spacing) {
  const double reach = spacing / camera.footprint(points.z[i]);
  return reach > simd::largest_window && points.u[i] > -reach && points.u[i] < camera.width() - 1 + reach &&
         points.v[i] > -reach && points.v[i] < camera.height() - 1 + reach;
}

// Moves the model's points by what the frame says about them.
KnownSurface update(PointModel& model, const std::vector<PointRange>& ranges, const RegisteredFrame& now,
                    double spacing, const FusionOptions& options, FusionReport& report, int num_threads) {
  const Frame& frame = now.frame;
  const Camera& camera = now.camera;
  const SurfaceObserver& observer = now.observer;
  const PointProjection view(camera, now.world_from_camera);
  const Eigen::Matrix3f world_rotation = now.world_from_camera.linear().cast<float>();
  constexpr std::int64_t block_size = PointProjection::capacity;
  static_assert(PointProjection::capacity <= ObservationBlock::capacity);
  struct Cover {
    std::size_t point;
    std::int32_t pixel;
    PixelWindow window;
  };
  std::vector<std::vector<Cover>> covers(ranges.size());
  std::vector<std::vector<KnownSurface::Point>> beside(ranges.size());  // the image

  parallel_for(static_cast<std::int64_t>(ranges.size()), 1, num_threads, [&](std::int64_t number) {
    const PointRange& range = ranges[static_cast<std::size_t>(number)];
    const std::size_t first = range.first;
    PointProjection::Block points;
    view.project(model.points[first].data(), model.normals[first].data(), range.count, points);
    const auto note_free_space_violation = [&](int j, float sigma) {
      const std::size_t i = first + static_cast<std::size_t>(j);
      const float margin =
          std::max(static_cast<float>(camera_limits::surface_spacings * spacing), base_limits::noise_sigmas * sigma);
      const bool is_confirmed = model.observations[i] >= options.min_observations;
      const Visibility is = visibility(frame.points(points.pixel[j], 2) - points.z[j], margin);
      const bool is_missed = is_confirmed ? observer.sees_through(points.point(j), points.pixel[j], margin)
                                          : is == Visibility::agrees || is == Visibility::seen_through;
      if (is_missed) count_up(model.free_space_violations[i]);
    };
    ObservationBlock block;
    int seen[block_size];  // of the points
    for (int j = 0; j < range.count; ++j) {
      if (!points.inside[j] && reaches_image(points, j, camera, spacing)) {
        beside[static_cast<std::size_t>(number)].push_back({first + static_cast<std::size_t>(j), points.pixel[j]});
      }
      if (!points.inside[j] || !(points.facing[j] > fusion_limits::least_facing)) continue;
      const float measured_sigma = frame.sigma[points.pixel[j]];
      const float sigma = std::isfinite(measured_sigma) ? measured_sigma : 0.0F;
      if (!observer.may_observe(points.point(j), points.pixel[j], sigma,
                                fusion_limits::least_weight * observer.frontal_weight(sigma))) {
        note_free_space_violation(j, sigma);
        continue;
      }
      seen[block.size()] = j;
      observer.add(block, points.point(j), points.normal(j), points.pixel[j], sigma,
                   spacing_at(points.z[j], sigma, camera, spacing));
    }
    observer.observe_and_cover(block, base_limits::same_side_cosine);
    std::vector<Cover>& covered = covers[static_cast<std::size_t>(number)];
    covered.reserve(static_cast<std::size_t>(block.size()));
    for (int k = 0; k < block.size(); ++k) {
      const int j = seen[k];  // NOLINT(clang-analyzer-core.uninitialized.Assign): filled with the block
      const std::size_t i = first + static_cast<std::size_t>(j);
      const Observation observed = block[k];
      if (observed.weight > fusion_limits::least_weight * observer.frontal_weight(block.sigma(k))) {
        const float gain = observed.weight / (model.confidence[i] + observed.weight);
        model.points[i] += world_rotation * (gain * observed.offset * points.normal(j));
        model.normals[i] = (model.confidence[i] * model.normals[i] + world_rotation * observed.normal).normalized();
        if (observer.has_colors()) {
          Eigen::Vector3f& color = model.colors[i];
          const Eigen::Vector3f seen_color = exposed(observed.color, now.color_gain);
          color = color.allFinite() ? Eigen::Vector3f(color + gain * (seen_color - color)) : seen_color;
        }
        model.confidence[i] =
            std::min(model.confidence[i] + observed.weight, static_cast<float>(options.max_confidence));
        model.last_seen[i] = now.index;
        count_up(model.observations[i]);
        model.free_space_violations[i] = 0;
        covered.push_back({i, points.pixel[j], block.cover(k)});
      } else {
        note_free_space_violation(j, block.sigma(k));
      }
    }
  });

  KnownSurface known{PixelSet(frame.width, frame.height), concatenate(beside)};
  for (const std::vector<Cover>& block : covers) {
    report.num_updated += static_cast<std::int64_t>(block.size());
    for (const Cover& cover : block) {
      known.covered.insert(cover.window);
      known.points.push_back({cover.point, cover.pixel});
    }
  }
  return known;
}

}  // namespace

void FusionOptions::check() const {
  require(support >= 0.0, "support", "0 (automatic) or a positive distance in metres", support);
  require(max_angle > 0.0, "max_angle", "a positive angle in radians", max_angle);
  require(max_confidence > 0.0, "max_confidence", "positive", max_confidence);
  require(min_observations >= 0 && min_observations <= 255, "min_observations", "0 to 255 frames", min_observations);
  require(max_free_space_violations >= 1 && max_free_space_violations <= 255, "max_free_space_violations", "1 to 255",
          max_free_space_violations);
  require(reference_sigma >= 0.0, "reference_sigma", "0 (automatic) or positive metres", reference_sigma);
}

std::vector<std::uint8_t> remove_violated(PointModel& model, BlockIndex& blocks, const FusionOptions& options,
                                          FusionReport& report) {
  const auto is_violated = [&](std::uint8_t count) { return count >= options.max_free_space_violations; };
  const std::vector<std::uint8_t>& counts = model.free_space_violations;
  report.num_removed = std::count_if(counts.begin(), counts.end(), is_violated);
  if (report.num_removed == 0) return {};
  std::vector<std::uint8_t> flags(counts.size());
  std::transform(counts.begin(), counts.end(), flags.begin(), [&](std::uint8_t count) { return !is_violated(count); });
  model.keep(flags);
  blocks.keep(flags);
  return flags;
}

FusionReport fuse_observed(PointModel& model, BlockIndex& blocks, RegisteredFrame now, double spacing,
                           const FusionOptions& options, int num_threads, const std::vector<FrameAttribute>& attributes,
                           Eigen::Vector3f* model_gain) {
  FusionReport report;
  const std::vector<PointRange> seen = blocks.in_view(observed_volume(now, options, spacing));
  const SharedExposure exposure = share_exposure(model, blocks, seen, now, spacing);
  now.color_gain = exposure.frame;
  if (exposure.model != Eigen::Vector3f::Ones()) expose_points(model, exposure.model);
  if (model_gain != nullptr) *model_gain = exposure.model;
  const bool with_colors = now.observer.has_colors() || !model.colors.empty();
  if (with_colors) {
    model.colors.resize(model.points.size(), Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  }
  const AttributePlanes planes(attributes, now.observer, now.camera, num_threads);
  const bool with_attributes = !attributes.empty() || !model.attributes.empty();
  if (with_attributes) fuse_attributes(model, seen, now, planes, num_threads);
  KnownSurface known = update(model, seen, now, spacing, options, report, num_threads);
  blocks.measure(model, seen);
  const std::size_t num_known = model.points.size();
  report.num_inserted = insert_points(model, std::move(known), now, spacing, with_colors, num_threads);
  blocks.add_new(model);
  if (with_attributes) fuse_attributes(model, blocks.from(num_known), now, planes, num_threads);
  return report;
}

FusionReport fuse(PointModel& model, const Frame& frame, const Camera& camera, const Pose& world_from_camera,
                  double spacing, std::int32_t frame_index, const FusionOptions& options, const ColorsRef& colors,
                  int num_threads, const std::vector<FrameAttribute>& attributes) {
  options.check();
  require(spacing > 0.0, "spacing", "a positive distance in metres", spacing);
  require_rigid(world_from_camera, "world_from_camera");
  require(frame.width == camera.width() && frame.height == camera.height(), "frame", "of the camera's size",
          std::to_string(frame.width) + " x " + std::to_string(frame.height));
  require(colors.rows() == 0 || colors.rows() == frame.points.rows(), "colors", "one row per pixel", colors.rows());
  check_attributes(attributes, camera, model);
  SurfaceObserver observer(camera, options);
  observer.look_at(frame, colors, num_threads);
  BlockIndex blocks(model);
  FusionReport report = fuse_observed(model, blocks, {frame, camera, observer, world_from_camera, frame_index}, spacing,
                                      options, num_threads, attributes);
  remove_violated(model, blocks, options, report);
  return report;
}

std::vector<std::uint8_t> thinned(const PointModel& model, double spacing) {
  require(spacing > 0.0, "spacing", "a positive distance in metres", spacing);
  PointGrid grid(spacing, model.points.size());
  std::vector<std::size_t> kept;
  std::vector<std::uint8_t> flags(model.points.size(), 0);
  for (std::size_t i = 0; i < flags.size(); ++i) {
    const bool is_known = grid.any_near(model.points[i], [&](std::int32_t k) {
      const std::size_t other = kept[static_cast<std::size_t>(k)];
      return same_surface(model.points[i], model.normals[i], model.points[other], model.normals[other],
                          static_cast<float>(spacing), static_cast<float>(spacing));
    });
    if (is_known) continue;
    grid.add(model.points[i]);
    kept.push_back(i);
    flags[i] = 1;
  }
  return flags;
}

void thin(PointModel& model, double spacing) { model.keep(thinned(model, spacing)); }

}  // namespace nacre
