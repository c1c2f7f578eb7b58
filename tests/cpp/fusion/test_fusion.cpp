#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "base/random.hpp"
#include "doctest/doctest.h"
#include "nacre/fusion.hpp"

using namespace nacre;

namespace {

constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();
constexpr double spacing = 0.002, sphere_radius = 0.03;
const Eigen::Vector3d sphere_center(0.0, 0.0, 0.3);

Camera camera() { return Camera::orthographic(100, 80, 0.001); }

Frame to_frame(const DepthImage& depth, double sigma) { return make_frame(depth, camera(), NoiseModel{sigma, 0, 0}); }

// depth(x, y) for each pixel, with noise.
template <class Depth>
DepthImage image_of(Depth&& depth, double sigma = 0.0, std::uint64_t seed = 1) {
  DepthImage image(80, 100);
  for (int v = 0; v < 80; ++v) {
    for (int u = 0; u < 100; ++u) {
      const auto pixel = static_cast<std::uint64_t>(100 * v + u);
      const double z = depth((u - 49.5) * 0.001, (v - 39.5) * 0.001);
      image(v, u) = static_cast<float>(z + sigma * random_normal(seed, pixel));
    }
  }
  return image;
}

double slope(double x, double y) { return 0.3 + 0.3 * x - 0.2 * y; }

double ball(double x, double y) {
  return sphere_center.z() - std::sqrt(sphere_radius * sphere_radius - x * x - y * y);  // NaN beside it
}

Pose shifted(double x, double y, double z) {
  Pose pose = Pose::Identity();
  pose.translation() << x, y, z;
  return pose;
}

// The camera turned by half a turn about the vertical axis through (0, 0, z).
Pose from_behind(double z) {
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::Vector3d(-1.0, 1.0, -1.0).asDiagonal();
  pose.translation() << 0.0, 0.0, 2.0 * z;
  return pose;
}

struct Errors {
  double rms = 0.0, mean = 0.0;
};

template <class Distance>
Errors errors_of(const PointModel& model, Distance&& distance) {
  Errors errors;
  for (const Eigen::Vector3f& point : model.points) {
    const double d = distance(point.cast<double>());
    errors.mean += d / static_cast<double>(model.size());
    errors.rms += d * d / static_cast<double>(model.size());
  }
  errors.rms = std::sqrt(errors.rms);
  return errors;
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

bool is_consistent(const PointModel& model) {
  const std::size_t count = model.points.size();
  return model.normals.size() == count && (model.colors.empty() || model.colors.size() == count) &&
         model.confidence.size() == count && model.last_seen.size() == count &&
         model.free_space_violations.size() == count;
}

double least_distance_on_a_sheet(const PointModel& model) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < model.points.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (model.normals[i].dot(model.normals[j]) < 0.5F) continue;
      least = std::min(least, static_cast<double>((model.points[i] - model.points[j]).norm()));
    }
  }
  return least;
}

}  // namespace

TEST_CASE("an exact plane stays exact, covered at the spacing") {
  PointModel model;
  const FusionReport report = fuse(model, to_frame(image_of(slope), 1e-5), camera(), Pose::Identity(), spacing, 0);
  CHECK(report.num_inserted == model.size());
  CHECK(report.num_updated == 0);
  CHECK(report.num_removed == 0);
  CHECK(is_consistent(model));
  const double cosine = 1.0 / std::sqrt(1.0 + 0.3 * 0.3 + 0.2 * 0.2);
  const auto distance = [&](const Eigen::Vector3d& p) { return (p.z() - slope(p.x(), p.y())) * cosine; };
  CHECK(errors_of(model, distance).rms < 1e-6);
  CHECK(least_distance_on_a_sheet(model) > 0.999 * spacing);
  const double area = 0.1 * 0.08 / cosine;
  CHECK(static_cast<double>(model.size()) > 0.6 * area / (spacing * spacing));  // 1.15 would be the densest packing
  const Eigen::Vector3f normal = Eigen::Vector3d(0.3 * cosine, -0.2 * cosine, -cosine).cast<float>();
  for (const Eigen::Vector3f& n : model.normals) CHECK(n.dot(normal) > 0.9999F);
}

