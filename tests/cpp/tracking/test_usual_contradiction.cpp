#include "doctest/doctest.h"
#include "registration/limits.hpp"
#include "tracking/usual_contradiction.hpp"

using namespace nacre;

TEST_CASE("what frames contradict is taken for much until they have told") {
  UsualContradiction usual;
  CHECK(usual.mean() == registration_limits::wrong_contradiction);
  for (int i = 0; i < 99; ++i) usual.add(0.0);
  CHECK(usual.mean() == doctest::Approx(0.01 * registration_limits::wrong_contradiction));
  for (int i = 0; i < 10000; ++i) usual.add(0.02);
  CHECK(usual.mean() == doctest::Approx(0.02).epsilon(0.01));
}
