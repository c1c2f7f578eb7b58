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
TrackingResult judged(Change&& change, Expectation expectation = Expectation::expected) {
  TrackingResult result = good(expectation);
  change(result);
  judge(result, TrackingOptions{});
  return result;
}

const auto as_it_is = [](TrackingResult&) {};

}  // namespace

TEST_CASE("a good registration is tracked, wherever it is") {
  for (const Expectation expectation : {Expectation::expected, Expectation::near_lost, Expectation::unexpected}) {
    const TrackingResult result = judged(as_it_is, expectation);
    CHECK(result.status == FrameStatus::tracked);
    CHECK(result.is_beyond_doubt);
    CHECK(result.reason.empty());
    CHECK(result.evidence == doctest::Approx(0.8 * 0.8 * std::log(0.58 / 0.15)));
  }
}

TEST_CASE("the more speaks for a place, the less is asked of the frame") {
  const auto bent = [](TrackingResult& result) { result.alignment.misfit = 0.9; };
  const auto plane = [](TrackingResult& result) { result.alignment.normal_information = 0.01; };
  const auto contradicted = [](TrackingResult& result) { result.consistency = 0.85; };
  const auto faint = [](TrackingResult& result) { result.alignment.overlap = 0.49; };
  const std::function<void(TrackingResult&)> changes[] = {bent, plane, contradicted};
  for (const auto& change : changes) {
    CHECK(judged(change, Expectation::expected).status == FrameStatus::tracked);
    CHECK(judged(change, Expectation::near_lost).status == FrameStatus::tracked);
    CHECK(judged(change, Expectation::unexpected).status == FrameStatus::lost);
  }
  CHECK(judged(faint, Expectation::expected).status == FrameStatus::tracked);
  CHECK(judged(faint, Expectation::near_lost).status == FrameStatus::lost);
}

TEST_CASE("what is bent more than noise explains has less evidence, and is said to be") {
  const TrackingResult result = judged([](TrackingResult& bent) { bent.alignment.misfit = 2.0; });
  CHECK(result.status == FrameStatus::lost);
  CHECK(result.evidence == doctest::Approx(judged(as_it_is).evidence / 4.0));
  CHECK(result.recognition == doctest::Approx(judged(as_it_is).recognition / 16.0));
  CHECK(result.reason.find("bent 2 times") != std::string::npos);
}

TEST_CASE("a frame of another size is lost where the difference is certain, with the factor") {
  const auto of_size = [](double relative, double sigma, Expectation expectation = Expectation::expected) {
    return judged([&](TrackingResult& r) { r.alignment.size_difference = {relative, sigma}; }, expectation);
  };
  const TrackingResult larger = of_size(-0.05, 0.001), smaller = of_size(0.05, 0.001);
  CHECK(larger.status == FrameStatus::lost);
  CHECK(larger.recognition == 0.0);
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
  CHECK(judged(open).status == FrameStatus::weak);
  CHECK(judged(open).reason.rfind("2 direction(s)", 0) == 0);
}

TEST_CASE("too few matches, and no verification") {
  const auto few = [](TrackingResult& result) { result.alignment.status = AlignStatus::too_few_pairs; };
  CHECK(judged(few).status == FrameStatus::lost);
  CHECK(judged(few).evidence == 0.0);
  TrackingResult result = good();
  result.alignment.overlap = 0.01;
  result.alignment.size_difference = {0.5, 0.001};
  TrackingOptions options;
  options.verify = false;
  judge(result, options);
  CHECK(result.status == FrameStatus::tracked);
  CHECK_FALSE(result.is_beyond_doubt);
}