TEST_CASE("a spacing of many pixels is kept too, from frame to frame") {
  for (const double wide : {0.006, 0.008, 0.02, 0.5}) {  // 6 to 500 pixels
    CAPTURE(wide);
    PointModel model;
    for (int frame = 0; frame < 4; ++frame) {
      const Pose pose = shifted(0.011 * frame, -0.007 * frame, 0.0);
      const auto moved = [&](double x, double y) { return slope(x + 0.011 * frame, y - 0.007 * frame); };
      fuse(model, to_frame(image_of(moved), 1e-5), camera(), pose, wide, frame);
      CHECK(least_distance_on_a_sheet(model) > 0.999 * wide);
    }
    CHECK(static_cast<double>(model.size()) >= 0.6 * 0.1 * 0.08 / (wide * wide));
  }
}

TEST_CASE("a steep surface is covered like one that faces the camera") {
  // At 65 degrees a pixel says two fifths of what one from the front says, and there are fewer.
  for (const double degrees : {0.0, 45.0, 55.0, 65.0}) {
    CAPTURE(degrees);
    const double slant = degrees * 3.14159265358979 / 180.0, sigma = 0.0005;
    PointModel model;
    const auto plane = [&](double x, double) { return 0.5 + std::tan(slant) * x; };
    fuse(model, to_frame(image_of(plane, sigma), sigma), camera(), Pose::Identity(), spacing, 0);
    const double area = 0.1 * 0.08 / std::cos(slant);
    // New points lie on the rays of pixels: at 55 degrees two steps down the slope are 1.7 spacings.
    CHECK(static_cast<double>(model.size()) > 0.5 * area / (spacing * spacing));
  }
}

TEST_CASE("noise is averaged over pixels and frames, and a sphere keeps its size") {
  const double sigma = 0.0005;
  PointModel model;
  double first = 0.0;
  const auto distance = [](const Eigen::Vector3d& p) { return (p - sphere_center).norm() - sphere_radius; };
  for (int frame = 0; frame < 12; ++frame) {
    fuse(model, to_frame(image_of(ball, sigma, static_cast<std::uint64_t>(frame)), sigma), camera(), Pose::Identity(),
         spacing, frame);
    if (frame == 0) first = errors_of(model, distance).rms;
  }
  const Errors errors = errors_of(model, distance);
  MESSAGE("RMS after 1 and 12 frames, bias [sigma]: " << first / sigma << " " << errors.rms / sigma << " "
                                                      << errors.mean / sigma);
  CHECK(first < 0.5 * sigma);
  CHECK(errors.rms < 0.5 * first);
  CHECK(std::abs(errors.mean) < 0.06 * sigma);
  for (std::size_t i = 0; i < model.points.size(); ++i) {
    CHECK(model.normals[i].norm() == doctest::Approx(1.0));
    CHECK(model.normals[i].dot((model.points[i] - sphere_center.cast<float>()).normalized()) > 0.9F);
  }
}

TEST_CASE("confidence adds up, and is bounded") {
  PointModel model;
  const Frame frame = to_frame(image_of(slope), 1e-4);
  fuse(model, frame, camera(), Pose::Identity(), spacing, 0);
  const std::vector<float> once = model.confidence;
  const FusionReport report = fuse(model, frame, camera(), Pose::Identity(), spacing, 1);
  CHECK(report.num_updated == model.size());
  CHECK(report.num_inserted == 0);
  for (std::size_t i = 0; i < once.size(); ++i) {
    CHECK(model.confidence[i] > 1.5F * once[i]);
    CHECK(model.last_seen[i] == 1);
  }
  FusionOptions options;
  options.max_confidence = 10.0;
  for (int i = 2; i < 5; ++i) fuse(model, frame, camera(), Pose::Identity(), spacing, i, options);
  for (const float value : model.confidence) CHECK(value == 10.0F);
}

TEST_CASE("a noisy frame counts less") {
  FusionOptions options;
  options.reference_sigma = 0.001;
  // The same support (capped by the window) sees the same pixels; each weighs (reference / sigma)^2.
  options.support = 0.003;
  PointModel rough, fine;
  fuse(rough, to_frame(image_of(slope), 0.0015), camera(), Pose::Identity(), spacing, 0, options);
  fuse(fine, to_frame(image_of(slope), 0.001), camera(), Pose::Identity(), spacing, 0, options);
  REQUIRE(rough.size() > 100);
  std::nth_element(rough.confidence.begin(), rough.confidence.begin() + rough.size() / 2, rough.confidence.end());
  std::nth_element(fine.confidence.begin(), fine.confidence.begin() + fine.size() / 2, fine.confidence.end());
  CHECK(fine.confidence[static_cast<std::size_t>(fine.size() / 2)] ==
        doctest::Approx(2.25 * rough.confidence[static_cast<std::size_t>(rough.size() / 2)]).epsilon(0.1));
}

