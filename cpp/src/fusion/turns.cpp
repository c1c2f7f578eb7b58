#include "fusion/turns.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "base/limits.hpp"
#include "base/parallel.hpp"
#include "base/se3.hpp"
#include "camera/limits.hpp"
#include "camera/point_projection.hpp"
#include "fusion/limits.hpp"

namespace nacre {
namespace {

struct Tile {
  bool is_lacking = false;
  float nearest = std::numeric_limits<float>::infinity();  // [m]
};

// The image in squares of a few pixels, and which of them show a surface that the model has confirmed.
class ConfirmedSquares {
 public:
  ConfirmedSquares(const PointModel& model, const RegisteredFrame& now, double spacing, const FusionOptions& options,
                   int num_threads)
      : across_((now.frame.width + side - 1) / side),
        confirmed_(static_cast<std::size_t>(across_) * static_cast<std::size_t>((now.frame.height + side - 1) / side)) {
    const Frame& frame = now.frame;
    const PointProjection view(now.camera, now.world_from_camera);
    const auto surface = static_cast<float>(camera_limits::surface_spacings * spacing);
    parallel_blocks(
        model.size(), PointProjection::capacity, num_threads, [&](std::int64_t, std::int64_t begin, std::int64_t end) {
          const auto first = static_cast<std::size_t>(begin);
          PointProjection::Block points;
          view.project(model.points[first].data(), model.normals[first].data(), static_cast<int>(end - begin), points);
          for (int j = 0; j < static_cast<int>(end - begin); ++j) {
            if (!points.inside[j] || !(points.facing[j] > fusion_limits::least_facing)) continue;
            if (model.observations[first + static_cast<std::size_t>(j)] < options.min_observations) continue;
            const std::int32_t pixel = points.pixel[j];
            const float margin = std::max(surface, base_limits::noise_sigmas * frame.sigma[pixel]);
            if (!(std::abs(frame.points(pixel, 2) - points.z[j]) < margin)) continue;
            at(pixel % frame.width, pixel / frame.width).store(true, std::memory_order_relaxed);
          }
        });
  }

  // Whether much of what a tile measures is not; the depth of the nearest of it.
  Tile tile(const RegisteredFrame& now, int first_u, int first_v) const {
    Tile found;
    int measured = 0, missing = 0;
    for (int v = first_v + side / 2; v < std::min(first_v + fusion_limits::tile_side, now.frame.height); v += side) {
      for (int u = first_u + side / 2; u < std::min(first_u + fusion_limits::tile_side, now.frame.width); u += side) {
        if (!(now.observer.weight(u, v) > 0.0F)) continue;
        ++measured;
        missing += !at(u, v).load(std::memory_order_relaxed);
        found.nearest = std::min(found.nearest, now.frame.points(v * now.frame.width + u, 2));
      }
    }
    found.is_lacking = missing >= fusion_limits::lacking_part * measured;  // where nothing is measured, too
    return found;
  }

 private:
  static constexpr int side = fusion_limits::known_square;
  std::atomic<bool>& at(int u, int v) { return confirmed_[static_cast<std::size_t>(v / side * across_ + u / side)]; }
  const std::atomic<bool>& at(int u, int v) const {
    return confirmed_[static_cast<std::size_t>(v / side * across_ + u / side)];
  }

  int across_;
  std::vector<std::atomic<bool>> confirmed_;
};

}  // namespace

std::size_t FusionTurns::num_tiles(const Camera& camera) {
  constexpr int side = fusion_limits::tile_side;
  return static_cast<std::size_t>((camera.width() + side - 1) / side) *
         static_cast<std::size_t>((camera.height() + side - 1) / side);
}

ImageTiles FusionTurns::next(const PointModel& model, const RegisteredFrame& now, double spacing,
                             const FusionOptions& options, int num_threads) {
  constexpr int side = fusion_limits::tile_side;
  const Frame& frame = now.frame;
  const int across = (frame.width + side - 1) / side, down = (frame.height + side - 1) / side;
  const Pose& here = now.world_from_camera;
  const ConfirmedSquares squares(model, now, spacing, options, num_threads);
  if (seen_from_.empty()) seen_from_.assign(num_tiles(now.camera), here);
  std::vector<std::uint8_t> is_next(seen_from_.size());
  float nearest = std::numeric_limits<float>::infinity();
  for (int y = 0; y < down; ++y) {
    for (int x = 0; x < across; ++x) {
      const auto i = static_cast<std::size_t>(y * across + x);
      const Tile tile = squares.tile(now, x * side, y * side);
      const auto depth = static_cast<double>(tile.nearest);
      const double moved = (here.translation() - seen_from_[i].translation()).norm();
      // By a tile: what was folded in then was something else.
      const bool has_turned = angle_between(here, seen_from_[i]) * depth > side * now.camera.footprint(depth);
      const bool is_its_turn = (x + 2 * y + turn_) % options.turns == 0;
      is_next[i] = is_its_turn || has_turned || moved > fusion_limits::other_direction * depth || tile.is_lacking;
      nearest = std::min(nearest, tile.nearest);
      if (is_next[i] != 0) seen_from_[i] = here;
    }
  }
  ++turn_;
  const double reach =
      spacing / now.camera.footprint(static_cast<double>(nearest));  // of a point in the image [pixels]
  const int border = static_cast<int>(std::min(reach, static_cast<double>(std::max(frame.width, frame.height)))) + 1;
  return {frame.width, frame.height, is_next, border};
}

}  // namespace nacre
