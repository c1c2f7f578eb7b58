#include <cmath>
#include <functional>

#include "doctest/doctest.h"
#include "registration/acceptance.hpp"
#include "registration/limits.hpp"

using namespace nacre;

namespace {

// Of a frame most of which fits a curved surface well.
struct Registration {
  IcpResult alignment;
  Consistency consistency;

  Registration() {
    alignment.status = AlignStatus::converged;
    alignment.overlap = 0.8;
    alignment.residual_ratio = 0.15;
    alignment.normal_information = 3.0;
    alignment.off_planes = 0.5;
    alignment.misfit = 0.1;
    alignment.weak_directions.resize(6, 0);
  }
};

template <class Change>
Acceptance tested(Change&& change, Expectation expectation = Expectation::expected,
                  const AcceptanceOptions& options = {0.3, true, std::nullopt}) {
  Registration registration;
  change(registration);
  return accept(registration.alignment, registration.consistency, expectation, options);
}

const auto as_it_is = [](Registration&) {};

}  // namespace

TEST_CASE("a good registration is tracked, wherever it is") {
  for (const Expectation expectation :
       {Expectation::expected, Expectation::near_lost, Expectation::beside, Expectation::unexpected}) {
    const Acceptance result = tested(as_it_is, expectation);
    CHECK(result.decision == Decision::accepted);
    CHECK(result.is_clear_cut);
    CHECK(result.reason.empty());
    CHECK(result.score == doctest::Approx(0.8 * 0.8 * std::log(0.58 / 0.15)));
  }
}

TEST_CASE("the more speaks for a place, the less is asked of the frame") {
  const auto bent = [](Registration& result) { result.alignment.misfit = 0.9; };
  const auto contradicted = [](Registration& result) { result.consistency.of_target = 0.85; };
  const auto faint = [](Registration& result) { result.alignment.overlap = 0.49; };
  const std::function<void(Registration&)> changes[] = {bent, contradicted};
  for (const auto& change : changes) {
    CHECK(tested(change, Expectation::expected).decision == Decision::accepted);
    CHECK(tested(change, Expectation::near_lost).decision == Decision::accepted);
    CHECK(tested(change, Expectation::unexpected).decision == Decision::rejected);
  }
  CHECK(tested(bent, Expectation::beside).decision == Decision::rejected);
  CHECK(tested(contradicted, Expectation::beside).decision == Decision::accepted);
  CHECK(tested(faint, Expectation::beside).decision == Decision::rejected);
  CHECK(tested(faint, Expectation::expected).decision == Decision::accepted);
  CHECK(tested(faint, Expectation::near_lost).decision == Decision::rejected);
}

TEST_CASE("what is hopeless anywhere is believed nowhere") {
  const Expectation all[] = {Expectation::expected,  Expectation::near_lost, Expectation::beside,
                             Expectation::only_near, Expectation::confirmed, Expectation::unexpected};
  int num_hopeless = 0;
  for (double overlap = 0.05; overlap < 1.0; overlap += 0.05) {
    const auto covered = [&](Registration& result) { result.alignment.overlap = overlap; };
    for (const Expectation here : all) {
      if (!tested(covered, here).is_hopeless) continue;
      ++num_hopeless;
      for (const Expectation there : all) CHECK(tested(covered, there).decision == Decision::rejected);
    }
  }
  CHECK(num_hopeless > 0);
  CHECK_FALSE(tested([](Registration& result) { result.alignment.overlap = 0.05; }, Expectation::expected,
                     {0.3, false, std::nullopt})
                  .is_hopeless);
}

TEST_CASE("too few pairs are hopeless") {
  CHECK(tested([](Registration& result) { result.alignment.status = AlignStatus::too_few_pairs; }).is_hopeless);
}

TEST_CASE("what may be another view of a place that others speak for is not hopeless") {
  const auto partial = [](Registration& result) { result.alignment.overlap = 0.2; };  // matches closely, where it does
  CHECK(tested(partial).decision == Decision::rejected);
  CHECK_FALSE(tested(partial).is_hopeless);
}

