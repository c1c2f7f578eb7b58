#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "base/numbers.hpp"
#include "base/random.hpp"
#include "depth_images.hpp"
#include "doctest/doctest.h"
#include "loops/key_frames.hpp"
#include "loops/loop_closure.hpp"
#include "meshes.hpp"
#include "nacre/model.hpp"
#include "nacre/simulation.hpp"

using namespace nacre;
using namespace nacre_test;

namespace {

constexpr int frames_per_turn = 72;

Mesh box(const Eigen::Vector3d& center, const Eigen::Vector3d& size, double turn) {
  std::vector<Eigen::Vector3d> vertices;
  const Eigen::AngleAxisd rotation(turn, Eigen::Vector3d::UnitY());
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d corner((i >> 2 & 1) - 0.5, (i >> 1 & 1) - 0.5, (i & 1) - 0.5);
    vertices.push_back(center + rotation * corner.cwiseProduct(size));
  }
  return to_mesh(vertices, {{0, 1, 3},
                            {0, 3, 2},
                            {4, 6, 7},
                            {4, 7, 5},
                            {0, 4, 5},
                            {0, 5, 1},
                            {2, 3, 7},
                            {2, 7, 6},
                            {0, 2, 6},
                            {0, 6, 4},
                            {1, 5, 7},
                            {1, 7, 3}});
}

// A room of 4 m x 2.6 m x 4 m with boxes along its walls; a camera turns in the middle.
class Room {
 public:
  Room() : tree_(furnished()) {}

  static Camera camera(double focal_error = 0.0) {
    const double f = 180.0 * (1.0 + focal_error);
    return Camera::pinhole(208, 156, f, f, 103.5, 77.5);
  }
  static Pose pose(int k) {
    const double a = 2.0 * pi * k / frames_per_turn;
    Pose pose = Pose::Identity();
    pose.linear() = (Eigen::AngleAxisd(a, Eigen::Vector3d::UnitY()) *
                     Eigen::AngleAxisd(0.15 * std::sin(2.0 * a), Eigen::Vector3d::UnitX()))
                        .toRotationMatrix();
    pose.translation() = 0.3 * Eigen::Vector3d(std::sin(a), 0.2 * std::sin(3.0 * a), std::cos(a));
    return pose;
  }
  const DepthImage& view(int k) const {
    DepthImage& image = views_[k];
    if (image.size() == 0) {
      SimulationOptions options;
      options.noise = NoiseModel::kinect();
      options.seed = static_cast<std::uint64_t>(k);
      image = simulate_depth(tree_, camera(), pose(k), options);
    }
    return image;
  }

 private:
  static MeshTree furnished() {
    Mesh mesh = box(Eigen::Vector3d::Zero(), {4.0, 2.6, 4.0}, 0.0);
    const auto random = [](int i, int j) { return random_uniform(5, static_cast<std::uint64_t>(10 * i + j)); };
    for (int i = 0; i < 70; ++i) {
      const double a = 2.0 * pi * (i + random(i, 0)) / 70.0;
      const Eigen::Vector3d way(std::sin(a), 0.0, std::cos(a));
      Eigen::Vector3d place = (1.9 / way.cwiseAbs().maxCoeff() - 0.4 * random(i, 1)) * way;
      place.y() = 2.2 * random(i, 2) - 1.1;
      mesh = together(
          mesh,
          box(place, Eigen::Vector3d(0.1 + 0.4 * random(i, 3), 0.1 + 0.6 * random(i, 4), 0.1 + 0.4 * random(i, 5)),
              pi * random(i, 6)));
    }
    return MeshTree(mesh.vertices, mesh.triangles);
  }

  MeshTree tree_;
  mutable std::map<int, DepthImage> views_;
};

const Room& room() {
  static const Room instance;
  return instance;
}

// A full turn and 40 degrees more, with a camera whose focal length is given wrong: it takes itself to have turned
// farther, or less far, than it has.
Model turned(double focal_error, bool loop_closure, int num_threads = 0) {
  ModelOptions options;
  options.loop_closure = loop_closure;
  options.num_threads = num_threads;
  Model model(Room::camera(focal_error), options);
  for (int k = 0; k < frames_per_turn + 8; ++k) model.add_frame(room().view(k));
  return model;
}

int num_loops(const Model& model) {
  int count = 0;
  for (const FrameReport& report : model.frames()) count += report.loop_frame.has_value() ? 1 : 0;
  return count;
}

// Of what the cameras see 1.8 m ahead of them, root mean square [m].
double trajectory_error(const Model& model) {
  const Eigen::Vector3d ahead(0.0, 0.0, 1.8);
  double sum = 0.0;
  for (const FrameReport& report : model.frames()) {
    const Pose truth = Room::pose(0).inverse() * Room::pose(static_cast<int>(report.index));
    sum += (report.world_from_camera * ahead - truth * ahead).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(model.frames().size()));
}

