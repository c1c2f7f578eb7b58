#include "nacre/fusion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "check.hpp"
#include "parallel.hpp"
#include "point_grid.hpp"
#include "surface_observer.hpp"

namespace nacre {
namespace {

constexpr float least_weight = 0.05F;     // less observation than this is none
constexpr float insertion_weight = 2.0F;  // a new point must be seen by so many pixels of its frame
constexpr float sheet_cosine = 0.3F;      // normals that differ more belong to different sheets
constexpr float least_facing = 0.1F;      // surfaces that are seen at a smaller cosine are not judged

// Whether a point with a normal stands for the same piece of surface as another.
bool same_surface(const Eigen::Vector3f& point, const Eigen::Vector3f& normal, const Eigen::Vector3f& other,
                  const Eigen::Vector3f& other_normal, float spacing, float largest_offset) {
  const Eigen::Vector3f difference = other - point;
  const float along = difference.dot(normal);
  return std::abs(along) < largest_offset && difference.squaredNorm() - along * along < spacing * spacing &&
         normal.dot(other_normal) > sheet_cosine;
}

struct NewPoint {
  std::int32_t row = 0;
  Eigen::Vector3f point = Eigen::Vector3f::Zero(), normal = point;  // camera frame
  Eigen::Vector3f color = Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN());
  float weight = 0.0F;
};

// Moves the model's points by what the frame says about them; returns which pixels they cover.
std::vector<std::uint8_t> update(PointModel& model, const Frame& frame, const Camera& camera,
                                 const SurfaceObserver& observer, const Pose& world_from_camera, double spacing,
                                 std::int32_t frame_index, const FusionOptions& options, FusionReport& report,
                                 int num_threads) {
  const Eigen::Isometry3f camera_from_world(world_from_camera.inverse().cast<float>());
  const Eigen::Matrix3f world_rotation = world_from_camera.linear().cast<float>();
  const std::int64_t count = model.size();
  std::vector<float> cover(static_cast<std::size_t>(count), 0.0F);  // radius of the covered disc [pixels]
  std::vector<std::int32_t> pixels(static_cast<std::size_t>(count), -1);

  parallel_for(count, 1024, num_threads, [&](std::int64_t index) {
    const auto i = static_cast<std::size_t>(index);
    const Eigen::Vector3f point = camera_from_world * model.points[i];
    const Eigen::Vector3f normal = camera_from_world.linear() * model.normals[i];
    const float facing = normal.dot(observer.towards_camera(point));
    if (!(facing > least_facing)) return;
    const std::int32_t pixel = observer.pixel_of(point);
    if (pixel < 0) return;
    const float measured_sigma = frame.sigma[pixel];
    const float sigma = std::isfinite(measured_sigma) ? measured_sigma : 0.0F;
    const Observation seen = observer.observe(point, normal, pixel, sigma);
    if (seen.weight > least_weight) {
      const float gain = seen.weight / (model.confidence[i] + seen.weight);
      model.points[i] += world_rotation * (gain * seen.offset * normal);
      model.normals[i] = (model.confidence[i] * model.normals[i] + world_rotation * seen.normal).normalized();
      if (observer.has_colors()) {
        Eigen::Vector3f& color = model.colors[i];
        color = color.allFinite() ? Eigen::Vector3f(color + gain * (seen.color - color)) : seen.color;
      }
      model.confidence[i] = std::min(model.confidence[i] + seen.weight, static_cast<float>(options.max_confidence));
      model.last_seen[i] = frame_index;
      model.violations[i] = 0;
      pixels[i] = pixel;
      cover[i] = 0.7F * static_cast<float>(spacing / camera.footprint(point.z())) * facing;
    } else if (observer.sees_through(point, pixel, std::max(static_cast<float>(2.0 * spacing), 4.0F * sigma))) {
      model.violations[i] = static_cast<std::uint8_t>(std::min(255, model.violations[i] + 1));
    }
  });

  std::vector<std::uint8_t> covered(static_cast<std::size_t>(frame.points.rows()), 0);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (pixels[i] < 0) continue;
    ++report.num_updated;
    const int u = pixels[i] % frame.width, v = pixels[i] / frame.width;
    const int reach = static_cast<int>(cover[i]);
    for (int y = std::max(0, v - reach); y <= std::min(frame.height - 1, v + reach); ++y) {
      for (int x = std::max(0, u - reach); x <= std::min(frame.width - 1, u + reach); ++x) {
        const auto dx = static_cast<float>(x - u), dy = static_cast<float>(y - v);
        if (dx * dx + dy * dy <= cover[i] * cover[i]) {
          covered[static_cast<std::size_t>(y) * static_cast<std::size_t>(frame.width) + static_cast<std::size_t>(x)] =
              1;
        }
      }
    }
  }
  return covered;
}