TEST_CASE("what the frame before confirms needs less, but not nothing") {
  const auto faint = [](Registration& result) { result.alignment.overlap = 0.35; };
  const auto too_faint = [](Registration& result) { result.alignment.overlap = 0.25; };
  CHECK(tested(faint, Expectation::expected).decision == Decision::rejected);
  CHECK(tested(faint, Expectation::confirmed).decision == Decision::accepted);
  CHECK(tested(too_faint, Expectation::confirmed).decision == Decision::rejected);
  const auto flat = [](Registration& result) {  // two planes slide along each other as they did a frame before
    result.alignment.overlap = 0.35;
    result.alignment.off_planes = 0.02;
  };
  CHECK(tested(flat, Expectation::confirmed).decision == Decision::rejected);
}

TEST_CASE("far from all guesses, what matches tell counts as far as they are off three planes") {
  const auto corner = [](Registration& result) { result.alignment.off_planes = 0.04; };
  for (const Expectation near :
       {Expectation::expected, Expectation::near_lost, Expectation::beside, Expectation::only_place}) {
    CHECK(tested(corner, near).score == tested(as_it_is, near).score);
  }
  const Acceptance far = tested(corner, Expectation::unexpected), round = tested(as_it_is, Expectation::unexpected);
  CHECK(far.decision == Decision::rejected);
  CHECK(far.score == doctest::Approx(0.2 * round.score));
  CHECK(far.relocalisation_score == doctest::Approx(0.2 * round.relocalisation_score));
  CHECK(far.reason.find("all but 0.04 on three planes") != std::string::npos);
}

TEST_CASE("what a pose leaves open is taken from a guess, which a far place does not have") {
  const auto open = [](Registration& result) { result.alignment.weak_directions.resize(6, 1); };
  CHECK(tested(open, Expectation::expected).decision == Decision::undetermined);
  CHECK(tested(open, Expectation::near_lost).decision == Decision::undetermined);
  const Acceptance far = tested(open, Expectation::unexpected);
  CHECK(far.decision == Decision::rejected);
  CHECK(far.reason.find("1 direction(s) of the pose are not determined, far from all guesses") == 0);
}

TEST_CASE("what is bent more than noise explains has a lower score, and is said to be") {
  const Acceptance result = tested([](Registration& bent) { bent.alignment.misfit = 2.0; });
  CHECK(result.decision == Decision::rejected);
  CHECK(result.score == doctest::Approx(tested(as_it_is).score / 4.0));
  CHECK(result.relocalisation_score == doctest::Approx(tested(as_it_is).relocalisation_score / 16.0));
  CHECK(result.reason.find("bent 2 times") != std::string::npos);
}

TEST_CASE("a frame of another size is lost where the difference is certain, with the factor") {
  const auto of_size = [](double relative, double sigma, Expectation expectation = Expectation::expected) {
    return tested([&](Registration& r) { r.alignment.size_difference = {relative, sigma}; }, expectation);
  };
  const Acceptance larger = of_size(-0.05, 0.001), smaller = of_size(0.05, 0.001);
  CHECK(larger.decision == Decision::rejected);
  CHECK(larger.relocalisation_score == 0.0);
  CHECK(larger.reason.rfind("the frame is 1.05 times as large", 0) == 0);
  CHECK(smaller.decision == Decision::rejected);
  CHECK(smaller.reason.rfind("the frame is 0.952 times as large", 0) == 0);
  CHECK(of_size(-0.02, 0.001).decision == Decision::accepted);
  CHECK(of_size(-0.05, 0.006).decision == Decision::accepted);
  CHECK(of_size(-0.05, 0.0125).decision == Decision::accepted);
  CHECK(of_size(-0.05, 0.0125, Expectation::unexpected).decision == Decision::rejected);
  CHECK(of_size(0.0, std::numeric_limits<double>::infinity()).decision == Decision::accepted);
}

TEST_CASE("directions that are not determined make a frame weak") {
  const auto open = [](Registration& result) { result.alignment.weak_directions.resize(6, 2); };
  CHECK(tested(open).decision == Decision::undetermined);
  CHECK(tested(open).reason.rfind("2 direction(s)", 0) == 0);
}

