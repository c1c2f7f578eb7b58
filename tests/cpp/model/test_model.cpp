#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <memory>

#include "base/numbers.hpp"
#include "base/random.hpp"
#include "doctest/doctest.h"
#include "nacre/model.hpp"
#include "nacre/simulation.hpp"

using namespace nacre;

namespace {

// The built-in object on a turntable, seen by an orthographic camera of 1 mm pixels.
class Turntable {
 public:
  Turntable() : mesh_(built_in_object()), tree_(mesh_.vertices, mesh_.triangles) {}

  static Camera camera() { return Camera::orthographic(208, 176, 0.001); }

  // object_from_camera
  Pose pose(double degrees) const {
    Pose pose = Pose::Identity();
    const double a = degrees * pi / 180.0;
    const Eigen::Vector3d back(std::sin(a), 0.0, std::cos(a)), right(std::cos(a), 0.0, -std::sin(a));
    pose.linear().col(0) = right;
    pose.linear().col(1) = -Eigen::Vector3d::UnitY();
    pose.linear().col(2) = -back;
    pose.translation() = 0.5 * (tree_.lower() + tree_.upper()) + 0.3 * back;
    return pose;
  }
  Pose world_from_camera(double degrees) const { return pose(0.0).inverse() * pose(degrees); }

  const DepthImage& view(double degrees) const {
    DepthImage& image = views_[degrees];
    if (image.size() == 0) {
      SimulationOptions options;
      options.noise.constant = 0.0005;
      options.seed = static_cast<std::uint64_t>(std::lround(1000.0 * degrees));
      image = simulate_depth(tree_, camera(), pose(degrees), options);
    }
    return image;
  }

  double rms_of(const PointModel& model) const {
    double sum = 0.0;
    for (const Eigen::Vector3f& point : model.points) {
      sum += std::pow(tree_.closest(pose(0.0) * point.cast<double>()).distance, 2);
    }
    return std::sqrt(sum / static_cast<double>(model.size()));
  }

 private:
  Mesh mesh_;
  MeshTree tree_;
  mutable std::map<double, DepthImage> views_;
};

const Turntable& turntable() {
  static const Turntable instance;
  return instance;
}

template <class Value>
bool same_bits(const std::vector<Value>& a, const std::vector<Value>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(Value)) == 0);
}

bool same_bits(const PointModel& a, const PointModel& b) {
  return same_bits(a.points, b.points) && same_bits(a.normals, b.normals) && same_bits(a.colors, b.colors) &&
         same_bits(a.confidence, b.confidence) && same_bits(a.last_seen, b.last_seen) &&
         same_bits(a.free_space_violations, b.free_space_violations);
}

double angle_between(const Pose& a, const Pose& b) {
  return Eigen::AngleAxisd(a.linear().transpose() * b.linear()).angle() * 180.0 / pi;
}

Model grown(int frames, const ModelOptions& options = {}) {
  Model model(Turntable::camera(), options);
  for (int i = 0; i < frames; ++i) model.add_frame(turntable().view(20.0 * i));
  return model;
}

// The built-in object, stretched to both sides.
class Stretched {
 public:
  explicit Stretched(float factor) : mesh_(built_in_object()) {
    mesh_.vertices.col(0) *= factor;
    tree_ = std::make_unique<MeshTree>(mesh_.vertices, mesh_.triangles);
  }

  DepthImage view() const { return simulate_depth(*tree_, Turntable::camera(), turntable().pose(0.0)); }

  // Of points in the world frame, which is the first camera's.
  double rms_of(const std::vector<Eigen::Vector3f>& points) const {
    double sum = 0.0;
    for (const Eigen::Vector3f& point : points) {
      sum += std::pow(tree_->closest(turntable().pose(0.0) * point.cast<double>()).distance, 2);
    }
    return std::sqrt(sum / static_cast<double>(points.size()));
  }

 private:
  Mesh mesh_;
  std::unique_ptr<MeshTree> tree_;
};

DepthImage constant(float value) { return DepthImage::Constant(176, 208, value); }

}  // namespace

TEST_CASE("the loop tracks a turntable, and the model is better than the sensor") {
  const Model model = grown(4);
  REQUIRE(model.frames().size() == 4);
  for (std::size_t i = 0; i < 4; ++i) {
    const FrameReport& report = model.frames()[i];
    CHECK(report.status == FrameStatus::tracked);
    CHECK(report.reason.empty());
    CHECK(report.index == static_cast<std::int64_t>(i));
    CHECK(angle_between(report.world_from_camera, turntable().world_from_camera(20.0 * static_cast<double>(i))) < 0.3);
  }
  CHECK(turntable().rms_of(model.cloud()) < 0.00025);
  CHECK(model.frames().back().num_points == model.cloud().size());
  CHECK(model.spacing() == doctest::Approx(0.002));
}

