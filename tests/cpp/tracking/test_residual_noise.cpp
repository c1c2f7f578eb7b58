#include <cmath>

#include "doctest/doctest.h"
#include "tracking/residual_noise.hpp"

using namespace nacre;

TEST_CASE("frames of a camera as noisy as its images show, or less, change nothing") {
  ResidualNoise noise;
  CHECK(noise.factor() == 1.0);
  for (int i = 0; i < 10; ++i) noise.add(0.5, true);
  CHECK(noise.factor() == 1.0);
}

TEST_CASE("residuals of Laplace's distribution tell its standard deviation") {
  ResidualNoise noise;
  // Scale b: half of the absolute values are below b ln 2, the variance is 2 b^2.
  const double b = 4.0, scale = 1.4826 * b * std::log(2.0);
  noise.add(scale, true);
  CHECK(noise.factor() == doctest::Approx(std::sqrt(2.0) * b).epsilon(1e-3));
}

TEST_CASE("the noise is known when some frames have told") {
  ResidualNoise noise;
  int frames = 0;
  for (; !noise.is_known(); ++frames) noise.add(3.0, true);
  CHECK(frames == 5);
}

TEST_CASE("a camera at rest is as noisy as its frames show until, when it moves, one tells more") {
  ResidualNoise noise;
  for (int i = 0; i < 100; ++i) noise.add(1.0, false);
  CHECK(!noise.is_known());
  CHECK(noise.factor() == doctest::Approx(1.376));
  noise.add(3.0, true);
  CHECK(noise.is_known());
  CHECK(noise.factor() == doctest::Approx(3.0 * 1.376));
  noise.add(1.0, false);
  CHECK(noise.factor() == doctest::Approx(3.0 * 1.376));
}

TEST_CASE("a frame among many counts little, and drift is followed") {
  ResidualNoise noise;
  for (int i = 0; i < 1000; ++i) noise.add(2.0, true);
  const double before = noise.factor();
  noise.add(8.0, true);
  CHECK(noise.factor() < 1.02 * before);
  for (int i = 0; i < 500; ++i) noise.add(8.0, true);
  CHECK(noise.factor() == doctest::Approx(4.0 * before).epsilon(0.02));
}

TEST_CASE("residuals that tell nothing are left out") {
  ResidualNoise noise;
  noise.add(3.0, true);
  const double before = noise.factor();
  noise.add(0.0, true);
  noise.add(std::nan(""), true);
  CHECK(noise.factor() == before);
}