// Part of the points that have another layer of the same surface 3 to 15 cm before or behind them.
double doubled_part(const Model& model) {
  const PointModel& cloud = model.cloud();
  const auto reach = static_cast<float>(model.spacing());
  int doubled = 0, count = 0;
  for (std::size_t i = 0; i < cloud.points.size(); i += 29, ++count) {
    for (std::size_t j = 0; j < cloud.points.size(); ++j) {
      const Eigen::Vector3f difference = cloud.points[j] - cloud.points[i];
      const float across = std::abs(difference.dot(cloud.normals[i]));
      if (across > 0.03F && across < 0.15F && difference.squaredNorm() < across * across + reach * reach &&
          cloud.normals[i].dot(cloud.normals[j]) > 0.8F) {
        ++doubled;
        break;
      }
    }
  }
  return static_cast<double>(doubled) / count;
}

template <class Value>
bool same_bits(const std::vector<Value>& a, const std::vector<Value>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Value)) == 0;
}

}  // namespace

TEST_CASE("a full turn with drift closes: poses and model") {
  for (const double focal_error : {-0.015, 0.015}) {
    const Model open = turned(focal_error, false), closed = turned(focal_error, true);
    CHECK(num_loops(open) == 0);
    REQUIRE(num_loops(closed) >= 1);
    CHECK(trajectory_error(closed) < 0.6 * trajectory_error(open));
    CHECK(doubled_part(open) > 0.01);
    CHECK(doubled_part(closed) < 0.4 * doubled_part(open));
    for (const FrameReport& report : closed.frames()) {
      if (!report.loop_frame) continue;
      CHECK(*report.loop_frame < report.index - frames_per_turn / 2);
      CHECK(report.loop_distance > 0.0);
    }
  }
}

TEST_CASE("the first camera stays where it is, and the newest is where the model is") {
  const Model model = turned(0.015, true);
  REQUIRE(num_loops(model) >= 1);
  CHECK((model.frames().front().world_from_camera.matrix() - Eigen::Matrix4d::Identity()).norm() < 1e-9);
  const PointModel seen = model.cloud_in_camera();
  const Pose last = model.frames().back().world_from_camera;
  const Eigen::Vector3d moved = last.inverse() * model.cloud().points.front().cast<double>();
  CHECK((moved - seen.points.front().cast<double>()).norm() < 1e-5);
}

TEST_CASE("what is known of a pose turns with it") {
  Model model(Room::camera(0.015));
  std::vector<FrameReport> told;
  for (int k = 0; k < frames_per_turn + 8; ++k) told.push_back(model.add_frame(room().view(k)));
  REQUIRE(num_loops(model) >= 1);
  const auto in_camera = [](const FrameReport& report) {
    Matrix6 turn = Matrix6::Zero();
    turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = report.world_from_camera.linear().transpose();
    return Matrix6(turn * report.information * turn.transpose());
  };
  double greatest_turn = 0.0;
  for (std::size_t k = 0; k < told.size(); ++k) {
    const FrameReport& corrected = model.frames()[k];
    const Matrix6 expected = in_camera(told[k]);
    CHECK((in_camera(corrected) - expected).norm() <= 1e-9 * expected.norm());
    greatest_turn = std::max(greatest_turn, (corrected.information - told[k].information).norm() /
                                                std::max(told[k].information.norm(), 1e-300));
  }
  CHECK(greatest_turn > 1e-3);
}

TEST_CASE("lost frames do not mix up which points a loop moves") {
  const auto with_blanks = [](int num_blank) {
    Model model(Room::camera(0.015));
    const DepthImage blank = DepthImage::Constant(156, 208, std::numeric_limits<float>::quiet_NaN());
    for (int k = 0; k < frames_per_turn + 8; ++k) {
      model.add_frame(room().view(k));
      for (int i = 0; k == 3 && i < num_blank; ++i) {
        CHECK(model.add_frame(blank).status == FrameStatus::lost);
      }
    }
    return model;
  };
  const Model without = with_blanks(0), with = with_blanks(12);
  REQUIRE(num_loops(without) >= 1);
  REQUIRE(num_loops(with) == num_loops(without));
  CHECK(doubled_part(with) < doubled_part(without) + 0.01);
}

TEST_CASE("loops close with the same bits for any number of threads") {
  const Model one = turned(0.015, true, 1), three = turned(0.015, true, 3);
  REQUIRE(num_loops(one) >= 1);
  CHECK(num_loops(one) == num_loops(three));
  CHECK(same_bits(one.cloud().points, three.cloud().points));
  CHECK(same_bits(one.cloud().normals, three.cloud().normals));
  for (std::size_t i = 0; i < one.frames().size(); ++i) {
    CHECK(one.frames()[i].world_from_camera.matrix() == three.frames()[i].world_from_camera.matrix());
  }
}