// The frame's surface where the model does not cover it, denoised.
std::vector<NewPoint> find_new_points(const Frame& frame, const SurfaceObserver& observer,
                                      const std::vector<std::uint8_t>& covered, int num_threads) {
  std::vector<NewPoint> candidates;
  for (const std::int32_t row : frame.valid) {
    if (covered[static_cast<std::size_t>(row)]) continue;
    NewPoint candidate;
    candidate.row = row;
    candidates.push_back(candidate);
  }
  parallel_for(static_cast<std::int64_t>(candidates.size()), 1024, num_threads, [&](std::int64_t index) {
    NewPoint& candidate = candidates[static_cast<std::size_t>(index)];
    candidate.point = frame.points.row(candidate.row).transpose();
    candidate.normal = frame.normals.row(candidate.row).transpose();
    if (!(candidate.normal.dot(observer.towards_camera(candidate.point)) > least_facing)) return;
    const Observation seen =
        observer.observe(candidate.point, candidate.normal, candidate.row, frame.sigma[candidate.row]);
    candidate.point += seen.offset * candidate.normal;
    candidate.normal = seen.normal.normalized();
    if (observer.has_colors()) candidate.color = seen.color;
    candidate.weight = seen.weight;
  });
  candidates.erase(std::remove_if(candidates.begin(), candidates.end(),
                                  [](const NewPoint& c) { return !(c.weight > insertion_weight); }),
                   candidates.end());
  return candidates;
}

void insert(PointModel& model, const std::vector<NewPoint>& candidates, const Frame& frame,
            const Pose& world_from_camera, double spacing, std::int32_t frame_index, bool with_colors,
            FusionReport& report) {
  if (candidates.empty()) return;
  PointGrid grid(spacing, model.points.size() + candidates.size());
  for (const Eigen::Vector3f& point : model.points) grid.add(point);
  const Eigen::Isometry3f to_world(world_from_camera.cast<float>());
  for (const NewPoint& candidate : candidates) {
    const Eigen::Vector3f point = to_world * candidate.point;
    const Eigen::Vector3f normal = to_world.linear() * candidate.normal;
    const float largest_offset = std::max(static_cast<float>(spacing), 3.0F * frame.sigma[candidate.row]);
    const bool is_known = grid.any_near(point, [&](std::int32_t i) {
      const auto k = static_cast<std::size_t>(i);
      return same_surface(point, normal, model.points[k], model.normals[k], static_cast<float>(spacing),
                          largest_offset);
    });
    if (is_known) continue;
    grid.add(point);
    model.points.push_back(point);
    model.normals.push_back(normal);
    if (with_colors) model.colors.push_back(candidate.color);
    model.confidence.push_back(candidate.weight);
    model.last_seen.push_back(frame_index);
    model.violations.push_back(0);
    ++report.num_inserted;
  }
}

void remove_unconfirmed(PointModel& model, std::int32_t frame_index, const FusionOptions& options,
                        FusionReport& report) {
  std::vector<std::uint8_t> flags(model.points.size(), 1);
  for (std::size_t i = 0; i < flags.size(); ++i) {
    const bool seen_through = model.violations[i] >= options.max_violations;
    const bool forgotten = model.confidence[i] < static_cast<float>(options.min_confidence) &&
                           frame_index - model.last_seen[i] > options.max_age;
    if (seen_through || forgotten) {
      flags[i] = 0;
      ++report.num_removed;
    }
  }
  if (report.num_removed > 0) model.keep(flags);
}

template <class Value>
void keep_flagged(std::vector<Value>& values, const std::vector<std::uint8_t>& flags) {
  if (values.empty()) return;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < flags.size(); ++i) {
    if (flags[i]) values[kept++] = values[i];
  }
  values.resize(kept);
}

}  // namespace

void PointModel::keep(const std::vector<std::uint8_t>& flags) {
  keep_flagged(points, flags);
  keep_flagged(normals, flags);
  keep_flagged(colors, flags);
  keep_flagged(confidence, flags);
  keep_flagged(last_seen, flags);
  keep_flagged(violations, flags);
}

void FusionOptions::check() const {
  require(support >= 0.0, "support", "0 (automatic) or a positive distance in metres", support);
  require(max_angle > 0.0, "max_angle", "a positive angle in radians", max_angle);
  require(max_confidence > 0.0, "max_confidence", "positive", max_confidence);
  require(min_confidence >= 0.0, "min_confidence", "0 or more", min_confidence);
  require(max_age >= 0, "max_age", "0 frames or more", max_age);
  require(max_violations >= 1 && max_violations <= 255, "max_violations", "1 to 255", max_violations);
  require(reference_sigma >= 0.0, "reference_sigma", "0 (automatic) or positive metres", reference_sigma);
}

FusionReport fuse(PointModel& model, const Frame& frame, const Camera& camera, const Pose& world_from_camera,
                  double spacing, std::int32_t frame_index, const FusionOptions& options, const ColorsRef& colors,
                  int num_threads) {
  options.check();
  require(spacing > 0.0, "spacing", "a positive distance in metres", spacing);
  require(colors.rows() == 0 || colors.rows() == frame.points.rows(), "colors", "one row per pixel", colors.rows());
  FusionReport report;
  const bool with_colors = colors.rows() > 0 || !model.colors.empty();
  if (with_colors) {
    model.colors.resize(model.points.size(), Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  }
  const SurfaceObserver observer(frame, camera, options, colors, num_threads);
  const std::vector<std::uint8_t> covered =
      update(model, frame, camera, observer, world_from_camera, spacing, frame_index, options, report, num_threads);
  const std::vector<NewPoint> candidates = find_new_points(frame, observer, covered, num_threads);
  insert(model, candidates, frame, world_from_camera, spacing, frame_index, with_colors, report);
  remove_unconfirmed(model, frame_index, options, report);
  return report;
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