TEST_CASE("points move along their normals only") {
  PointModel model;
  fuse(model, to_frame(image_of(slope), 1e-4), camera(), Pose::Identity(), spacing, 0);
  const PointModel before = model;
  const auto farther = [](double x, double y) { return slope(x, y) + 0.0004; };
  fuse(model, to_frame(image_of(farther), 1e-4), camera(), Pose::Identity(), spacing, 1);
  REQUIRE(model.size() == before.size());
  for (std::size_t i = 0; i < before.points.size(); ++i) {
    const Eigen::Vector3f step = model.points[i] - before.points[i];
    CHECK(step.dot(before.normals[i]) < -1e-4F);
    CHECK((step - step.dot(before.normals[i]) * before.normals[i]).norm() < 1e-6F);
  }
}

TEST_CASE("points that the camera does not see stay as they are") {
  PointModel model;
  fuse(model, to_frame(image_of(slope), 1e-4), camera(), Pose::Identity(), spacing, 0);
  const PointModel before = model;
  DepthImage half = image_of([](double x, double y) { return slope(x, y) + 0.0003; });
  half.rightCols(50).setConstant(not_a_number);
  fuse(model, to_frame(half, 1e-4), camera(), Pose::Identity(), spacing, 1);
  int still = 0;
  for (std::size_t i = 0; i < before.points.size(); ++i) {
    if (before.points[i].x() < 0.006F) continue;
    ++still;
    CHECK(model.points[i] == before.points[i]);
    CHECK(model.confidence[i] == before.confidence[i]);
    CHECK(model.last_seen[i] == 0);
  }
  CHECK(still > 300);
}

TEST_CASE("the sides of a sheet stay two, even where it is thinner than the spacing") {
  for (const double half : {0.0015, 0.0005}) {
    PointModel model;
    for (int frame = 0; frame < 6; ++frame) {
      const Pose pose = frame % 2 == 0 ? Pose::Identity() : from_behind(0.3);
      const DepthImage depth =
          image_of([&](double, double) { return 0.3 - half; }, 0.0002, static_cast<std::uint64_t>(frame));
      fuse(model, to_frame(depth, 0.0002), camera(), pose, spacing, frame);
    }
    int front = 0, back = 0;
    for (std::size_t i = 0; i < model.points.size(); ++i) {
      const bool is_front = model.normals[i].z() < 0.0F;
      (is_front ? front : back) += 1;
      CHECK(std::abs(model.normals[i].z()) > 0.95F);
      const double z = static_cast<double>(model.points[i].z()) - 0.3;
      CHECK(std::abs(z - (is_front ? -half : half)) < 0.0003);
    }
    CHECK(front > 1000);
    CHECK(back > 1000);
  }
}

TEST_CASE("points that the camera sees through go after so many times in a row") {
  const auto wall = [](double x, double y) { return 0.1 + slope(x, y); };
  const auto with_disc = [&](double x, double y) { return x * x + y * y < 0.0002 ? slope(x, y) : wall(x, y); };
  const auto count_disc = [](const PointModel& model) {
    return std::count_if(model.points.begin(), model.points.end(),
                         [](const Eigen::Vector3f& p) { return p.z() < 0.35F; });
  };
  FusionOptions options;
  options.max_free_space_violations = 2;
  PointModel model;
  // Pixels at the rim belong to neither.
  DepthImage image = image_of(with_disc);
  for (int v = 0; v < 80; ++v) {
    for (int u = 0; u < 100; ++u) {
      const double x = (u - 49.5) * 0.001, y = (v - 39.5) * 0.001, r = std::hypot(x, y);
      if (r > 0.012 && r < 0.018) image(v, u) = not_a_number;
    }
  }
  const Frame both = to_frame(image, 1e-4), empty = to_frame(image_of(wall), 1e-4);
  fuse(model, both, camera(), Pose::Identity(), spacing, 0, options);
  const auto disc = count_disc(model);
  CHECK(disc > 40);
  fuse(model, empty, camera(), Pose::Identity(), spacing, 1, options);
  CHECK(count_disc(model) == disc);
  fuse(model, both, camera(), Pose::Identity(), spacing, 2, options);  // seen again: forgiven
  fuse(model, empty, camera(), Pose::Identity(), spacing, 3, options);
  CHECK(count_disc(model) >= disc);
  const FusionReport report = fuse(model, empty, camera(), Pose::Identity(), spacing, 4, options);
  CHECK(count_disc(model) == 0);
  CHECK(report.num_removed >= disc);
  CHECK(is_consistent(model));
}