TEST_CASE("too few matches, and no verification") {
  const auto few = [](Registration& result) { result.alignment.status = AlignStatus::too_few_pairs; };
  CHECK(tested(few).decision == Decision::rejected);
  CHECK(tested(few).score == 0.0);
  const Acceptance result = tested(
      [](Registration& other) {
        other.alignment.overlap = 0.01;
        other.alignment.size_difference = {0.5, 0.001};
      },
      Expectation::expected, {0.3, false, std::nullopt});
  CHECK(result.decision == Decision::accepted);
  CHECK_FALSE(result.is_clear_cut);
}

TEST_CASE("where a search has compared all places, less is asked of the one that is left") {
  const auto faint = [](Registration& result) { result.alignment.overlap = 0.3; };
  CHECK(tested(faint, Expectation::expected).decision == Decision::rejected);
  CHECK(tested(faint, Expectation::only_place).decision == Decision::accepted);
}

TEST_CASE("the best of a search is believed where it agrees and no other comes near it") {
  const SearchFit good{1.0, 0.6, 0.9, true}, weaker{0.4, 0.6, 0.9, true};
  const auto best_of = [](const std::vector<SearchFit>& fits) { return accept_best(fits, 0.3, 0.8, 0.7); };
  CHECK(best_of({good}).status == GlobalAlignStatus::found);
  CHECK(best_of({good, weaker}).status == GlobalAlignStatus::found);
  CHECK(best_of({good, weaker}).rivalry == doctest::Approx(0.4));
  SearchFit rival = good, far = good, contradicted = good, small = good, negative = good;
  rival.score = 0.8;
  CHECK(best_of({good, rival}).status == GlobalAlignStatus::ambiguous);
  far.is_close = false;
  far.score = 1.2;
  CHECK(best_of({far, good}).best == 1);
  CHECK(best_of({far, good}).status == GlobalAlignStatus::found);
  CHECK(best_of({far}).status == GlobalAlignStatus::not_found);
  contradicted.consistency = 0.7;
  CHECK(best_of({contradicted}).status == GlobalAlignStatus::not_found);
  small.overlap = 0.2;
  CHECK(best_of({small}).status == GlobalAlignStatus::not_found);
  negative.score = -0.1;
  CHECK(best_of({negative}).status == GlobalAlignStatus::not_found);
  CHECK(best_of({}).status == GlobalAlignStatus::not_found);
}

TEST_CASE("where the camera contradicts little, a far place that contradicts more is lost") {
  const auto contradicts = [](Registration& registration) { registration.consistency.of_target = 0.95; };
  const AcceptanceOptions exact{0.3, true, Consistency{0.999}}, noisy{0.3, true, Consistency{0.95}};
  CHECK(tested(contradicts, Expectation::unexpected).decision == Decision::accepted);
  CHECK(tested(contradicts, Expectation::unexpected, noisy).decision == Decision::accepted);
  CHECK(tested(contradicts, Expectation::unexpected, exact).decision == Decision::rejected);
  CHECK(tested(contradicts, Expectation::unexpected, exact).relocalisation_score < 1e-6);
  // What contradicts as little as ever is not held against the place.
  const auto agrees = [](Registration& registration) { registration.consistency.of_target = 0.999; };
  CHECK(tested(agrees, Expectation::unexpected, exact).score == tested(agrees, Expectation::unexpected).score);
}

TEST_CASE("near a guess, what contradicts is held against what right places contradict") {
  const auto contradicts = [](Registration& registration) { registration.consistency.of_target = 0.93; };
  const AcceptanceOptions exact{0.3, true, Consistency{}}, noisy{0.3, true, Consistency{0.93}};
  CHECK(tested(contradicts, Expectation::expected).decision == Decision::accepted);
  CHECK(tested(contradicts, Expectation::expected, exact).score <
        0.5 * tested(contradicts, Expectation::expected).score);
  CHECK(tested(contradicts, Expectation::expected, noisy).score > tested(contradicts, Expectation::expected).score);
  // Directions that are open say nothing of how it contradicts.
  const auto open = [&](Registration& registration) {
    contradicts(registration);
    registration.alignment.weak_directions = Eigen::MatrixXd::Identity(6, 1);
  };
  CHECK(tested(open, Expectation::expected, exact).score == tested(open, Expectation::expected).score);
}

