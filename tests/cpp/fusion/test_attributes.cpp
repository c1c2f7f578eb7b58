#include <cmath>

#include "depth_images.hpp"
#include "doctest/doctest.h"
#include "nacre/fusion.hpp"

using namespace nacre;
using namespace nacre_test;

namespace {

// The x coordinate of each pixel's point, and minus that.
FrameAttribute coordinate(const Frame& frame, const std::string& name) {
  FrameAttribute attribute{name, Attributes(frame.points.rows(), 2)};
  attribute.values.col(0) = frame.points.col(0);
  attribute.values.col(1) = -frame.points.col(0);
  return attribute;
}

}  // namespace

TEST_CASE("an attribute stays with its points through fusion, removal and thinning") {
  const Frame frame = make_frame(render(orthographic, slanted_plane(1.0, 0.3, 0.5)), orthographic);
  PointModel model;
  for (int i = 0; i < 3; ++i) {
    fuse(model, frame, orthographic, Pose::Identity(), 0.004, i, {}, Colors(), 0, {coordinate(frame, "x")});
  }
  thin(model, 0.008);
  REQUIRE(model.attributes.size() == 1);
  CHECK(model.attributes[0].name == "x");
  CHECK(model.attributes[0].num_channels == 2);
  REQUIRE(model.attributes[0].values.size() == 2 * model.points.size());
  REQUIRE(model.size() > 200);
  for (std::size_t i = 0; i < model.points.size(); ++i) {
    const float* const values = &model.attributes[0].values[2 * i];
    CHECK(values[0] == -values[1]);
    if (std::abs(model.points[i].x()) < 0.1F) CHECK(std::abs(values[0] - model.points[i].x()) < 5e-4F);
  }
}

TEST_CASE("a frame without the attribute leaves the old values, and NaN for new points") {
  const Frame frame = make_frame(render(orthographic, slanted_plane(1.0, 0.3, 0.5)), orthographic);
  PointModel model;
  fuse(model, frame, orthographic, Pose::Identity(), 0.004, 0, {}, Colors(), 0, {coordinate(frame, "x")});
  const std::size_t known = model.points.size();
  const std::vector<float> before = model.attributes[0].values;
  Pose beside = Pose::Identity();
  beside.translation().x() = 0.15;
  const Frame other = make_frame(render(orthographic, slanted_plane(1.0, 0.3, 0.5)), orthographic);
  fuse(model, other, orthographic, beside, 0.004, 1);
  REQUIRE(model.points.size() > known);
  REQUIRE(model.attributes[0].values.size() == 2 * model.points.size());
  CHECK(std::equal(before.begin(), before.end(), model.attributes[0].values.begin()));
  CHECK(std::isnan(model.attributes[0].values.back()));
}

TEST_CASE("attributes are named once, have a row per pixel and keep their channels") {
  const Frame frame = make_frame(render(orthographic, slanted_plane(1.0, 0.3, 0.5)), orthographic);
  const auto message = [&](const std::vector<FrameAttribute>& attributes) {
    return message_of([&] {
      PointModel model;
      model.attributes.push_back({"known", 1, {}});
      fuse(model, frame, orthographic, Pose::Identity(), 0.004, 0, {}, Colors(), 0, attributes);
    });
  };
  CHECK(message({{"", Attributes::Zero(width * height, 1)}}).find("attributes must be named") == 0);
  CHECK(message({{"a", Attributes::Zero(7, 1)}}).find("attributes['a'] must be one row per pixel, got 7") == 0);
  CHECK(message({{"a", Attributes::Zero(width * height, 0)}}).find("attributes['a'] must be of at least one") == 0);
  CHECK(message({coordinate(frame, "a"), coordinate(frame, "a")}).find("attributes['a'] must be given once") == 0);
  CHECK(message({coordinate(frame, "known")}).find("attributes['known'] must be of as many channels") == 0);
}
