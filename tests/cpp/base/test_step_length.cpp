#include <Eigen/Core>

#include "base/step_length.hpp"
#include "doctest/doctest.h"

using namespace nacre;

namespace {

const Eigen::Matrix2d metric = Eigen::Vector2d(1.0, 4.0).asDiagonal();

// Steps towards the origin that leave a part of the way, as where weights change; returns how many reach it.
int steps_to_rest(double part_left, bool made_longer) {
  Eigen::Vector2d place(3.0, -1.0), last = Eigen::Vector2d::Zero();
  double length = 1.0;
  int count = 0;
  for (; place.norm() > 1e-6 && count < 1000; ++count) {
    const Eigen::Vector2d step = -(1.0 - part_left) * place;
    length = made_longer ? step_length(last, length, step, metric) : 1.0;
    place += length * step;
    last = step;
  }
  return count;
}

}  // namespace

TEST_CASE("the first step is as it is") {
  CHECK(step_length(Eigen::Vector2d(0.0, 0.0), 1.0, Eigen::Vector2d(1.0, 2.0), metric) == 1.0);
}

TEST_CASE("after a step that left half of the way the next is twice as long") {
  CHECK(step_length(Eigen::Vector2d(1.0, 2.0), 1.0, Eigen::Vector2d(0.5, 1.0), metric) == doctest::Approx(2.0));
  CHECK(step_length(Eigen::Vector2d(1.0, 2.0), 2.0, Eigen::Vector2d(0.0, 0.0), metric) == doctest::Approx(2.0));
}

TEST_CASE("what lies across the last step does not count") {
  CHECK(step_length(Eigen::Vector2d(1.0, 0.0), 1.0, Eigen::Vector2d(0.25, 9.0), metric) == doctest::Approx(4.0 / 3.0));
}

TEST_CASE("no step is shortened, or made longer than twice") {
  CHECK(step_length(Eigen::Vector2d(1.0, 2.0), 1.0, Eigen::Vector2d(-1.0, -2.0), metric) == 1.0);
  CHECK(step_length(Eigen::Vector2d(1.0, 2.0), 1.0, Eigen::Vector2d(2.0, 4.0), metric) == base_limits::longest_step);
}

TEST_CASE("the way takes fewer steps") {
  CHECK(steps_to_rest(0.5, false) == 22);
  CHECK(steps_to_rest(0.5, true) == 2);
  CHECK(steps_to_rest(0.8, true) < steps_to_rest(0.8, false) / 2);
}
