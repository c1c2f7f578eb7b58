#include "nacre/fusion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "check.hpp"
#include "fusion_step.hpp"
#include "parallel.hpp"
#include "point_grid.hpp"


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

struct Disc {
  std::int32_t pixel;
  float radius;  // [pixels]
};

// Marks the pixels of a disc.
void cover(std::vector<std::uint8_t>& covered, int width, int height, const Disc& disc) {
  const int u = disc.pixel % width, v = disc.pixel / width;
  const int reach = static_cast<int>(disc.radius);
  for (int y = std::max(0, v - reach); y <= std::min(height - 1, v + reach); ++y) {
    for (int x = std::max(0, u - reach); x <= std::min(width - 1, u + reach); ++x) {
      const auto dx = static_cast<float>(x - u), dy = static_cast<float>(y - v);
      if (dx * dx + dy * dy <= disc.radius * disc.radius) {
        covered[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)] = 1;
      }
    }
  }
}

// Where the model's points are in the image.
struct Projections {
  std::vector<std::int32_t> pixel;  // the nearest pixel of the image, also of points outside; -1 behind the camera
  std::vector<std::uint8_t> covered;  // pixels whose surface the model has
};

// Moves the model's points by what the frame says about them.
Projections update(PointModel& model, const Frame& frame, const Camera& camera, const SurfaceObserver& observer,
                   const Pose& world_from_camera, double spacing, std::int32_t frame_index,
                   const FusionOptions& options, FusionReport& report, int num_threads) {
  const Eigen::Isometry3f camera_from_world(world_from_camera.inverse().cast<float>());
  const Eigen::Matrix3f world_rotation = world_from_camera.linear().cast<float>();
  constexpr std::int64_t block_size = ObservationBlock::capacity;
  const std::int64_t count = model.size();
  Projections projections{std::vector<std::int32_t>(static_cast<std::size_t>(count), -1),
                          std::vector<std::uint8_t>(static_cast<std::size_t>(frame.points.rows()), 0)};
  std::vector<std::vector<Disc>> discs(static_cast<std::size_t>((count + block_size - 1) / block_size));

  parallel_blocks(count, block_size, num_threads, [&](std::int64_t number, std::int64_t begin, std::int64_t end) {
    ObservationBlock block;
    struct Seen {
      std::size_t index;
      Eigen::Vector3f point, normal;
      float facing, sigma;
      std::int32_t pixel;
    };
    Seen seen[block_size];
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
      const Eigen::Vector3f point = camera_from_world * model.points[i];
      const Projection projection = observer.project(point);
      projections.pixel[i] = projection.nearest_pixel;
      if (!projection.is_inside) continue;
      const Eigen::Vector3f normal = camera_from_world.linear() * model.normals[i];
      const float facing = normal.dot(observer.towards_camera(point));
      if (!(facing > least_facing)) continue;
      const float measured_sigma = frame.sigma[projection.nearest_pixel];
      const float sigma = std::isfinite(measured_sigma) ? measured_sigma : 0.0F;
      seen[block.size()] = {i, point, normal, facing, sigma, projection.nearest_pixel};
      observer.add(block, point, normal, projection.nearest_pixel, sigma);
    }
    observer.observe(block);
    for (int k = 0; k < block.size(); ++k) {
      const auto& [i, point, normal, facing, sigma, pixel] = seen[k];
      const Observation observed = block[k];
      if (observed.weight > least_weight) {
        const float gain = observed.weight / (model.confidence[i] + observed.weight);
        model.points[i] += world_rotation * (gain * observed.offset * normal);
        model.normals[i] = (model.confidence[i] * model.normals[i] + world_rotation * observed.normal).normalized();
        if (observer.has_colors()) {
          Eigen::Vector3f& color = model.colors[i];
          color = color.allFinite() ? Eigen::Vector3f(color + gain * (observed.color - color)) : observed.color;
        }
        model.confidence[i] =
            std::min(model.confidence[i] + observed.weight, static_cast<float>(options.max_confidence));
        model.last_seen[i] = frame_index;
        model.violations[i] = 0;
        const auto footprint = static_cast<float>(camera.footprint(point.z()));
        discs[static_cast<std::size_t>(number)].push_back(
            {pixel, 0.7F * static_cast<float>(spacing) / footprint * facing});
      } else if (observer.sees_through(point, pixel, std::max(static_cast<float>(2.0 * spacing), 4.0F * sigma))) {
        model.violations[i] = static_cast<std::uint8_t>(std::min(255, model.violations[i] + 1));
      }
    }
  });

  for (const std::vector<Disc>& block : discs) {
    report.num_updated += static_cast<std::int64_t>(block.size());
    for (const Disc& disc : block) cover(projections.covered, frame.width, frame.height, disc);
  }
  return projections;
}

