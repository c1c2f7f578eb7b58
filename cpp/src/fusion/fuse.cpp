#include "fusion/fuse.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "base/check.hpp"
#include "base/limits.hpp"
#include "base/parallel.hpp"
#include "base/pose_check.hpp"
#include "camera/limits.hpp"
#include "camera/point_projection.hpp"
#include "camera/point_spacing.hpp"
#include "depth/depth_view.hpp"
#include "fusion/attribute_fusion.hpp"
#include "fusion/exposure.hpp"
#include "fusion/limits.hpp"
#include "fusion/observable.hpp"
#include "fusion/pixel_index.hpp"
#include "spatial/hash_grid.hpp"

namespace nacre {
namespace {

// A new point must be seen by so many pixels of its own slant, and by more the greater it is: by as many as hold the
// information of so many from the front.
// Whether a point with a normal stands for the same piece of surface as another.
bool same_surface(const Eigen::Vector3f& point, const Eigen::Vector3f& normal, const Eigen::Vector3f& other,
                  const Eigen::Vector3f& other_normal, float spacing, float largest_offset) {
  const Eigen::Vector3f difference = other - point;
  const float along = difference.dot(normal);
  return std::abs(along) < largest_offset && difference.squaredNorm() - along * along < spacing * spacing &&
         normal.dot(other_normal) > fusion_limits::sheet_cosine;
}

// What of the image the model knows.
struct Known {
  struct Point {
    std::size_t point;
    std::int32_t pixel;
  };
  PixelSet covered;  // pixels whose surface the model has
  std::vector<Point> points;
};

struct NewPoint {
  std::int32_t row = 0;
  Eigen::Vector3f point = Eigen::Vector3f::Zero(), normal = point;  // camera frame
  Eigen::Vector3f color = Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN());
  float weight = 0.0F;
  float spacing = 0.0F;  // to its neighbours [m]
  int reach = 0;         // as far may they be in the image [pixels]
  PixelWindow cover = {};
};

void count_up(std::uint8_t& count) { count = static_cast<std::uint8_t>(std::min(255, count + 1)); }

template <class T>
std::vector<T> concatenate(const std::vector<std::vector<T>>& parts) {
  std::size_t size = 0;
  for (const std::vector<T>& part : parts) size += part.size();
  std::vector<T> all;
  all.reserve(size);
  for (const std::vector<T>& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

// Whether a point beside the image stands for surface within it: where points are farther apart than windows reach.
bool reaches_image(const PointProjection::Block& points, int i, const Camera& camera, double spacing) {
  const double reach = spacing / camera.footprint(points.z[i]);
  return reach > simd::largest_window && points.u[i] > -reach && points.u[i] < camera.width() - 1 + reach &&
         points.v[i] > -reach && points.v[i] < camera.height() - 1 + reach;
}

// Moves the model's points by what the frame says about them.
Known update(PointModel& model, const RegisteredFrame& now, double spacing, const FusionOptions& options,
             FusionReport& report, int num_threads) {
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
  const auto num_blocks = static_cast<std::size_t>((model.size() + block_size - 1) / block_size);
  std::vector<std::vector<Cover>> covers(num_blocks);
  std::vector<std::vector<Known::Point>> beside(num_blocks);  // the image

  parallel_blocks(
      model.size(), block_size, num_threads, [&](std::int64_t number, std::int64_t begin, std::int64_t end) {
        const auto first = static_cast<std::size_t>(begin);
        PointProjection::Block points;
        view.project(model.points[first].data(), model.normals[first].data(), static_cast<int>(end - begin), points);
        const auto note_free_space_violation = [&](int j, float sigma) {
          const std::size_t i = first + static_cast<std::size_t>(j);
          const float margin = std::max(static_cast<float>(camera_limits::surface_spacings * spacing),
                                        base_limits::noise_sigmas * sigma);
          const bool is_confirmed = model.observations[i] >= options.min_observations;
          const Visibility is = visibility(frame.points(points.pixel[j], 2) - points.z[j], margin);
          const bool is_missed = is_confirmed ? observer.sees_through(points.point(j), points.pixel[j], margin)
                                              : is == Visibility::agrees || is == Visibility::seen_through;
          if (is_missed) count_up(model.free_space_violations[i]);
        };
        ObservationBlock block;
        int seen[block_size];  // of the points
        for (int j = 0; j < static_cast<int>(end - begin); ++j) {
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
        observer.observe_and_cover(block, fusion_limits::sheet_cosine);
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
            covers[static_cast<std::size_t>(number)].push_back({i, points.pixel[j], block.cover(k)});
          } else {
            note_free_space_violation(j, block.sigma(k));
          }
        }
      });

  Known known{PixelSet(frame.width, frame.height), concatenate(beside)};
  for (const std::vector<Cover>& block : covers) {
    report.num_updated += static_cast<std::int64_t>(block.size());
    for (const Cover& cover : block) {
      known.covered.insert(cover.window);
      known.points.push_back({cover.point, cover.pixel});
    }
  }
  return known;
}

// How far the neighbours of a point may be in the image: beyond the pixels that it covers where those are few.
int reach_of(const NewPoint& point, const Camera& camera) {
  const double pixels = std::ceil(static_cast<double>(point.spacing) / camera.footprint(point.point.z()));
  const int largest = std::max(camera.width(), camera.height());
  const bool is_in_image = pixels >= 0.0 && pixels < largest;  // not so behind the camera
  return std::max(point.cover.num_rows / 2, is_in_image ? static_cast<int>(pixels) : largest) + 1;
}

// The frame's surface where the model does not cover it, denoised.
std::vector<NewPoint> find_new_points(const RegisteredFrame& now, const PixelSet& covered, double spacing,
                                      int num_threads) {
  const Frame& frame = now.frame;
  const Camera& camera = now.camera;
  const SurfaceObserver& observer = now.observer;
  std::vector<std::vector<std::int32_t>> uncovered(static_cast<std::size_t>(frame.height));
  parallel_for(frame.height, 16, num_threads, [&](std::int64_t v) {
    const auto first = static_cast<std::int32_t>(v) * frame.width;
    for (int u = 0; u < frame.width; ++u) {
      if (observer.weight(u, static_cast<int>(v)) > 0.0F && !covered.contains(u, static_cast<int>(v))) {
        uncovered[static_cast<std::size_t>(v)].push_back(first + u);
      }
    }
  });
  const std::vector<std::int32_t> rows = concatenate(uncovered);
  constexpr std::int64_t block_size = ObservationBlock::capacity;
  const auto count = static_cast<std::int64_t>(rows.size());
  std::vector<std::vector<NewPoint>> found(static_cast<std::size_t>((count + block_size - 1) / block_size));
  parallel_blocks(count, block_size, num_threads, [&](std::int64_t number, std::int64_t begin, std::int64_t end) {
    ObservationBlock block;
    std::vector<NewPoint>& candidates = found[static_cast<std::size_t>(number)];
    for (std::int64_t i = begin; i < end; ++i) {
      const std::int32_t row = rows[static_cast<std::size_t>(i)];
      NewPoint candidate;
      candidate.row = row;
      candidate.point = frame.points.row(row).transpose();
      candidate.normal = frame.normals.row(row).transpose();
      if (!(candidate.normal.dot(observer.towards_camera(candidate.point)) > fusion_limits::least_facing)) continue;
      candidate.spacing = spacing_at(candidate.point.z(), frame.sigma[row], camera, spacing);
      observer.add(block, candidate.point, candidate.normal, row, frame.sigma[row], candidate.spacing);
      candidates.push_back(candidate);
    }
    observer.observe_and_cover(block, fusion_limits::sheet_cosine);
    std::size_t kept = 0;
    for (int k = 0; k < block.size(); ++k) {
      const Observation observed = block[k];
      NewPoint candidate = candidates[static_cast<std::size_t>(k)];
      const float facing = candidate.normal.dot(observer.towards_camera(candidate.point));
      const float least = std::max(fusion_limits::insertion_pixels * facing, fusion_limits::insertion_weight);
      if (!(observed.weight * facing > least * observer.frontal_weight(block.sigma(k)))) continue;
      candidate.point += observed.offset * block.ray(k);
      candidate.normal = observed.normal.normalized();
      if (observer.has_colors()) candidate.color = exposed(observed.color, now.color_gain);
      candidate.weight = observed.weight;
      candidate.cover = block.cover(k);
      candidate.reach = reach_of(candidate, camera);
      candidates[kept++] = candidate;
    }
    candidates.resize(kept);
  });
  return concatenate(found);
}

// Adds points, one after the other, where neither the model nor a point before stands for the surface. The covered
// pixels rule most of them out at once, by what was measured; the others are compared as they are, without the noise.
void insert(PointModel& model, const std::vector<NewPoint>& candidates, Known& known, const RegisteredFrame& now,
            bool with_colors, FusionReport& report) {
  if (candidates.empty()) return;
  const Frame& frame = now.frame;
  const Eigen::Isometry3f to_world(now.world_from_camera.cast<float>());
  int farthest = 0;
  for (const NewPoint& candidate : candidates) farthest = std::max(farthest, candidate.reach);
  PixelIndex points(frame.width, frame.height, std::max(1, farthest / fusion_limits::squares_across));
  for (const Known::Point& seen : known.points) points.add(seen.pixel, seen.point);
  for (const NewPoint& candidate : candidates) {
    if (known.covered.contains(candidate.row % frame.width, candidate.row / frame.width)) continue;
    known.covered.insert(candidate.cover);
    const Eigen::Vector3f point = to_world * candidate.point;
    const Eigen::Vector3f normal = to_world.linear() * candidate.normal;
    const float largest_offset = std::max(candidate.spacing, fusion_limits::cover_sigmas * frame.sigma[candidate.row]);
    const bool is_known = points.any_near(candidate.row, candidate.reach, [&](std::size_t i) {
      return same_surface(point, normal, model.points[i], model.normals[i], candidate.spacing, largest_offset);
    });
    if (is_known) continue;
    points.add(candidate.row, model.points.size());
    model.points.push_back(point);
    model.normals.push_back(normal);
    if (with_colors) model.colors.push_back(candidate.color);
    model.confidence.push_back(candidate.weight);
    model.last_seen.push_back(now.index);
    model.observations.push_back(1);
    model.free_space_violations.push_back(0);
    ++report.num_inserted;
  }
}

void remove_violated(PointModel& model, const FusionOptions& options, FusionReport& report) {
  std::vector<std::uint8_t> flags(model.points.size(), 1);
  for (std::size_t i = 0; i < flags.size(); ++i) {
    if (model.free_space_violations[i] < options.max_free_space_violations) continue;
    flags[i] = 0;
    ++report.num_removed;
  }
  if (report.num_removed > 0) model.keep(flags);
}

// So many values a point.
template <class Value>
void keep_flagged(std::vector<Value>& values, const std::vector<std::uint8_t>& flags, std::size_t count = 1) {
  if (values.empty()) return;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < flags.size(); ++i) {
    if (!flags[i]) continue;
    for (std::size_t c = 0; c < count; ++c) values[kept++] = values[i * count + c];
  }
  values.resize(kept);
}

}  // namespace