TEST_CASE("poses that are given are not corrected") {
  Model model(Room::camera(0.015));
  for (int k = 0; k < frames_per_turn + 8; ++k) {
    FrameExtras extras;
    extras.guess = Room::pose(k);
    extras.keep_guess = true;
    model.add_frame(room().view(k), extras);
  }
  CHECK(num_loops(model) == 0);
  for (int k = 0; k < frames_per_turn + 8; ++k) {
    CHECK(model.frames()[static_cast<std::size_t>(k)].world_from_camera.matrix() == Room::pose(k).matrix());
  }
}

// The built-in object on a turntable, twelve views around it.
class Turntable {
 public:
  static constexpr int num_views = 12;

  static Pose pose(int k) {
    Pose pose = Pose::Identity();
    pose.linear() = Eigen::AngleAxisd(2.0 * pi * k / num_views, Eigen::Vector3d::UnitY()).toRotationMatrix();
    pose.translation() = middle() - pose.linear() * (0.5 * Eigen::Vector3d::UnitZ());
    return pose;
  }
  static const Mesh& object() {
    static const Mesh mesh = built_in_object();
    return mesh;
  }
  static Eigen::Vector3d middle() {
    const Eigen::Vector3f low = object().vertices.colwise().minCoeff(), high = object().vertices.colwise().maxCoeff();
    return (0.5F * (low + high)).cast<double>();
  }
  static Model scanned(std::uint64_t seed, bool close_loops, bool is_given = false, int num_threads = 0) {
    const Camera camera = Camera::orthographic(130, 160, 0.0015);
    ModelOptions options;
    options.loop_closure = close_loops;
    options.num_threads = num_threads;
    Model model(camera, options);
    for (int k = 0; k < num_views; ++k) {
      FrameExtras extras;
      if (k == 0 || is_given) extras.guess = pose(k);
      extras.keep_guess = is_given || k == 0;
      DepthImage depth = clean(camera)[static_cast<std::size_t>(k)];
      add_noise(depth, {0.0005, 0.0, 0.0}, seed * num_views + static_cast<std::uint64_t>(k));
      model.add_frame(depth, extras);
    }
    return model;
  }
  static const std::vector<DepthImage>& clean(const Camera& camera) {
    static std::vector<DepthImage> images;
    if (images.empty()) {
      const MeshTree tree(object().vertices, object().triangles);
      for (int k = 0; k < num_views; ++k) images.push_back(simulate_depth(tree, camera, pose(k)));
    }
    return images;
  }
  static double largest_turn(const Model& model) {
    double most = 0.0;
    for (const FrameReport& report : model.frames()) {
      REQUIRE(report.status == FrameStatus::tracked);
      const Eigen::Matrix3d truth = pose(static_cast<int>(report.index)).linear();
      most = std::max(most, Eigen::AngleAxisd(truth.transpose() * report.world_from_camera.linear()).angle());
    }
    return most;
  }
};

TEST_CASE("views around an object determine each other better than each did when it was the newest") {
  double alone = 0.0, together = 0.0;
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const Model closed = Turntable::scanned(seed, true);
    CHECK(num_loops(closed) == 1);
    together += Turntable::largest_turn(closed);
    alone += Turntable::largest_turn(Turntable::scanned(seed, false));
  }
  CHECK(together < 0.7 * alone);
  CHECK(together / 3.0 < 0.0025);
}

TEST_CASE("a ring of views closes with the same bits for any number of threads") {
  const Model one = Turntable::scanned(1, true, false, 1), three = Turntable::scanned(1, true, false, 3);
  CHECK(num_loops(one) == 1);
  CHECK(same_bits(one.cloud().points, three.cloud().points));
}

TEST_CASE("a ring is not closed by a view that leaves directions open") {
  const Camera camera = Camera::orthographic(130, 160, 0.0015);
  ModelOptions options;
  for (const bool is_weak : {false, true}) {
    CAPTURE(is_weak);
    ParkedFiles nowhere("");
    LoopClosure loops(camera, options, nowhere);
    int num_closed = 0;
    for (int k = 0; k < Turntable::num_views; ++k) {
      const Frame frame = make_frame(Turntable::clean(camera)[static_cast<std::size_t>(k)], camera);
      SurfaceObserver observer(camera, options.fusion);
      observer.look_at(frame, ColorsRef(Colors()), 0);
      AlignResult alignment;
      alignment.target_from_source = Turntable::pose(k);
      alignment.center = Turntable::middle();
      alignment.information = 1e6 * Matrix6::Identity();
      if (is_weak) alignment.weak_directions = Vector6::Unit(4);
      const DepthView view{frame.points.col(2), frame.sigma};
      const LoopReport report = loops.add_frame({k, frame, view, observer, {}, alignment, 0.003, false, false});
      num_closed += report.frame.has_value() ? 1 : 0;
      CHECK(report.frame.has_value() == !report.corrections.empty());
    }
    CHECK(num_closed == (is_weak ? 0 : 1));
  }
}

