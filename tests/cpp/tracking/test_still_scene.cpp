#include "depth_images.hpp"
#include "doctest/doctest.h"
#include "tracking/still_scene.hpp"

using namespace nacre;
using namespace nacre_test;

namespace {

constexpr double margin = 0.01;

// A wall two metres away, and before it, a metre away, a board from one column of the image to another.
DepthImage wall_with_board(int first, int last) {
  DepthImage depth = render(pinhole, slanted_plane(2.0, 0.1, 0.3));
  for (int u = first; u < last; ++u) depth.col(u).setConstant(1.0F);
  return depth;
}

CoarseFrame cells_of(const DepthImage& depth) {
  return StillScene::cells_of(make_frame(depth, pinhole, NoiseModel{0.001, 0.0}), pinhole);
}

// Of the pixels, the part that moves.
double moving(const MaskImage& still) {
  if (still.size() == 0) return 0.0;
  return (still.cast<double>() < 0.5).cast<double>().mean();
}

struct Seen {
  StillScene scene{pinhole};
  MaskImage still;

  void add(const DepthImage& depth, const Pose& world_from_camera = Pose::Identity()) {
    const CoarseFrame cells = cells_of(depth);
    still = scene.still_region(cells, world_from_camera, margin);
    scene.add(cells, still, world_from_camera, margin);
  }
};

}  // namespace

TEST_CASE("a board that has come in moves, whole") {
  Seen seen;
  seen.add(wall_with_board(0, 0));
  CHECK(moving(seen.still) == 0.0);
  seen.add(wall_with_board(30, 60));
  CHECK(moving(seen.still) == doctest::Approx(30.0 / width).epsilon(0.2));
  for (int u = 31; u < 59; ++u) CHECK(seen.still.col(u).maxCoeff() == 0);
  CHECK(seen.still.leftCols(20).minCoeff() == 1);
  CHECK(seen.still.rightCols(50).minCoeff() == 1);
}

TEST_CASE("nothing moves where all is as it was, or what has come in is narrow, or fills the image") {
  Seen seen;
  seen.add(wall_with_board(30, 60));
  seen.add(wall_with_board(30, 60));
  CHECK(moving(seen.still) == 0.0);
  seen.add(wall_with_board(29, 61));  // an edge that is not quite where it was
  CHECK(moving(seen.still) == 0.0);
  Seen other;
  other.add(wall_with_board(0, 0));
  other.add(wall_with_board(5, width - 5));
  CHECK(moving(other.still) == 0.0);
}

TEST_CASE("what was behind somebody who has left is the scene, and he moves when he comes back") {
  Seen seen;
  seen.add(wall_with_board(30, 60));
  seen.add(wall_with_board(0, 0));
  CHECK(moving(seen.still) == 0.0);
  seen.add(wall_with_board(30, 60));
  CHECK(moving(seen.still) > 0.2);
}

TEST_CASE("what stays while the camera goes on becomes part of the scene") {
  Seen seen;
  Pose turned = Pose::Identity();
  const auto turn_by = [&](double angle) {
    turned.linear() = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitX()).toRotationMatrix();
  };
  const auto board_seen_from = [&](bool is_there) {
    DepthImage depth = wall_with_board(0, 0);
    const Plane wall = slanted_plane(2.0, 0.1, 0.3);
    for (Eigen::Index i = 0; i < depth.size(); ++i) {
      const Ray ray = ray_of(pinhole, i);
      const Eigen::Vector3d d = turned.linear() * Eigen::Vector3d(ray.direction_x, ray.direction_y, ray.direction_z);
      const bool is_board = is_there && std::abs(d.x() / d.z()) < 0.15;
      depth.data()[i] = static_cast<float>(is_board ? 1.0 / d.z() : wall.offset / wall.normal.dot(d));
    }
    return depth;
  };
  seen.add(board_seen_from(false), turned);
  seen.add(board_seen_from(true), turned);
  CHECK(moving(seen.still) > 0.1);
  for (int i = 1; i < 12; ++i) {
    turn_by(0.05 * i);
    seen.add(board_seen_from(true), turned);
  }
  CHECK(moving(seen.still) == 0.0);
}

TEST_CASE("points of a thing that has left are told from those of the wall") {
  const auto points_of = [](const DepthImage& depth) {
    const Frame frame = make_frame(depth, pinhole, NoiseModel{0.001, 0.0});
    Points points(static_cast<Eigen::Index>(frame.valid.size()), 3), normals = points;
    for (std::size_t i = 0; i < frame.valid.size(); ++i) {
      points.row(static_cast<Eigen::Index>(i)) = frame.points.row(frame.valid[i]);
      normals.row(static_cast<Eigen::Index>(i)) = frame.normals.row(frame.valid[i]);
    }
    return std::pair(points, normals);
  };
  const auto view_of = [](const DepthImage& depth) {
    const Frame frame = make_frame(depth, pinhole, NoiseModel{0.001, 0.0});
    return DepthView{frame.points.col(2), frame.sigma};
  };
  const auto [points, normals] = points_of(wall_with_board(30, 60));
  const auto stays_before = [&](const DepthImage& depth) {
    return still_points(points, normals, view_of(depth), Pose::Identity(), pinhole, margin);
  };
  CHECK(static_cast<Eigen::Index>(stays_before(wall_with_board(30, 60)).size()) == points.rows());
  CHECK(static_cast<Eigen::Index>(stays_before(wall_with_board(31, 61)).size()) == points.rows());
  for (const std::int32_t row : stays_before(wall_with_board(0, 0))) {
    const double u = points(row, 0) / points(row, 2) * pinhole.fx() + pinhole.cx();
    CHECK((points(row, 2) > 1.5F || u < 34.0 || u > 56.0));
  }
  CHECK(stays_before(wall_with_board(0, 0)).size() > 4000);
}