TEST_CASE("lost frames change nothing") {
  Model model = grown(2);
  const PointModel before = model.cloud();
  const Pose last = model.frames().back().world_from_camera;
  DepthImage few = constant(std::numeric_limits<float>::quiet_NaN());
  few.block(80, 100, 5, 10).setConstant(0.3F);
  DepthImage noise(176, 208);
  for (Eigen::Index i = 0; i < noise.size(); ++i) {
    noise.data()[i] = static_cast<float>(0.05 + 0.35 * random_uniform(3, static_cast<std::uint64_t>(i)));
  }
  for (const DepthImage& depth : {constant(std::numeric_limits<float>::quiet_NaN()), constant(0.0F), few, noise}) {
    const FrameReport report = model.add_frame(depth);
    CHECK(report.status == FrameStatus::lost);
    CHECK_FALSE(report.reason.empty());
    CHECK(report.world_from_camera.matrix() == last.matrix());
    CHECK(same_bits(model.cloud(), before));
    CHECK(model.spacing() == doctest::Approx(0.002));
  }
  CHECK(model.add_frame(turntable().view(40.0)).status == FrameStatus::relocalised);
  CHECK(model.add_frame(turntable().view(60.0)).status == FrameStatus::tracked);
  CHECK(model.frames().size() == 8);
}

TEST_CASE("a first frame that is lost leaves the model empty") {
  Model model(Turntable::camera());
  CHECK(model.add_frame(constant(0.0F)).status == FrameStatus::lost);
  CHECK(model.cloud().size() == 0);
  CHECK(model.cloud_in_camera().size() == 0);
  CHECK(model.spacing() == 0.0);
  const FrameReport report = model.add_frame(turntable().view(0.0));
  CHECK(report.status == FrameStatus::tracked);
  CHECK(report.world_from_camera.matrix() == Pose::Identity().matrix());
  CHECK(model.cloud().size() > 1000);
}

TEST_CASE("misuse throws before anything is changed") {
  Model model = grown(1);
  const PointModel before = model.cloud();
  FrameExtras extras;
  extras.colors = Colors(7, 3);
  CHECK_THROWS_WITH_AS(model.add_frame(turntable().view(20.0), extras), doctest::Contains("colors must be"),
                       std::invalid_argument);
  extras = {};
  extras.mask = MaskImage::Ones(3, 3);
  CHECK_THROWS_WITH_AS(model.add_frame(turntable().view(20.0), extras), doctest::Contains("mask"),
                       std::invalid_argument);
  extras = {};
  extras.keep_guess = true;
  CHECK_THROWS_WITH_AS(model.add_frame(turntable().view(20.0), extras), doctest::Contains("keep_guess must be"),
                       std::invalid_argument);
  CHECK_THROWS_WITH_AS(model.add_frame(DepthImage::Constant(10, 10, 0.3F)), doctest::Contains("camera's size"),
                       std::invalid_argument);
  CHECK_THROWS_WITH_AS(model.add_frame(constant(300.0F)), doctest::Contains("depth_scale"), std::invalid_argument);
  CHECK(same_bits(model.cloud(), before));
  CHECK(model.frames().size() == 1);
}

TEST_CASE("guesses: of the first frame the world, kept ones the pose") {
  const Pose pose = turntable().world_from_camera(70.0);
  Model model(Turntable::camera());
  FrameExtras extras;
  extras.guess = pose;
  extras.timestamp = 4.5;
  const FrameReport first = model.add_frame(turntable().view(70.0), extras);
  CHECK(first.world_from_camera.isApprox(pose));
  CHECK(first.timestamp == 4.5);
  CHECK(turntable().rms_of(model.cloud()) < 0.0004);
  extras.guess = turntable().world_from_camera(100.0);
  extras.keep_guess = true;
  extras.timestamp.reset();
  const FrameReport second = model.add_frame(turntable().view(100.0), extras);
  CHECK(second.world_from_camera.matrix() == extras.guess->matrix());
  CHECK_FALSE(second.timestamp.has_value());
  CHECK(second.fusion.num_updated > 500);
}

TEST_CASE("the model in the newest camera's frame") {
  const Model model = grown(3);
  const PointModel seen = model.cloud_in_camera();
  const Pose pose = model.frames().back().world_from_camera;
  REQUIRE(seen.size() == model.cloud().size());
  for (std::size_t i = 0; i < seen.points.size(); i += 50) {
    CHECK((pose * seen.points[i].cast<double>() - model.cloud().points[i].cast<double>()).norm() < 1e-6);
    CHECK((pose.linear() * seen.normals[i].cast<double>() - model.cloud().normals[i].cast<double>()).norm() < 1e-5);
  }
}

TEST_CASE("the model never grows beyond its size") {
  ModelOptions options;
  options.max_points = 400;
  Model model(Turntable::camera(), options);
  double last = 0.0;
  for (int i = 0; i < 4; ++i) {
    const FrameReport report = model.add_frame(turntable().view(20.0 * i));
    CHECK(report.num_points <= 400);
    CHECK(report.spacing >= last);
    last = report.spacing;
  }
  CHECK(last > 0.002);
}

