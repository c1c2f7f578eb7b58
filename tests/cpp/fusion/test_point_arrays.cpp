#include <cstddef>
#include <cstdint>
#include <vector>

#include "doctest/doctest.h"
#include "fusion/limits.hpp"
#include "fusion/point_arrays.hpp"

using namespace nacre;

namespace {

void grow(PointModel& model, std::size_t num_points) {
  make_room(model, num_points);
  for_each_array(model, [&](auto& values, std::size_t channels) { values.resize(num_points * channels); });
}

PointModel model_of(std::size_t num_points) {
  PointModel model;
  model.attributes.push_back({"heat", 2, {}});
  grow(model, num_points);
  return model;
}

bool has_room_for_at_most(PointModel& model, std::size_t num_points) {
  bool result = true;
  for_each_array(model, [&](auto& values, std::size_t channels) {
    result = result && values.capacity() <= num_points * channels;
  });
  return result;
}

}  // namespace

TEST_CASE("a model that grows has no more free room than a quarter of what it needs") {
  PointModel model = model_of(1000);
  for (std::size_t size = 1001; size < 20000; size += 37) {
    grow(model, size);
    CHECK(has_room_for_at_most(model, size + size / fusion_limits::points_per_free));
  }
}

TEST_CASE("room that points have left is given back, and those that stay are as they were") {
  PointModel model = model_of(10000);
  for (std::size_t i = 0; i < 10000; ++i) {
    model.points[i].x() = static_cast<float>(i);
    model.attributes[0].values[2 * i + 1] = static_cast<float>(i);
  }
  std::vector<std::uint8_t> flags(10000, 0);
  for (std::size_t i = 3; i < 10000; i += 10) flags[i] = 1;
  model.keep(flags);
  CHECK_FALSE(has_room_for_at_most(model, 1250));
  give_back_room(model);
  CHECK(has_room_for_at_most(model, 1250));
  REQUIRE(model.size() == 1000);
  for (std::size_t i = 0; i < 1000; ++i) {
    CHECK(model.points[i].x() == static_cast<float>(10 * i + 3));
    CHECK(model.attributes[0].values[2 * i + 1] == static_cast<float>(10 * i + 3));
  }
}
