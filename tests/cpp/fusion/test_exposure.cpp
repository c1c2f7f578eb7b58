#include <algorithm>
#include <cmath>
#include <vector>

#include "depth_images.hpp"
#include "doctest/doctest.h"
#include "fusion/exposure.hpp"
#include "nacre/fusion.hpp"

using namespace nacre;
using namespace nacre_test;

namespace {

const Frame& plane() {
  static const Frame frame = make_frame(render(orthographic, slanted_plane(1.0, 0.3, 0.5)), orthographic);
  return frame;
}

// Grey levels from 40 to 160 along x, times the gain of each channel.
Colors painted(const Eigen::Vector3f& gain) {
  Colors colors(plane().points.rows(), 3);
  for (Eigen::Index i = 0; i < colors.rows(); ++i) {
    const int u = static_cast<int>(i) % plane().width;
    const float grey = 40.0F + 120.0F * static_cast<float>(u) / static_cast<float>(plane().width);
    for (int c = 0; c < 3; ++c) colors(i, c) = static_cast<std::uint8_t>(std::lround(std::min(255.0F, gain[c] * grey)));
  }
  return colors;
}

PointModel fused(const std::vector<Eigen::Vector3f>& gains) {
  PointModel model;
  for (std::size_t i = 0; i < gains.size(); ++i) {
    fuse(model, plane(), orthographic, Pose::Identity(), 0.004, static_cast<std::int32_t>(i), {}, painted(gains[i]));
  }
  return model;
}

float mean_level(const PointModel& model, int channel) {
  double sum = 0.0;
  for (const Eigen::Vector3f& color : model.colors) sum += static_cast<double>(color[channel]);
  return static_cast<float>(sum / static_cast<double>(model.colors.size()));
}

Eigen::Vector3f gain_of(const Eigen::Vector3f& gain) {
  const PointModel model = fused({Eigen::Vector3f::Ones()});
  const FusionOptions options;  // the observer keeps a reference
  SurfaceObserver observer(orthographic, options);
  const Colors colors = painted(gain);
  observer.look_at(plane(), colors, 1);
  const Pose at = Pose::Identity();
  const BlockIndex blocks(model);
  return color_gain(model, blocks, blocks.from(0), {plane(), orthographic, observer, at, 1}, 0.004);
}

}  // namespace

TEST_CASE("a frame's exposure and white balance are found") {
  CHECK((gain_of({1.0F, 1.0F, 1.0F}) - Eigen::Vector3f::Ones()).norm() < 0.01F);
  const Eigen::Vector3f made(1.3F, 1.2F, 0.8F);
  CHECK((gain_of(made).cwiseProduct(made) - Eigen::Vector3f::Ones()).norm() < 0.02F);
}

TEST_CASE("what is black, or too bright for the sensor, tells nothing") {
  CHECK(gain_of({0.05F, 0.05F, 0.05F}) == Eigen::Vector3f::Ones());
  CHECK(gain_of({9.0F, 9.0F, 9.0F}) == Eigen::Vector3f::Ones());
}

TEST_CASE("white stays white in a brighter exposure") {
  const Eigen::Vector3f twice(2.0F, 2.0F, 2.0F);
  CHECK(exposed({200.0F, 100.0F, 10.0F}, twice) == Eigen::Vector3f(255.0F, 200.0F, 20.0F));
}

TEST_CASE("the model has the mean exposure of its frames, whichever came first") {
  const Eigen::Vector3f dark(0.8F, 0.8F, 0.8F), bright(1.25F, 1.25F, 1.25F), red(1.2F, 1.0F, 0.9F);
  const PointModel one = fused({dark, bright}), other = fused({bright, dark}),
                   plain = fused({dark.Ones(), dark.Ones()});
  REQUIRE(one.colors.size() == plain.colors.size());
  for (std::size_t i = 0; i < one.colors.size(); ++i) {
    CHECK((one.colors[i] - plain.colors[i]).norm() < 0.03F * plain.colors[i].norm());
    CHECK((other.colors[i] - plain.colors[i]).norm() < 0.03F * plain.colors[i].norm());
  }
  const PointModel balanced = fused({red, red.cwiseInverse()});
  for (int c = 0; c < 3; ++c) CHECK(std::abs(mean_level(balanced, c) / mean_level(plain, c) - 1.0F) < 0.02F);
}
