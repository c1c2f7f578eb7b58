#include <cmath>
#include <functional>

#include "doctest/doctest.h"
#include "tracking/acceptance.hpp"

using namespace nacre;

namespace {

// Of a frame most of which fits a curved surface well.
TrackingResult good(Expectation expectation = Expectation::expected) {
  TrackingResult result;
  result.expectation = expectation;
  result.consistency = 1.0;
  result.alignment.status = AlignStatus::converged;
  result.alignment.overlap = 0.8;
  result.alignment.residual_ratio = 0.15;
  result.alignment.normal_information = 3.0;
  result.alignment.misfit = 0.1;
  result.alignment.weak_directions.resize(6, 0);
  return result;
}

template <class Change>
TrackingResult tested(Change&& change, Expectation expectation = Expectation::expected) {
  TrackingResult result = good(expectation);
  change(result);
  accept_frame(result, TrackingOptions{});
  return result;
}

const auto as_it_is = [](TrackingResult&) {};

}  // namespace

TEST_CASE("a good registration is tracked, wherever it is") {
  for (const Expectation expectation : {Expectation::expected, Expectation::near_lost, Expectation::unexpected}) {
    const TrackingResult result = tested(as_it_is, expectation);
    CHECK(result.status == FrameStatus::tracked);
    CHECK(result.is_clear_cut);
    CHECK(result.reason.empty());
    CHECK(result.score == doctest::Approx(0.8 * 0.8 * std::log(0.58 / 0.15)));
  }
}

TEST_CASE("the more speaks for a place, the less is asked of the frame") {
  const auto bent = [](TrackingResult& result) { result.alignment.misfit = 0.9; };
  const auto plane = [](TrackingResult& result) { result.alignment.normal_information = 0.01; };
  const auto contradicted = [](TrackingResult& result) { result.consistency = 0.85; };
  const auto faint = [](TrackingResult& result) { result.alignment.overlap = 0.49; };
  const std::function<void(TrackingResult&)> changes[] = {bent, plane, contradicted};
  for (const auto& change : changes) {
    CHECK(tested(change, Expectation::expected).status == FrameStatus::tracked);
    CHECK(tested(change, Expectation::near_lost).status == FrameStatus::tracked);
    CHECK(tested(change, Expectation::unexpected).status == FrameStatus::lost);
  }
  CHECK(tested(faint, Expectation::expected).status == FrameStatus::tracked);
  CHECK(tested(faint, Expectation::near_lost).status == FrameStatus::lost);
}

TEST_CASE("what is bent more than noise explains has a lower score, and is said to be") {
  const TrackingResult result = tested([](TrackingResult& bent) { bent.alignment.misfit = 2.0; });
  CHECK(result.status == FrameStatus::lost);
  CHECK(result.score == doctest::Approx(tested(as_it_is).score / 4.0));
  CHECK(result.relocalisation_score == doctest::Approx(tested(as_it_is).relocalisation_score / 16.0));
  CHECK(result.reason.find("bent 2 times") != std::string::npos);
}

TEST_CASE("a frame of another size is lost where the difference is certain, with the factor") {
  const auto of_size = [](double relative, double sigma, Expectation expectation = Expectation::expected) {
    return tested([&](TrackingResult& r) { r.alignment.size_difference = {relative, sigma}; }, expectation);
  };
  const TrackingResult larger = of_size(-0.05, 0.001), smaller = of_size(0.05, 0.001);
  CHECK(larger.status == FrameStatus::lost);
  CHECK(larger.relocalisation_score == 0.0);
  CHECK(larger.reason.rfind("the frame is 1.05 times as large", 0) == 0);
  CHECK(smaller.status == FrameStatus::lost);
  CHECK(smaller.reason.rfind("the frame is 0.952 times as large", 0) == 0);
  CHECK(of_size(-0.02, 0.001).status == FrameStatus::tracked);
  CHECK(of_size(-0.05, 0.006).status == FrameStatus::tracked);
  CHECK(of_size(-0.05, 0.0125).status == FrameStatus::tracked);
  CHECK(of_size(-0.05, 0.0125, Expectation::unexpected).status == FrameStatus::lost);
  CHECK(of_size(0.0, std::numeric_limits<double>::infinity()).status == FrameStatus::tracked);
}

TEST_CASE("directions that are not determined make a frame weak") {
  const auto open = [](TrackingResult& result) { result.alignment.weak_directions.resize(6, 2); };
  CHECK(tested(open).status == FrameStatus::weak);
  CHECK(tested(open).reason.rfind("2 direction(s)", 0) == 0);
}

TEST_CASE("too few matches, and no verification") {
  const auto few = [](TrackingResult& result) { result.alignment.status = AlignStatus::too_few_pairs; };
  CHECK(tested(few).status == FrameStatus::lost);
  CHECK(tested(few).score == 0.0);
  TrackingResult result = good();
  result.alignment.overlap = 0.01;
  result.alignment.size_difference = {0.5, 0.001};
  TrackingOptions options;
  options.verify = false;
  accept_frame(result, options);
  CHECK(result.status == FrameStatus::tracked);
  CHECK_FALSE(result.is_clear_cut);
}