TEST_CASE("a model that deforms has a shape at each frame") {
  ModelOptions options;
  options.deform = true;
  Model model(Turntable::camera(), options);
  const std::vector<float> factors = {1.0F, 1.02F, 1.04F};
  for (const float factor : factors) CHECK(model.add_frame(Stretched(factor).view()).status != FrameStatus::lost);
  for (std::size_t i = 0; i < factors.size(); ++i) {
    const ShapeAtFrame shape = model.shape_at(static_cast<std::int64_t>(i));
    CHECK(shape.points.size() == model.cloud().points.size());
    CHECK(shape.normals.size() == shape.points.size());
    CHECK(shape.nodes.size() == static_cast<std::size_t>(model.frames().back().deformation.num_nodes));
    CHECK(Stretched(factors[i]).rms_of(shape.points) < 0.00045);
  }
  CHECK(Stretched(1.0F).rms_of(model.shape_at(2).points) > 0.0006);
  CHECK_THROWS_WITH_AS(model.shape_at(3), doctest::Contains("frame must be"), std::invalid_argument);
  CHECK_THROWS_WITH_AS(grown(1).shape_at(0), doctest::Contains("deform must be"), std::invalid_argument);
}

TEST_CASE("what is for rigid models is refused of one that deforms, by its name") {
  ModelOptions options = ModelOptions::preset("paper");
  options.deform = true;
  CHECK_THROWS_WITH_AS(options.check(), "fusion_method must be fuse for a model that deforms, got wlop",
                       std::invalid_argument);
  options.fusion_method = FusionMethod::fuse;
  CHECK_THROWS_WITH_AS(options.check(),
                       "registration.method must be another than paper for a model that deforms, got paper",
                       std::invalid_argument);
}

TEST_CASE("presets") {
  const ModelOptions paper = ModelOptions::preset("paper");
  CHECK(paper.fusion_method == FusionMethod::wlop);
  CHECK(paper.max_points == 2000);
  CHECK(paper.wlop.radius == 0.008);
  CHECK_NOTHROW(paper.check());
  CHECK_NOTHROW(ModelOptions::preset("default").check());
  CHECK_THROWS_WITH_AS(ModelOptions::preset("best"), doctest::Contains("'best'"), std::invalid_argument);
  const Model model = grown(3, paper);
  CHECK(model.cloud().size() == 2000);
  for (const FrameReport& report : model.frames()) CHECK(report.status == FrameStatus::tracked);
  for (const Eigen::Vector3f& point : model.cloud().points) CHECK(point.allFinite());
}

TEST_CASE("models have the same bits for any number of threads") {
  for (const char* preset : {"default", "paper"}) {
    ModelOptions options = ModelOptions::preset(preset);
    options.num_threads = 1;
    const Model expected = grown(3, options);
    for (const int num_threads : {0, 2, 7}) {
      options.num_threads = num_threads;
      const Model model = grown(3, options);
      CHECK(same_bits(model.cloud(), expected.cloud()));
      for (std::size_t i = 0; i < 3; ++i) {
        CHECK(model.frames()[i].world_from_camera.matrix() == expected.frames()[i].world_from_camera.matrix());
      }
    }
  }
}

TEST_CASE("a model can be moved") {
  Model model = grown(1);
  const std::int64_t count = model.cloud().size();
  Model other = std::move(model);
  CHECK(other.cloud().size() == count);
  CHECK(other.add_frame(turntable().view(20.0)).status == FrameStatus::tracked);
}

TEST_CASE("a model that is saved and loaded goes on to the same bits, and no other bytes are taken for one") {
  Turntable table;
  Model undisturbed(Turntable::camera());
  Model other(Turntable::camera());
  std::string note;
  for (const double degrees : {0.0, 10.0, 20.0}) {
    undisturbed.add_frame(table.view(degrees));
    other.add_frame(table.view(degrees));
    other = Model::load(other.save("somebody's note"), &note);
    REQUIRE(other.cloud().size() == undisturbed.cloud().size());
    CHECK(note == "somebody's note");
    CHECK(std::memcmp(other.cloud().points.data(), undisturbed.cloud().points.data(),
                      other.cloud().points.size() * sizeof(Eigen::Vector3f)) == 0);
    CHECK(other.frames().back().world_from_camera.matrix() == undisturbed.frames().back().world_from_camera.matrix());
  }
  CHECK(other.given_options().fusion.reference_sigma == 0.0);
  CHECK(other.options().fusion.reference_sigma == undisturbed.options().fusion.reference_sigma);

  const std::string bytes = other.save();
  CHECK(Model::load(bytes).save() == bytes);
  CHECK_THROWS_AS(Model::load(""), CheckpointError);
  CHECK_THROWS_AS(Model::load(std::string_view(bytes).substr(0, bytes.size() - 1)), CheckpointError);
  for (const std::size_t place : {std::size_t{0}, std::size_t{9}, std::size_t{35}, std::size_t{60}, bytes.size() / 2}) {
    std::string damaged = bytes;
    damaged[place] = static_cast<char>(damaged[place] ^ 1);
    CHECK_THROWS_AS(Model::load(damaged), CheckpointError);
  }
}