TEST_CASE("points behind the measured surface are hidden, not wrong") {
  const auto wall = [](double x, double y) { return 0.1 + slope(x, y); };
  PointModel model;
  fuse(model, to_frame(image_of(wall), 1e-4), camera(), Pose::Identity(), spacing, 0);
  const PointModel before = model;
  for (int frame = 1; frame < 6; ++frame) {
    fuse(model, to_frame(image_of(slope), 1e-4), camera(), Pose::Identity(), spacing, frame);
  }
  REQUIRE(model.size() > before.size());
  for (std::size_t i = 0; i < before.points.size(); ++i) {
    CHECK(model.points[i] == before.points[i]);
    CHECK(model.free_space_violations[i] == 0);
  }
}

TEST_CASE("colours come along, NaN where none was seen") {
  const DepthImage depth = image_of(slope);
  const Frame frame = to_frame(depth, 1e-4);
  Colors colors(8000, 3);
  for (int row = 0; row < 8000; ++row) {
    if (row % 100 < 50) {
      colors.row(row) << std::uint8_t{200}, std::uint8_t{20}, std::uint8_t{30};
    } else {
      colors.row(row) << std::uint8_t{10}, std::uint8_t{40}, std::uint8_t{220};
    }
  }
  PointModel model;
  fuse(model, frame, camera(), Pose::Identity(), spacing, 0, {}, colors);
  REQUIRE(model.colors.size() == model.points.size());
  for (std::size_t i = 0; i < model.points.size(); ++i) {
    if (model.points[i].x() < -0.006F) CHECK((model.colors[i] - Eigen::Vector3f(200, 20, 30)).norm() < 0.01F);
    if (model.points[i].x() > 0.006F) CHECK((model.colors[i] - Eigen::Vector3f(10, 40, 220)).norm() < 0.01F);
  }
  // Grey frames leave them; what grey frames add has none.
  const std::vector<Eigen::Vector3f> before = model.colors;
  fuse(model, frame, camera(), shifted(0.02, 0.0, 0.006), spacing, 1);
  CHECK(is_consistent(model));
  REQUIRE(model.colors.size() > before.size());
  CHECK(same_bits(std::vector<Eigen::Vector3f>(model.colors.begin(),
                                               model.colors.begin() + static_cast<std::ptrdiff_t>(before.size())),
                  before));
  for (std::size_t i = before.size(); i < model.colors.size(); ++i) CHECK_FALSE(model.colors[i].allFinite());
  // A coloured frame fills them in.
  fuse(model, frame, camera(), shifted(0.02, 0.0, 0.006), spacing, 2, {}, colors);
  CHECK(std::all_of(model.colors.begin(), model.colors.end(), [](const Eigen::Vector3f& c) { return c.allFinite(); }));
}

TEST_CASE("thinning keeps the earlier points, at least the spacing apart") {
  PointModel model;
  fuse(model, to_frame(image_of(ball), 1e-4), camera(), Pose::Identity(), spacing, 0);
  const PointModel before = model;
  thin(model, spacing);
  CHECK(same_bits(model, before));
  thin(model, 2.0 * spacing);
  CHECK(is_consistent(model));
  CHECK(model.size() < before.size() / 2);
  CHECK(model.size() > before.size() / 8);
  CHECK(model.points.front() == before.points.front());
  CHECK(least_distance_on_a_sheet(model) > 1.999 * spacing);
  PointModel empty;
  thin(empty, 1.0);
  CHECK(empty.size() == 0);
}