void PointModel::keep(const std::vector<std::uint8_t>& flags) {
  keep_flagged(points, flags);
  keep_flagged(normals, flags);
  keep_flagged(colors, flags);
  for (PointAttribute& attribute : attributes) {
    keep_flagged(attribute.values, flags, static_cast<std::size_t>(attribute.num_channels));
  }
  keep_flagged(confidence, flags);
  keep_flagged(last_seen, flags);
  keep_flagged(observations, flags);
  keep_flagged(free_space_violations, flags);
}

void FusionOptions::check() const {
  require(support >= 0.0, "support", "0 (automatic) or a positive distance in metres", support);
  require(max_angle > 0.0, "max_angle", "a positive angle in radians", max_angle);
  require(max_confidence > 0.0, "max_confidence", "positive", max_confidence);
  require(min_observations >= 0 && min_observations <= 255, "min_observations", "0 to 255 frames", min_observations);
  require(max_free_space_violations >= 1 && max_free_space_violations <= 255, "max_free_space_violations", "1 to 255",
          max_free_space_violations);
  require(reference_sigma >= 0.0, "reference_sigma", "0 (automatic) or positive metres", reference_sigma);
}

FusionReport fuse_observed(PointModel& model, RegisteredFrame now, double spacing, const FusionOptions& options,
                           int num_threads, const std::vector<FrameAttribute>& attributes) {
  FusionReport report;
  now.color_gain = share_exposure(model, now, spacing);
  const bool with_colors = now.observer.has_colors() || !model.colors.empty();
  if (with_colors) {
    model.colors.resize(model.points.size(), Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  }
  const AttributePlanes planes(attributes, now.observer, now.camera, num_threads);
  const bool with_attributes = !attributes.empty() || !model.attributes.empty();
  if (with_attributes) fuse_attributes(model, 0, now, planes, num_threads);
  Known known = update(model, now, spacing, options, report, num_threads);
  const std::vector<NewPoint> candidates = find_new_points(now, known.covered, spacing, num_threads);
  const std::int64_t num_known = model.size();
  insert(model, candidates, known, now, with_colors, report);
  if (with_attributes) fuse_attributes(model, num_known, now, planes, num_threads);
  remove_violated(model, options, report);
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
  return fuse_observed(model, {frame, camera, observer, world_from_camera, frame_index}, spacing, options, num_threads,
                       attributes);
}

void thin(PointModel& model, double spacing) {
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
  model.keep(flags);
}

}  // namespace nacre