TEST_CASE("new surface does not speak against a place, but surface where the last image saw none does") {
  const AcceptanceOptions known{0.3, true, Consistency{0.99, 0.99}};
  const auto turned = [](Registration& registration) { registration.alignment.overlap = 0.35; };
  const auto shifted = [&](Registration& registration) {
    turned(registration);
    registration.consistency = {0.99, 0.92};
  };
  CHECK(tested(turned, Expectation::expected).decision == Decision::rejected);
  CHECK(tested(turned, Expectation::expected, known).decision == Decision::accepted);
  CHECK(tested(shifted, Expectation::expected, known).decision == Decision::rejected);
  CHECK(tested(shifted, Expectation::expected, known).reason.find("consistency 0.99 and 0.92") != std::string::npos);
  // What was seen elsewhere the last image does not tell of far places.
  CHECK(tested(shifted, Expectation::unexpected).relocalisation_score ==
        tested([&](Registration& registration) { shifted(registration), registration.consistency.of_source = 1.0; },
               Expectation::unexpected)
            .relocalisation_score);
}

TEST_CASE("where little of a frame matches, other guesses are tried, however little contradicts") {
  const AcceptanceOptions known{0.3, true, Consistency{}};
  const auto half = [](Registration& registration) { registration.alignment.overlap = 0.4; };
  CHECK(tested(half, Expectation::expected, known).score > 2.0 * 0.3);
  CHECK_FALSE(tested(half, Expectation::expected, known).is_clear_cut);
  CHECK(tested(as_it_is, Expectation::expected, known).is_clear_cut);
}

TEST_CASE("views of a place add up, by how much they differ") {
  PlaceOdds odds;
  odds.add(0.6, 1.0);
  CHECK_FALSE(odds.is_enough(0.6, Expectation::expected));
  odds.add(0.6, 0.1);
  CHECK_FALSE(odds.is_enough(0.6, Expectation::expected));
  odds.add(0.6, 1.0);
  CHECK(odds.is_enough(0.6, Expectation::expected));
  CHECK_FALSE(odds.is_enough(0.2, Expectation::expected));  // this view does not speak for it
  odds.add(0.0, 4.0);
  CHECK(odds.is_against());
  CHECK(PlaceOdds().is_enough(1.5, Expectation::expected));
  CHECK_FALSE(PlaceOdds().is_enough(1.5, Expectation::unexpected));
}

namespace {

Registration looking(double agreement, double num_squares) {
  Registration registration;
  registration.consistency.likeness = {agreement, num_squares};
  return registration;
}

// As frames of this recording are, of which each tells a mean of 60 squares.
const AcceptanceOptions colored = {0.3, true, Consistency{1.0, 1.0, {0.7, 60.0}}};

Acceptance tested_among_colored(const Registration& registration, Expectation expectation) {
  return accept(registration.alignment, registration.consistency, expectation, colored);
}

}  // namespace

TEST_CASE("of a place that looks as registered frames do as little is asked as where another registration leads") {
  for (const Expectation expectation : {Expectation::near_lost, Expectation::beside, Expectation::unexpected}) {
    Registration alike = looking(0.65, 60.0), unknown;
    for (Registration* registration : {&alike, &unknown}) {
      registration->alignment.overlap = 0.4;
      registration->alignment.residual_ratio = 0.3;
      registration->consistency.of_target = 0.98;
    }
    const Acceptance result = tested_among_colored(alike, expectation);
    CHECK(result.decision == Decision::accepted);
    CHECK(result.score == tested_among_colored(unknown, Expectation::confirmed).score);
    CHECK(tested_among_colored(unknown, expectation).decision == Decision::rejected);
    // So are some of few squares by chance, and such as are no more alike than those of other places may be.
    for (const auto& [agreement, num_squares] : {std::pair{0.65, 20.0}, {0.35, 60.0}}) {
      alike.consistency.likeness = {agreement, num_squares};
      CHECK(tested_among_colored(alike, expectation).decision == Decision::rejected);
    }
  }
}

