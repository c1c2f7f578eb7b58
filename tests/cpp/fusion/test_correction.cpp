#include <cstddef>
#include <limits>
#include <vector>

#include "doctest/doctest.h"
#include "fusion/correction.hpp"

using namespace nacre;

namespace {

PointModel plane(float height, std::int32_t frame, float confidence) {
  PointModel model;
  for (int i = 0; i < 20; ++i) {
    for (int j = 0; j < 20; ++j) {
      model.points.emplace_back(0.01F * static_cast<float>(i), 0.01F * static_cast<float>(j), height);
      model.normals.emplace_back(0.0F, 0.0F, 1.0F);
      model.confidence.push_back(confidence);
      model.last_seen.push_back(frame);
      model.free_space_violations.push_back(0);
      model.observations.push_back(200);
    }
  }
  return model;
}

void append(PointModel& model, const PointModel& more) {
  model.points.insert(model.points.end(), more.points.begin(), more.points.end());
  model.normals.insert(model.normals.end(), more.normals.begin(), more.normals.end());
  model.confidence.insert(model.confidence.end(), more.confidence.begin(), more.confidence.end());
  model.last_seen.insert(model.last_seen.end(), more.last_seen.begin(), more.last_seen.end());
  model.observations.insert(model.observations.end(), more.observations.begin(), more.observations.end());
  model.free_space_violations.insert(model.free_space_violations.end(), more.free_space_violations.begin(),
                                     more.free_space_violations.end());
  model.colors.insert(model.colors.end(), more.colors.begin(), more.colors.end());
  for (std::size_t k = 0; k < model.attributes.size(); ++k) {
    std::vector<float>& values = model.attributes[k].values;
    values.insert(values.end(), more.attributes[k].values.begin(), more.attributes[k].values.end());
  }
}

}  // namespace

TEST_CASE("points move with the frame that last observed them") {
  PointModel model = plane(0.0F, 0, 1.0F);
  model.last_seen[7] = 1;
  Pose up = Pose::Identity();
  up.translation().z() = 0.5;
  move_points(model, {Pose::Identity(), up}, 0);
  CHECK(model.points[6].z() == 0.0F);
  CHECK(model.points[7].z() == doctest::Approx(0.5));
}

TEST_CASE("two layers of one surface become one, weighted by confidence") {
  PointModel model = plane(0.0F, 0, 3.0F);
  append(model, plane(0.008F, 50, 1.0F));
  merge_layers(model, 10, 0.01, [](const Eigen::Vector3f&) { return 0.01; });
  REQUIRE(model.size() == 400);
  for (std::size_t i = 0; i < 400; ++i) {
    CHECK(model.points[i].z() == doctest::Approx(0.002));
    CHECK(model.confidence[i] == 4.0F);
    CHECK(model.last_seen[i] == 50);
    CHECK(model.observations[i] == 255);
  }
}

TEST_CASE("what two layers carry is averaged by confidence, and what one has alone is kept") {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  const auto carrying = [](PointModel model, float value) {
    model.colors.assign(400, Eigen::Vector3f::Constant(value));
    model.attributes = {{"heat", 2, std::vector<float>(800, value)}};
    return model;
  };
  PointModel model = carrying(plane(0.0F, 0, 3.0F), 10.0F), newer = carrying(plane(0.0F, 50, 1.0F), 50.0F);
  model.colors[1].fill(nan), model.attributes[0].values[2 * 1 + 1] = nan;  // never seen by the older layer
  newer.colors[2].fill(nan), newer.attributes[0].values[2 * 2] = nan;      // nor by the newer one
  append(model, newer);
  merge_layers(model, 10, 0.01, [](const Eigen::Vector3f&) { return 0.01; });
  REQUIRE(model.size() == 400);
  for (std::size_t i = 0; i < 400; ++i) {
    CAPTURE(i);
    CHECK(model.colors[i].y() == doctest::Approx(i == 1 ? 50.0 : i == 2 ? 10.0 : 20.0));
    CHECK(model.attributes[0].values[2 * i] == doctest::Approx(i == 2 ? 10.0 : 20.0));
    CHECK(model.attributes[0].values[2 * i + 1] == doctest::Approx(i == 1 ? 50.0 : 20.0));
  }
}

TEST_CASE("layers that are far apart, face away or are of the same time stay") {
  const auto merged = [](PointModel more) {
    PointModel model = plane(0.0F, 0, 1.0F);
    append(model, more);
    merge_layers(model, 10, 0.01, [](const Eigen::Vector3f& point) { return point.z() > 0.5F ? 0.06 : 0.01; });
    return model.size();
  };
  CHECK(merged(plane(0.03F, 50, 1.0F)) == 800);
  CHECK(merged(plane(0.008F, 5, 1.0F)) == 800);
  PointModel high = plane(0.1F, 50, 1.0F);  // where points are farther apart
  for (Eigen::Vector3f& point : high.points) point.z() += 0.5F;
  PointModel low = high;
  low.last_seen.assign(400, 0);
  for (Eigen::Vector3f& point : low.points) point.z() += 0.1F;
  append(low, high);
  merge_layers(low, 10, 0.01, [](const Eigen::Vector3f& point) { return point.z() > 0.5F ? 0.06 : 0.01; });
  CHECK(low.size() == 400);
  PointModel back = plane(-0.008F, 50, 1.0F);
  for (Eigen::Vector3f& normal : back.normals) normal = -normal;
  CHECK(merged(back) == 800);
}
