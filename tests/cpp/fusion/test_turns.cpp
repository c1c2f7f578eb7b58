#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "doctest/doctest.h"
#include "fusion/fuse.hpp"
#include "fusion/limits.hpp"
#include "fusion/observer.hpp"
#include "fusion/turns.hpp"

using namespace nacre;

namespace {

constexpr int side = fusion_limits::tile_side, width = 4 * side, height = 3 * side;
constexpr double spacing = 0.012;
const Camera& camera() {
  static const Camera kept = Camera::pinhole(width, height, 200, 200, 0.5 * width - 0.5, 0.5 * height - 0.5);
  return kept;
}

// A wall one metre away, and what a model knows of it: all that is right of x.
struct Wall {
  FusionOptions options;
  Frame frame = make_frame(DepthImage::Constant(height, width, 1.0F), camera(), NoiseModel{0.001, 0, 0});
  SurfaceObserver observer{camera(), options};
  PointModel model;

  explicit Wall(double known_from) {
    options.reference_sigma = 0.001;
    observer.look_at(frame, Colors(), 1);
    Frame part = frame;
    for (Eigen::Index i = 0; i < part.points.rows(); ++i) {
      if (static_cast<double>(part.points(i, 0)) < known_from) part.normals.row(i).setConstant(std::nanf(""));
    }
    for (int i = 0; i < options.turns * options.min_observations; ++i)
      fuse(model, part, camera(), Pose::Identity(), spacing, i, options);
  }

  std::set<std::pair<int, int>> next(FusionTurns& turns, const Pose& pose = Pose::Identity(),
                                     int num_threads = 1) const {
    const ImageTiles tiles = turns.next(model, {frame, camera(), observer, pose, 9}, spacing, options, num_threads);
    std::set<std::pair<int, int>> chosen;
    for (int v = 0; v < height; ++v) {
      for (int u = 0; u < width; ++u) {
        if (tiles(u, v) == InTiles::yes) chosen.insert({u / side, v / side});
      }
    }
    return chosen;
  }
};

}  // namespace

TEST_CASE("what is known and seen from the same place has its turn once in so many frames") {
  const Wall wall(-10.0);
  FusionTurns turns;
  std::multiset<std::pair<int, int>> all;
  for (int i = 0; i < FusionOptions().turns; ++i) {
    const auto chosen = wall.next(turns, Pose::Identity(), 1 + i);
    CHECK(chosen.size() == 3);
    all.insert(chosen.begin(), chosen.end());
  }
  CHECK(all.size() == 12);
  CHECK(std::set<std::pair<int, int>>(all.begin(), all.end()).size() == 12);
}

TEST_CASE("what the model lacks has its turn in every frame") {
  const Wall wall(0.0);
  FusionTurns turns;
  for (int i = 0; i < FusionOptions().turns; ++i) {
    const auto chosen = wall.next(turns);
    for (int y = 0; y < 3; ++y) {
      for (int x = 0; x < 2; ++x) CHECK(chosen.count({x, y}) == 1);
    }
    CHECK(chosen.size() < 9);
  }
}

TEST_CASE("what few frames have seen is no more known than what none has") {
  Wall wall(-10.0);
  std::fill(wall.model.observations.begin(), wall.model.observations.end(),
            static_cast<std::uint8_t>(wall.options.turns * wall.options.min_observations - 1));
  FusionTurns turns;
  for (int i = 0; i < FusionOptions().turns; ++i) CHECK(wall.next(turns).size() == 12);
}

TEST_CASE("what is seen from elsewhere has its turn at once, and then no more") {
  const Wall wall(-10.0);
  FusionTurns turns;
  wall.next(turns);
  Pose aside = Pose::Identity();
  aside.translation().x() = 1.01 * fusion_limits::other_view;
  CHECK(wall.next(turns, aside).size() == 12);
  CHECK(wall.next(turns, aside).size() == 3);
}

TEST_CASE("what is seen after a turn of the camera has its turn at once") {
  const Wall wall(-10.0);
  FusionTurns turns;
  wall.next(turns);
  Pose turned = Pose::Identity();
  turned.linear() = Eigen::AngleAxisd(1.01 * fusion_limits::other_view, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  CHECK(wall.next(turns, turned).size() == 12);
  CHECK(wall.next(turns, turned).size() == 3);
}

TEST_CASE("beside tiles are the pixels within the reach of a point, and an image without tiles is all in them") {
  const ImageTiles tiles(2 * side, 2 * side, {1, 0, 0, 0}, 10);
  CHECK(tiles(side - 1, side - 1) == InTiles::yes);
  CHECK(tiles(side + 9, 0) == InTiles::beside);
  CHECK(tiles(side + 9, side + 9) == InTiles::beside);
  CHECK(tiles(side + 16, 0) == InTiles::no);
  CHECK(ImageTiles()(1000, 1000) == InTiles::yes);
}

TEST_CASE("no point is put twice where a tile ends") {
  const Wall wall(-10.0);
  PointModel model = wall.model;
  const std::int64_t known = model.size();
  FusionTurns turns;
  for (int i = 0; i < 2 * FusionOptions().turns; ++i) {
    const RegisteredFrame now{wall.frame, camera(), wall.observer, Pose::Identity(), 10 + i};
    const ImageTiles tiles = turns.next(model, now, spacing, wall.options, 2);
    fuse_observed(model, now, tiles, spacing, wall.options, 2, {});
  }
  CHECK(model.size() == known);
}

TEST_CASE("with one turn every frame is folded in whole") {
  Wall wall(-10.0);
  wall.options.turns = 1;
  FusionTurns turns;
  for (int i = 0; i < 3; ++i) CHECK(wall.next(turns).size() == 12);
}

TEST_CASE("what the camera sees through is noticed in every frame") {
  const Wall wall(-10.0);
  PointModel model = wall.model;
  model.points[model.points.size() / 2 + 20] *= 0.5F;  // half way to the wall, within the image
  const auto is_before = [](const Eigen::Vector3f& p) { return p.z() < 0.9F; };
  FusionTurns turns;
  for (int i = 0; i < wall.options.max_free_space_violations; ++i) {
    CHECK(std::any_of(model.points.begin(), model.points.end(), is_before));
    const RegisteredFrame now{wall.frame, camera(), wall.observer, Pose::Identity(), 10 + i};
    fuse_observed(model, now, turns.next(model, now, spacing, wall.options, 2), spacing, wall.options, 2, {});
  }
  CHECK(std::none_of(model.points.begin(), model.points.end(), is_before));
}
