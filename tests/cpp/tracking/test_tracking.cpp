#include "doctest/doctest.h"
#include "tracking/tracking.hpp"

using namespace nacre;

namespace {

// A frame of which a part fits, at a place turned by an angle [rad]: too little to be believed alone.
TrackingResult found_at(double angle, double overlap) {
  TrackingResult found;
  found.alignment.status = AlignStatus::converged;
  found.alignment.target_from_source.linear() = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()).toRotationMatrix();
  found.alignment.weak_directions.resize(6, 0);
  found.alignment.overlap = overlap;
  found.alignment.residual_ratio = 0.2;
  found.alignment.normal_information = 2.0;
  found.alignment.misfit = 0.1;
  found.consistency.of_target = 1.0;
  found.test({}, std::nullopt);
  return found;
}

TrackingPrior with_tried(std::vector<TrackingResult> tried) {
  TrackingPrior prior{{Pose::Identity()}, Expectation::expected, true, true, false, {}};
  prior.elsewhere.beside = true;
  prior.tried = std::move(tried);
  return prior;
}

std::optional<TrackingResult> only(const TrackingPrior& prior) { return only_near(prior, {}, std::nullopt); }

}  // namespace

TEST_CASE("the only place near the last pose that fits is believed") {
  const TrackingResult faint = found_at(0.3, 0.45);
  REQUIRE(faint.is_lost());
  const std::optional<TrackingResult> found = only(with_tried({found_at(0.0, 0.1), faint}));
  REQUIRE(found.has_value());
  CHECK(found->decision == Decision::accepted);
  CHECK(found->alignment.target_from_source.isApprox(faint.alignment.target_from_source));
}

TEST_CASE("two places that fit about as well are none") {
  CHECK_FALSE(only(with_tried({found_at(0.0, 0.43), found_at(0.3, 0.45)})).has_value());
  CHECK(only(with_tried({found_at(0.28, 0.43), found_at(0.3, 0.45)})).has_value());  // the same twice
}

TEST_CASE("a place far from the last pose is not the only one near it, but its rival") {
  const TrackingResult far = found_at(1.5, 0.45);
  CHECK_FALSE(only(with_tried({far})).has_value());
  CHECK_FALSE(only(with_tried({far, found_at(0.3, 0.45)})).has_value());
}

TEST_CASE("what fits too little is not believed, alone or not") {
  CHECK_FALSE(only(with_tried({})).has_value());
  CHECK_FALSE(only(with_tried({found_at(0.3, 0.3)})).has_value());
}

TEST_CASE("a place that resembles is not believed because no other does") {
  TrackingResult bent = found_at(0.3, 0.6);  // a mirrored object
  bent.alignment.misfit = 0.85;
  CHECK_FALSE(only(with_tried({bent})).has_value());
  TrackingResult open = found_at(0.3, 0.45);
  open.alignment.weak_directions.resize(6, 1);
  CHECK_FALSE(only(with_tried({open})).has_value());
}

TEST_CASE("where nothing was tried beside the last pose, nothing is the only place") {
  TrackingPrior prior = with_tried({found_at(0.3, 0.45)});
  prior.elsewhere.beside = false;
  CHECK_FALSE(only(prior).has_value());
}

TEST_CASE("of two images nobody knows that they show the same") {
  TrackingPrior prior = with_tried({found_at(0.3, 0.45)});
  prior.has_moved = false;
  CHECK_FALSE(only(prior).has_value());
}