// The frame's surface where the model does not cover it, denoised.
std::vector<NewPoint> find_new_points(const Frame& frame, const SurfaceObserver& observer,
                                      const std::vector<std::uint8_t>& covered, int num_threads) {
  std::vector<std::int32_t> rows;
  for (const std::int32_t row : frame.valid) {
    if (!covered[static_cast<std::size_t>(row)]) rows.push_back(row);
  }
  constexpr std::int64_t block_size = ObservationBlock::capacity;
  const auto count = static_cast<std::int64_t>(rows.size());
  std::vector<std::vector<NewPoint>> found(static_cast<std::size_t>((count + block_size - 1) / block_size));
  parallel_blocks(count, block_size, num_threads, [&](std::int64_t number, std::int64_t begin, std::int64_t end) {
    ObservationBlock block;
    std::vector<NewPoint>& candidates = found[static_cast<std::size_t>(number)];
    for (std::int64_t i = begin; i < end; ++i) {
      NewPoint candidate;
      candidate.row = rows[static_cast<std::size_t>(i)];
      candidate.point = frame.points.row(candidate.row).transpose();
      candidate.normal = frame.normals.row(candidate.row).transpose();
      if (!(candidate.normal.dot(observer.towards_camera(candidate.point)) > least_facing)) continue;
      observer.add(block, candidate.point, candidate.normal, candidate.row, frame.sigma[candidate.row]);
      candidates.push_back(candidate);
    }
    observer.observe(block);
    std::size_t kept = 0;
    for (int k = 0; k < block.size(); ++k) {
      const Observation observed = block[k];
      if (!(observed.weight > insertion_weight)) continue;
      NewPoint candidate = candidates[static_cast<std::size_t>(k)];
      candidate.point += observed.offset * candidate.normal;
      candidate.normal = observed.normal.normalized();
      if (observer.has_colors()) candidate.color = observed.color;
      candidate.weight = observed.weight;
      candidates[kept++] = candidate;
    }
    candidates.resize(kept);
  });
  std::vector<NewPoint> all;
  for (const std::vector<NewPoint>& candidates : found) all.insert(all.end(), candidates.begin(), candidates.end());
  return all;
}

// Tiles of the image, marked around the places where points may be inserted: only the model's points there need to be
// looked at.
class TileMap {
 public:
  TileMap(int width, int height) : width_(width), height_(height), tiles_across_((width + size - 1) / size) {
    marked_.assign(static_cast<std::size_t>(tiles_across_) * static_cast<std::size_t>((height + size - 1) / size), 0);
  }
  void mark(std::int32_t pixel, int reach) {
    const int u = pixel % width_, v = pixel / width_;
    for (int y = std::max(0, v - reach) / size; y <= std::min(height_ - 1, v + reach) / size; ++y) {
      for (int x = std::max(0, u - reach) / size; x <= std::min(width_ - 1, u + reach) / size; ++x) {
        marked_[static_cast<std::size_t>(y * tiles_across_ + x)] = 1;
      }
    }
  }
  bool is_marked(std::int32_t pixel) const {
    return marked_[static_cast<std::size_t>(pixel / width_ / size * tiles_across_ + pixel % width_ / size)] != 0;
  }

 private:
  static constexpr int size = 16;  // [pixels]
  int width_, height_, tiles_across_;
  std::vector<std::uint8_t> marked_;
};

void insert(PointModel& model, const std::vector<NewPoint>& candidates, const std::vector<std::int32_t>& pixels,
            const Frame& frame, const Camera& camera, const Pose& world_from_camera, double spacing,
            std::int32_t frame_index, bool with_colors, FusionReport& report) {
  if (candidates.empty()) return;
  const auto offset_of = [&](const NewPoint& candidate) {
    return std::max(static_cast<float>(spacing), 3.0F * frame.sigma[candidate.row]);
  };
  TileMap tiles(frame.width, frame.height);
  for (const NewPoint& candidate : candidates) {
    const double distance = std::hypot(spacing, static_cast<double>(offset_of(candidate)));
    const double nearest_z = std::max(static_cast<double>(candidate.point.z()) - distance, 1e-3);
    tiles.mark(candidate.row, static_cast<int>(std::ceil(distance / camera.footprint(nearest_z))) + 1);
  }
  std::vector<std::size_t> nearby;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (pixels[i] >= 0 && tiles.is_marked(pixels[i])) nearby.push_back(i);
  }
  PointGrid grid(spacing, nearby.size() + candidates.size());
  for (const std::size_t i : nearby) grid.add(model.points[i]);

  const Eigen::Isometry3f to_world(world_from_camera.cast<float>());
  for (const NewPoint& candidate : candidates) {
    const Eigen::Vector3f point = to_world * candidate.point;
    const Eigen::Vector3f normal = to_world.linear() * candidate.normal;
    const bool is_known = grid.any_near(point, [&](std::int32_t number) {
      const std::size_t i = nearby[static_cast<std::size_t>(number)];
      return same_surface(point, normal, model.points[i], model.normals[i], static_cast<float>(spacing),
                          offset_of(candidate));
    });
    if (is_known) continue;
    grid.add(point);
    nearby.push_back(model.points.size());
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

FusionReport fuse_observed(PointModel& model, const Frame& frame, const Camera& camera, const SurfaceObserver& observer,
                           const Pose& world_from_camera, double spacing, std::int32_t frame_index,
                           const FusionOptions& options, int num_threads) {
  FusionReport report;
  const bool with_colors = observer.has_colors() || !model.colors.empty();
  if (with_colors) {
    model.colors.resize(model.points.size(), Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  }
  const Projections projections =
      update(model, frame, camera, observer, world_from_camera, spacing, frame_index, options, report, num_threads);
  const std::vector<NewPoint> candidates = find_new_points(frame, observer, projections.covered, num_threads);
  insert(model, candidates, projections.pixel, frame, camera, world_from_camera, spacing, frame_index, with_colors,
         report);
  remove_unconfirmed(model, frame_index, options, report);
  return report;
}

FusionReport fuse(PointModel& model, const Frame& frame, const Camera& camera, const Pose& world_from_camera,
                  double spacing, std::int32_t frame_index, const FusionOptions& options, const ColorsRef& colors,
                  int num_threads) {
  options.check();
  require(spacing > 0.0, "spacing", "a positive distance in metres", spacing);
  require(colors.rows() == 0 || colors.rows() == frame.points.rows(), "colors", "one row per pixel", colors.rows());
  const SurfaceObserver observer(frame, camera, options, colors, num_threads);
  return fuse_observed(model, frame, camera, observer, world_from_camera, spacing, frame_index, options, num_threads);
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