TEST_CASE("a spacing below the resolution of floats keeps all points, soon") {
  PointModel model;
  for (int i = 0; i < 30000; ++i) {
    model.points.emplace_back(1.0F + 1e-5F * static_cast<float>(i), 0.0F, -1.0F);
    model.normals.emplace_back(0.0F, 0.0F, 1.0F);
  }
  for (const double tiny : {1e-12, 1e-300}) {
    thin(model, tiny);
    CHECK(model.points.size() == 30000);
  }
}

TEST_CASE("keep drops the points whose flag is 0, in order") {
  PointModel model;
  for (int i = 0; i < 5; ++i) {
    model.points.emplace_back(static_cast<float>(i), 0.0F, 0.0F);
    model.normals.emplace_back(0.0F, static_cast<float>(i), 0.0F);
    model.confidence.push_back(static_cast<float>(i));
    model.last_seen.push_back(i);
    model.observations.push_back(static_cast<std::uint8_t>(i));
    model.free_space_violations.push_back(static_cast<std::uint8_t>(i));
  }
  model.keep({0, 1, 0, 1, 1});
  REQUIRE(model.size() == 3);
  CHECK(is_consistent(model));
  CHECK(model.colors.empty());
  CHECK(model.last_seen == std::vector<std::int32_t>{1, 3, 4});
  CHECK(model.points[1].x() == 3.0F);
  CHECK(model.normals[2].y() == 4.0F);
  CHECK(model.free_space_violations[0] == 1);
}

TEST_CASE("a frame without points changes nothing") {
  PointModel model;
  fuse(model, to_frame(image_of(slope), 1e-4), camera(), Pose::Identity(), spacing, 0);
  const PointModel before = model;
  const Frame empty = to_frame(DepthImage::Constant(80, 100, not_a_number), 1e-4);
  const FusionReport report = fuse(model, empty, camera(), Pose::Identity(), spacing, 1);
  CHECK(same_bits(model, before));
  CHECK(report.num_updated + report.num_inserted + report.num_removed == 0);
}

TEST_CASE("models have the same bits for any number of threads") {
  const auto grow = [](int num_threads) {
    PointModel model;
    for (int frame = 0; frame < 4; ++frame) {
      const DepthImage depth = image_of(ball, 0.0005, static_cast<std::uint64_t>(frame));
      fuse(model, make_frame(depth, camera(), NoiseModel{0.0005, 0, 0}, num_threads), camera(),
           shifted(0.001 * frame, 0.0, 0.0), spacing, frame, {}, Colors(), num_threads);
    }
    return model;
  };
  const PointModel expected = grow(1);
  CHECK(expected.size() > 500);
  for (const int num_threads : {0, 1, 2, 3, 4, 7, 8}) CHECK(same_bits(grow(num_threads), expected));
}

TEST_CASE("arguments out of range are named") {
  PointModel model;
  const Frame frame = to_frame(image_of(slope), 1e-4);
  const auto add = [&](const FusionOptions& options, double at_spacing = spacing, Eigen::Index rows = 0) {
    fuse(model, frame, camera(), Pose::Identity(), at_spacing, 0, options, Colors(rows, 3));
  };
  CHECK_THROWS_WITH_AS(add({}, 0.0), doctest::Contains("spacing must be"), std::invalid_argument);
  CHECK_THROWS_WITH_AS(add({}, -1.0), doctest::Contains("spacing must be"), std::invalid_argument);
  const Camera other = Camera::orthographic(64, 48, 0.001);
  CHECK_THROWS_WITH_AS(fuse(model, frame, other, Pose::Identity(), spacing, 0), doctest::Contains("frame must be"),
                       std::invalid_argument);
  CHECK_THROWS_WITH_AS(add({}, spacing, 7), doctest::Contains("colors must be"), std::invalid_argument);
  CHECK_THROWS_WITH_AS(thin(model, 0.0), doctest::Contains("spacing must be"), std::invalid_argument);
  FusionOptions options;
  options.max_free_space_violations = 256;
  CHECK_THROWS_WITH_AS(add(options), doctest::Contains("max_free_space_violations must be"), std::invalid_argument);
  options = {};
  options.support = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH_AS(add(options), doctest::Contains("support must be"), std::invalid_argument);
  CHECK(model.size() == 0);
}