TEST_CASE("a ring of given poses stays as it is") {
  const Model model = Turntable::scanned(1, true, true);
  CHECK(num_loops(model) == 0);
  CHECK(Turntable::largest_turn(model) == 0.0);
}

TEST_CASE("the distance of two views counts turns and, by depth, ways") {
  Pose turned_view = Pose::Identity(), moved_view = Pose::Identity();
  turned_view.linear() = Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitY()).toRotationMatrix();
  moved_view.translation().x() = 0.3;
  CHECK(view_distance(Pose::Identity(), turned_view, 2.0) == doctest::Approx(1.0));
  CHECK(view_distance(Pose::Identity(), moved_view, 2.0) == doctest::Approx(1.0));
  CHECK(view_distance(Pose::Identity(), moved_view, 4.0) == doctest::Approx(0.5));
}

TEST_CASE("a cloud that agrees with a view has points in the volume of that, from wherever it is seen") {
  const Camera camera = Room::camera();
  const Frame frame = make_frame(DepthImage::Constant(156, 208, 1.0F), camera);
  const FusionOptions options;
  SurfaceObserver observer(camera, options);
  observer.look_at(frame, Colors(), 0);
  const FrameCloud samples = sample_cloud(frame, observer, {});
  const KeyFrameView cloud{samples.points, samples.normals, {}};
  const DepthView view{frame.points.col(2), frame.sigma};
  const Box bounds = bounds_of(cloud.points);
  int num_agreeing = 0, num_outside = 0;
  for (std::uint64_t i = 0; i < 2000; ++i) {
    Pose camera_from_cloud = Pose::Identity();
    for (std::uint64_t axis = 0; axis < 3; ++axis) {
      const auto part = [&](std::uint64_t which) {
        return static_cast<double>(random_bits(which, 3 * i + axis) % 2001) / 1000.0 - 1.0;
      };
      camera_from_cloud.rotate(Eigen::AngleAxisd(part(1), Eigen::Vector3d::Unit(static_cast<Eigen::Index>(axis))));
      camera_from_cloud.translation()[static_cast<Eigen::Index>(axis)] = 2.0 * part(2);
    }
    const bool may_agree = agreeing_volume(view, camera_from_cloud.inverse(), camera, 0.12).may_hold(bounds);
    const bool agrees = compare(cloud, camera_from_cloud, view, camera, 0.12).agreeing > 0;
    num_agreeing += agrees ? 1 : 0;
    num_outside += may_agree ? 0 : 1;
    if (agrees) CHECK(may_agree);
  }
  CHECK(num_agreeing > 50);
  CHECK(num_outside > 500);
}

TEST_CASE("a cloud is found in its own view, not behind the camera, and seen through where nothing is") {
  const Camera camera = Room::camera();
  const Frame frame = make_frame(DepthImage::Constant(156, 208, 1.0F), camera);
  const FusionOptions options;
  SurfaceObserver observer(camera, options);
  observer.look_at(frame, Colors(), 0);
  const FrameCloud samples = sample_cloud(frame, observer, {});
  const KeyFrameView cloud{samples.points, samples.normals, {}};
  CHECK(cloud.points.rows() == 3000);
  CHECK(samples.depth == doctest::Approx(1.0).epsilon(0.001));
  const DepthView view{frame.points.col(2), frame.sigma};
  CHECK(compare(cloud, Pose::Identity(), view, camera, 0.02).agreeing == 3000);
  Pose behind = Pose::Identity(), nearer = Pose::Identity(), farther = Pose::Identity();
  behind.linear() = Eigen::AngleAxisd(pi, Eigen::Vector3d::UnitY()).toRotationMatrix();
  nearer.translation().z() = -0.2;
  farther.translation().z() = 0.2;
  CHECK(compare(cloud, behind, view, camera, 0.02).agreeing == 0);
  CHECK(compare(cloud, nearer, view, camera, 0.02).seen_through > 1500);
  CHECK(compare(cloud, nearer, view, camera, 0.02).agreeing == 0);
  CHECK(compare(cloud, farther, view, camera, 0.02).seen_through == 0);
  CHECK(compare(cloud, farther, view, camera, 0.02).occluded > 1500);
}
