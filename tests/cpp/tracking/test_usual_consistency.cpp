#include "doctest/doctest.h"
#include "tracking/usual_consistency.hpp"

using namespace nacre;

TEST_CASE("what frames contradict is not known until some have told") {
  UsualConsistency usual;
  for (int i = 0; i < 5; ++i) {
    CHECK_FALSE(usual.mean());
    usual.add({i % 2 == 0 ? 1.0 : 0.9, i % 2 == 0 ? 0.98 : 0.99});
  }
  CHECK(usual.mean()->of_target == doctest::Approx(0.96));
  CHECK(usual.mean()->of_source == doctest::Approx(0.984));
  CHECK(usual.mean()->contradiction() == doctest::Approx(0.04 + 0.016));
  for (int i = 0; i < 10000; ++i) usual.add({0.98});
  CHECK(usual.mean()->of_target == doctest::Approx(0.98).epsilon(0.01));
}

TEST_CASE("how alike frames look is known when some with colours have told, whatever others do") {
  UsualConsistency usual;
  for (int i = 0; i < 20; ++i) usual.add({1.0});
  for (int i = 0; i < 5; ++i) {
    CHECK(usual.mean()->likeness.num_squares == 0.0);
    usual.add({1.0, 1.0, {i % 2 == 0 ? 0.7 : 0.8, 60.0}});
    usual.add({1.0});
  }
  CHECK(usual.mean()->likeness.agreement == doctest::Approx(0.74));
  CHECK(usual.mean()->likeness.num_squares == doctest::Approx(60.0));
}