TEST_CASE("looks alone are no pose") {
  Registration alike = looking(0.65, 60.0);
  alike.alignment.overlap = 0.03;
  CHECK(tested_among_colored(alike, Expectation::unexpected).decision == Decision::rejected);
  alike = looking(0.65, 60.0);
  alike.alignment.off_planes = 0.0;
  CHECK(tested_among_colored(alike, Expectation::unexpected).decision == Decision::rejected);
  alike = looking(0.65, 60.0);
  alike.alignment.weak_directions = Eigen::Matrix<double, 6, Eigen::Dynamic>::Identity(6, 1);
  CHECK(tested_among_colored(alike, Expectation::unexpected).decision == Decision::rejected);
}

TEST_CASE("a place that looks otherwise is none, but near a guess") {
  const Registration unlike = looking(0.05, 60.0);
  for (const Expectation expectation : {Expectation::near_lost, Expectation::beside, Expectation::only_near,
                                        Expectation::confirmed, Expectation::unexpected, Expectation::only_place}) {
    const Acceptance result = tested_among_colored(unlike, expectation);
    CHECK(result.decision == Decision::rejected);
    CHECK(result.reason.find("does not look like the model") != std::string::npos);
    CHECK_FALSE(PlaceOdds::is_for(result.relocalisation_score));
    CHECK(tested_among_colored(looking(0.05, 12.0), expectation).decision == Decision::accepted);  // few tell
    CHECK(tested_among_colored(looking(0.0, 0.0), expectation).decision == Decision::accepted);    // no colours
  }
  // Light may have changed; but where noise tells more than shape does, the pose rests on colours.
  CHECK(tested_among_colored(unlike, Expectation::expected).decision == Decision::accepted);
  Registration open = unlike;
  open.alignment.signal = 0.5;
  CHECK(tested_among_colored(open, Expectation::expected).decision == Decision::rejected);
  open.alignment.weak_directions = Eigen::Matrix<double, 6, Eigen::Dynamic>::Identity(6, 1);
  CHECK(tested_among_colored(open, Expectation::expected).decision == Decision::undetermined);
  AcceptanceOptions unknown = colored;
  unknown.usual->likeness = {};
  CHECK(accept(unlike.alignment, unlike.consistency, Expectation::unexpected, unknown).decision == Decision::accepted);
}

TEST_CASE("of rivals the only one that looks alike is right") {
  const Likeness alike{0.7, 60.0}, by_chance{0.3, 60.0}, too_few{0.9, 12.0};
  CHECK(only_alike({by_chance}) == 0);
  CHECK(only_alike({by_chance, alike, too_few}) == 1);
  CHECK(only_alike({alike, by_chance, alike}) == std::nullopt);
  CHECK(only_alike({by_chance, too_few}) == std::nullopt);
  CHECK(only_alike({}) == std::nullopt);
}

TEST_CASE("rivals are those that come near the best fit, where that is believed") {
  using Rivals = std::vector<std::size_t>;
  const SearchFit best{1.0, 0.5, 0.9, true}, near{0.8, 0.1, 0.5, true}, far{0.5, 0.5, 0.9, true},
      coarse{0.9, 0.5, 0.9, false};
  CHECK(accept_rivals({best, coarse, near, far}, 0.2, 0.7, 0.7) == Rivals{0, 2});
  CHECK(accept_rivals({best, coarse, far}, 0.2, 0.7, 0.7) == Rivals{0});
  CHECK(accept_rivals({coarse, best}, 0.2, 0.7, 0.7) == Rivals{1});
  CHECK(accept_rivals({near, far}, 0.2, 0.7, 0.7) == Rivals{});
  CHECK(accept_rivals({}, 0.2, 0.7, 0.7) == Rivals{});
}
