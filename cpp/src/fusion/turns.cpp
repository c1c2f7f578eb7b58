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

// The image in squares of a few pixels, and which of them show a surface that the model knows well.
class KnownSquares {
 public:
  KnownSquares(const PointModel& model, const RegisteredFrame& now, double spacing, const FusionOptions& options,
               int num_threads)
      : across_(ImageTiles::squares_in(now.frame.width)),
        known_(static_cast<std::size_t>(across_) * static_cast<std::size_t>(ImageTiles::squares_in(now.frame.height))) {
    const Frame& frame = now.frame;
    const PointProjection view(now.camera, now.world_from_camera);
    // So often that it has been confirmed in turn, too: of n observations each moves a point by an n-th.
    const int least_observations = std::min(255, options.turns * options.min_observations);
    const auto surface = static_cast<float>(camera_limits::surface_spacings * spacing);
    parallel_blocks(
        model.size(), PointProjection::capacity, num_threads, [&](std::int64_t, std::int64_t begin, std::int64_t end) {
          const auto first = static_cast<std::size_t>(begin);
          PointProjection::Block points;
          view.project(model.points[first].data(), model.normals[first].data(), static_cast<int>(end - begin), points);
          for (int j = 0; j < static_cast<int>(end - begin); ++j) {
            if (!points.inside[j] || !(points.facing[j] > fusion_limits::least_facing)) continue;
            if (model.observations[first + static_cast<std::size_t>(j)] < least_observations) continue;
            const std::int32_t pixel = points.pixel[j];
            const float margin = std::max(surface, base_limits::noise_sigmas * frame.sigma[pixel]);
            if (!(std::abs(frame.points(pixel, 2) - points.z[j]) < margin)) continue;
            known_[square(pixel % frame.width, pixel / frame.width)].store(true, std::memory_order_relaxed);
          }
        });
  }

  // Whether much of what a tile measures is not; the depth of the nearest of it.
  Tile tile(const RegisteredFrame& now, int x, int y) const {
    using fusion_limits::known_square;
    Tile found;
    int measured = 0, missing = 0;
    const int right = std::min((x + 1) * fusion_limits::tile_side, now.frame.width);
    const int bottom = std::min((y + 1) * fusion_limits::tile_side, now.frame.height);
    for (int v = y * fusion_limits::tile_side + known_square / 2; v < bottom; v += known_square) {
      for (int u = x * fusion_limits::tile_side + known_square / 2; u < right; u += known_square) {
        if (!(now.observer.weight(u, v) > 0.0F)) continue;
        ++measured;
        missing += !known_[square(u, v)].load(std::memory_order_relaxed);
        found.nearest = std::min(found.nearest, now.frame.points(v * now.frame.width + u, 2));
      }
    }
    found.is_lacking = missing >= fusion_limits::lacking_part * measured;  // where nothing is measured, too
    return found;
  }

 private:
  std::size_t square(int u, int v) const {
    return static_cast<std::size_t>(v / fusion_limits::known_square * across_ + u / fusion_limits::known_square);
  }

  int across_;
  std::vector<std::atomic<bool>> known_;
};

}  // namespace

std::size_t FusionTurns::num_tiles(const Camera& camera) {
  return static_cast<std::size_t>(ImageTiles::tiles_in(camera.width())) *
         static_cast<std::size_t>(ImageTiles::tiles_in(camera.height()));
}

ImageTiles FusionTurns::next(const PointModel& model, const RegisteredFrame& now, double spacing,
                             const FusionOptions& options, int num_threads) {
  const Frame& frame = now.frame;
  const int across = ImageTiles::tiles_in(frame.width), down = ImageTiles::tiles_in(frame.height);
  const Pose& here = now.world_from_camera;
  const KnownSquares squares(model, now, spacing, options, num_threads);
  if (seen_from_.empty()) seen_from_.assign(num_tiles(now.camera), here);
  std::vector<std::uint8_t> is_next(seen_from_.size());
  float nearest = std::numeric_limits<float>::infinity();
  for (int y = 0; y < down; ++y) {
    for (int x = 0; x < across; ++x) {
      const auto i = static_cast<std::size_t>(y * across + x);
      const Tile tile = squares.tile(now, x, y);
      const double shift = (here.translation() - seen_from_[i].translation()).norm();
      const double motion = angle_between(here, seen_from_[i]) + shift / static_cast<double>(tile.nearest);
      const bool is_its_turn = (x + 2 * y + turn_) % options.turns == 0;
      is_next[i] = is_its_turn || motion > fusion_limits::other_view || tile.is_lacking;
      nearest = std::min(nearest, tile.nearest);
      if (is_next[i] != 0) seen_from_[i] = here;
    }
  }
  ++turn_;
  const double reach = spacing / now.camera.footprint(static_cast<double>(nearest));  // [pixels] between points
  const int border = static_cast<int>(std::min(reach, static_cast<double>(std::max(frame.width, frame.height)))) + 1;
  return {frame.width, frame.height, is_next, border};
}

}  // namespace nacre
