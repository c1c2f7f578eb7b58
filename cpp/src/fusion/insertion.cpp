#include "fusion/insertion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/concatenate.hpp"
#include "base/limits.hpp"
#include "base/parallel.hpp"
#include "camera/point_spacing.hpp"
#include "fusion/exposure.hpp"
#include "fusion/limits.hpp"
#include "fusion/point_arrays.hpp"
#include "fusion/same_surface.hpp"

namespace nacre {
namespace {

struct NewPoint {
  std::int32_t row = 0;
  Eigen::Vector3f point = Eigen::Vector3f::Zero(), normal = point;  // camera frame
  Eigen::Vector3f color = Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN());
  float weight = 0.0F;
  float spacing = 0.0F;  // to its neighbours [m]
  int reach = 0;         // as far may they be in the image [pixels]
  PixelWindow cover = {};
};

// How far the neighbours of a point may be in the image: beyond the pixels that it covers where those are few.
int reach_of(const NewPoint& point, const Camera& camera) {
  const double pixels = std::ceil(static_cast<double>(point.spacing) / camera.footprint(point.point.z()));
  const int largest = std::max(camera.width(), camera.height());
  const bool is_in_image = pixels >= 0.0 && pixels < largest;  // not so behind the camera
  return std::max(point.cover.num_rows / 2, is_in_image ? static_cast<int>(pixels) : largest) + 1;
}

// The frame's surface where the model does not cover it, denoised. A new point must be seen by so many pixels of its
// own slant, and by more the greater it is: by as many as hold the information of so many from the front.
std::vector<NewPoint> find_candidates(const RegisteredFrame& now, const PixelSet& covered, double spacing,
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
    observer.observe_and_cover(block, base_limits::same_side_cosine);
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

}  // namespace

// One after the other, where neither the model nor a point before stands for the surface. The covered pixels rule most
// of them out at once, by what was measured; the others are compared as they are, without the noise: with the model
// all at once.
std::int64_t insert_points(PointModel& model, KnownSurface known, const RegisteredFrame& now, double spacing,
                           bool with_colors, int num_threads) {
  std::vector<NewPoint> candidates = find_candidates(now, known.covered, spacing, num_threads);
  if (candidates.empty()) return 0;
  const Frame& frame = now.frame;
  const Eigen::Isometry3f to_world(now.world_from_camera.cast<float>());
  const std::int64_t num_known = model.size();
  int farthest = 0;
  for (NewPoint& candidate : candidates) {
    candidate.point = to_world * candidate.point;
    candidate.normal = to_world.linear() * candidate.normal;
    farthest = std::max(farthest, candidate.reach);
  }
  const int side = std::max(1, farthest / fusion_limits::squares_across);
  const auto is_near = [&](const PixelIndex& points, const NewPoint& candidate) {
    const float largest_offset = std::max(candidate.spacing, base_limits::noise_sigmas * frame.sigma[candidate.row]);
    return points.any_near(candidate.row, candidate.reach, [&](std::size_t i) {
      return same_surface(candidate.point, candidate.normal, model.points[i], model.normals[i], candidate.spacing,
                          largest_offset);
    });
  };
  PixelIndex points_before(frame.width, frame.height, side), points(frame.width, frame.height, side);
  points_before.reserve(known.points.size());
  for (const KnownSurface::Point& seen : known.points) points_before.add(seen.pixel, seen.point);
  std::vector<std::uint8_t> is_known(candidates.size());
  parallel_for(static_cast<std::int64_t>(candidates.size()), 64, num_threads, [&](std::int64_t i) {
    const auto k = static_cast<std::size_t>(i);
    is_known[k] = is_near(points_before, candidates[k]) ? 1 : 0;
  });
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const NewPoint& candidate = candidates[k];
    if (known.covered.contains(candidate.row % frame.width, candidate.row / frame.width)) continue;
    known.covered.insert(candidate.cover);
    if (is_known[k] != 0 || is_near(points, candidate)) continue;
    points.add(candidate.row, model.points.size());
    make_room(model, model.points.size() + 1);
    model.points.push_back(candidate.point);
    model.normals.push_back(candidate.normal);
    if (with_colors) model.colors.push_back(candidate.color);
    model.confidence.push_back(candidate.weight);
    model.last_seen.push_back(now.index);
    model.observations.push_back(1);
    model.free_space_violations.push_back(0);
  }
  return model.size() - num_known;
}

}  // namespace nacre
