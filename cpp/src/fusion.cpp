#include "nacre/fusion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "check.hpp"
#include "parallel.hpp"
#include "point_grid.hpp"

namespace nacre {
namespace {

constexpr int max_window = 4;             // pixels on each side of a model point that may observe it
constexpr float least_weight = 0.05F;     // less observation than this is none
constexpr float insertion_weight = 2.0F;  // a new point must be seen by so many pixels of its frame
constexpr float sheet_cosine = 0.3F;      // normals that differ more belong to different sheets
constexpr float least_facing = 0.1F;      // surfaces that are seen at a smaller cosine are not judged

// What the pixels around a surface point say about it.
struct Observation {
  float weight = 0.0F;
  float offset = 0.0F;  // along the point's normal [m]
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  Eigen::Vector3f color = Eigen::Vector3f::Zero();
};

// A frame, ready to be asked about points of the camera frame.
class Observer {
 public:
  Observer(const Frame& frame, const Camera& camera, const FusionOptions& options, const ColorsRef& colors)
      : frame_(frame), camera_(camera), options_(options), colors_(colors) {
    reference_sigma_ = static_cast<float>(options.reference_sigma);
    if (!(reference_sigma_ > 0.0F)) {
      std::vector<float> sigma;
      for (const std::int32_t row : frame.valid) sigma.push_back(frame.sigma[row]);
      const auto middle = sigma.begin() + static_cast<std::ptrdiff_t>(sigma.size() / 2);
      if (!sigma.empty()) {
        std::nth_element(sigma.begin(), middle, sigma.end());
        reference_sigma_ = *middle;
      }
    }
    cos_max_angle_ = static_cast<float>(std::cos(options.max_angle));
  }

  bool has_colors() const { return colors_.rows() > 0; }

  // The pixel nearest to the projection of a point, or -1.
  std::int32_t pixel_of(const Eigen::Vector3f& point) const {
    const Eigen::Vector2d pixel = camera_.project(point.cast<double>());
    if (!(pixel.x() > -0.5 && pixel.y() > -0.5 && pixel.x() < frame_.width - 0.5 && pixel.y() < frame_.height - 0.5)) {
      return -1;
    }
    return static_cast<std::int32_t>(pixel.y() + 0.5) * frame_.width + static_cast<std::int32_t>(pixel.x() + 0.5);
  }

  Eigen::Vector3f towards_camera(const Eigen::Vector3f& point) const {
    if (camera_.model() == Camera::Model::orthographic) return {0.0F, 0.0F, -1.0F};
    return -point.normalized();
  }

  // Radius of the kernel at a depth: wide enough to average the noise, narrow enough to keep the shape.
  float support(float z, float sigma) const {
    if (options_.support > 0.0) return static_cast<float>(options_.support);
    const auto pixel = static_cast<float>(camera_.footprint(z));
    return std::clamp(5.0F * sigma, 2.5F * pixel, static_cast<float>(max_window) * pixel);
  }

  // The residual of the symmetric implicit moving-least-squares surface:
  // offset = sum of w (n_i + n_j) / 2 . (q_j - x_i) / sum of w; it vanishes to second order on constant curvature.
  Observation observe(const Eigen::Vector3f& point, const Eigen::Vector3f& normal, std::int32_t pixel,
                      float sigma) const {
    Observation sum;
    const float radius = support(point.z(), sigma);
    const float inverse_variance = 4.0F / (radius * radius);  // the kernel's standard deviation is half its radius
    const float largest_offset = std::max(radius, 4.0F * sigma);
    const int window = std::clamp(static_cast<int>(std::ceil(radius / camera_.footprint(point.z()))), 1, max_window);
    const int u = pixel % frame_.width, v = pixel / frame_.width;
    for (int y = std::max(0, v - window); y <= std::min(frame_.height - 1, v + window); ++y) {
      for (int x = std::max(0, u - window); x <= std::min(frame_.width - 1, u + window); ++x) {
        const Eigen::Index row = static_cast<Eigen::Index>(y) * frame_.width + x;
        const Eigen::Vector3f q = frame_.points.row(row).transpose();
        const Eigen::Vector3f q_normal = frame_.normals.row(row).transpose();
        const Eigen::Vector3f difference = q - point;
        const float along = difference.dot(normal);
        const float across_squared = difference.squaredNorm() - along * along;
        // Written so that NaN fails.
        if (!(across_squared < radius * radius && std::abs(along) < largest_offset &&
              q_normal.dot(normal) > cos_max_angle_)) {
          continue;
        }
        const float w = weight_of(row, q, q_normal) * std::exp(-0.5F * across_squared * inverse_variance);
        sum.weight += w;
        sum.offset += w * 0.5F * (normal + q_normal).dot(difference);
        sum.normal += w * q_normal;
        if (has_colors()) sum.color += w * colors_.row(row).transpose().cast<float>();
      }
    }
    if (sum.weight > 0.0F) {
      sum.offset /= sum.weight;
      sum.color /= sum.weight;
    }
    return sum;
  }

  // Whether every pixel around measures something behind a point.
  bool sees_through(const Eigen::Vector3f& point, std::int32_t pixel, float margin) const {
    const int u = pixel % frame_.width, v = pixel / frame_.width;
    if (u < 1 || v < 1 || u + 1 >= frame_.width || v + 1 >= frame_.height) return false;
    for (int y = v - 1; y <= v + 1; ++y) {
      for (int x = u - 1; x <= u + 1; ++x) {
        const float z = frame_.points(static_cast<Eigen::Index>(y) * frame_.width + x, 2);
        if (!(z > point.z() + margin)) return false;
      }
    }
    return true;
  }

  // An observation counts by its information, and less when it is oblique.
  float weight_of(Eigen::Index row, const Eigen::Vector3f& point, const Eigen::Vector3f& normal) const {
    const float ratio = reference_sigma_ / frame_.sigma[row];
    return std::max(0.0F, normal.dot(towards_camera(point))) * ratio * ratio;
  }

 private:
  const Frame& frame_;
  const Camera& camera_;
  const FusionOptions& options_;
  const ColorsRef& colors_;
  float reference_sigma_ = 1.0F, cos_max_angle_ = 0.5F;
};

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
std::vector<std::uint8_t> update(PointModel& model, const Frame& frame, const Camera& camera, const Observer& observer,
                                 const Pose& world_from_camera, double spacing, std::int32_t frame_index,
                                 const FusionOptions& options, FusionReport& report, int num_threads) {
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
std::vector<NewPoint> find_new_points(const Frame& frame, const Observer& observer,
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
  const Observer observer(frame, camera, options, colors);
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
