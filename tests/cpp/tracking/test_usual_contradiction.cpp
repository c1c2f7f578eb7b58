#include "doctest/doctest.h"
#include "tracking/usual_contradiction.hpp"

using namespace nacre;

TEST_CASE("what frames contradict is not known until some have told") {
  UsualContradiction usual;
  for (int i = 0; i < 5; ++i) {
    CHECK_FALSE(usual.mean());
    usual.add(i % 2 == 0 ? 0.0 : 0.1);
  }
  CHECK(*usual.mean() == doctest::Approx(0.04));
  for (int i = 0; i < 10000; ++i) usual.add(0.02);
  CHECK(*usual.mean() == doctest::Approx(0.02).epsilon(0.01));
}
