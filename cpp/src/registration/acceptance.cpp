#include "registration/acceptance.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "base/limits.hpp"
#include "registration/limits.hpp"

namespace nacre {
namespace {

// What is asked of a registration. Far from all guesses there are many places, and some resemble: of unrelated round
// shapes that match the misfit is 0.54 and more, and three planes fit any three that meet at the same angles.
struct Demands {
  double score;  // times min_score
  double consistency_power;
  double largest_misfit;  // that does not lower the score
  bool beyond_planes;     // whether matches count by what they tell beyond three planes
};

Demands demands_on(Expectation expectation) {
  using namespace registration_limits;
  switch (expectation) {
    case Expectation::expected:
      return {1.0, consistency_power, 1.0, false};
    case Expectation::near_lost:
      return {doubtful_score, consistency_power, 1.0, false};
    case Expectation::beside:
      return {doubtful_score, consistency_power, far_misfit, false};
    case Expectation::only_near:
      return {only_near_score, consistency_power, far_misfit, false};
    case Expectation::confirmed:
      return {only_near_score, consistency_power, far_misfit, true};
    case Expectation::unexpected:
      return {doubtful_score, far_consistency_power, far_misfit, true};
    default:
      return {0.0, consistency_power, 1.0, false};
  }
}

// Of places near a guess, how much more what either side sees through speaks for one than for another.
double consistency_weight(const Consistency& found, const Consistency& usual) {
  using namespace registration_limits;
  return usual_weight * (usual.contradiction() + least_contradiction) / (found.contradiction() + least_contradiction);
}

// Of what matches tell, the part that three planes do not.
double part_beyond_planes(const IcpResult& alignment) {
  return std::min(1.0, alignment.off_planes / registration_limits::usual_off_planes);
}

// Of a right place to a wrong one; at most 1, and never 0.
double likelihood_ratio(const Consistency& found, const std::optional<Consistency>& usual) {
  const double wrong = registration_limits::wrong_contradiction, contradiction = 1.0 - found.of_target;
  const double right =
      std::clamp(usual ? 1.0 - usual->of_target : wrong, registration_limits::least_ratio * wrong, wrong);
  return std::min(1.0, wrong / right * std::exp(-contradiction * (1.0 / right - 1.0 / wrong)));
}

bool is_other_size(const SizeDifference& size, Expectation expectation) {
  using namespace registration_limits;
  const bool is_far = expectation == Expectation::unexpected;
  const double by_noise = (is_far ? far_size_sigmas : size_sigmas) * size.sigma;
  // Near a guess a size that is not certain says nothing.
  if (!is_far && by_noise > other_size) return false;
  return std::abs(size.relative) > std::max(other_size, by_noise);
}

bool is_beyond_chance(const Likeness& likeness) {
  return std::sqrt(likeness.num_squares) * likeness.agreement >= static_cast<double>(base_limits::noise_sigmas);
}

enum class Looks { unknown, alike, unlike };

// The agreement's standard error is (1 - usual^2) / sqrt(n) where the place is right.
Looks looks_of(const Likeness& found, const std::optional<Consistency>& usual) {
  if (!usual || usual->likeness.num_squares == 0.0 || found.num_squares == 0.0) return Looks::unknown;
  const double usually = usual->likeness.agreement, sigmas = static_cast<double>(base_limits::noise_sigmas);
  const double short_of_usual = std::sqrt(found.num_squares) * (usually - found.agreement);
  if (!is_beyond_chance(found)) return short_of_usual >= sigmas ? Looks::unlike : Looks::unknown;
  return short_of_usual <= sigmas * (1.0 - usually * usually) ? Looks::alike : Looks::unknown;
}

Acceptance accept_as(const IcpResult& alignment, const Consistency& consistency, Expectation expectation,
                     const AcceptanceOptions& options) {
  using namespace registration_limits;
  Acceptance acceptance;
  std::ostringstream reason;
  reason.precision(3);
  if (alignment.status == AlignStatus::too_few_pairs) {
    acceptance.reason = "too few points of the frame match the model";
    acceptance.is_hopeless = true;
    return acceptance;
  }
  const Demands demands = demands_on(expectation);
  const double overlap = alignment.overlap * (1.0 - options.moving);
  const double ratio = std::max(least_ratio, alignment.residual_ratio);
  const double bent = std::max(1.0, alignment.misfit / demands.largest_misfit);
  const double per_match = std::max(0.0, std::log(chance_ratio / ratio)) / (bent * bent);
  const double least = demands.score * options.min_score;
  const double unlikely = likelihood_ratio(consistency, options.usual);
  const bool is_near = expectation != Expectation::unexpected && expectation != Expectation::only_place;
  const bool is_determined = alignment.weak_directions.cols() == 0;
  const double consistent =
      is_near && is_determined && options.usual
          ? consistency_weight(consistency, *options.usual)
          : alignment.overlap * std::pow(consistency.of_target * consistency.of_source, demands.consistency_power);
  const double beyond_planes = demands.beyond_planes ? part_beyond_planes(alignment) : 1.0;
  acceptance.score = overlap * consistent * per_match * beyond_planes;
  if (expectation == Expectation::unexpected) acceptance.score *= unlikely;
  acceptance.relocalisation_score = overlap * std::pow(consistency.of_target, far_consistency_power) * per_match /
                                    (bent * bent) * alignment.normal_information * unlikely * beyond_planes;
  if (options.verify && is_other_size(alignment.size_difference, expectation)) {
    acceptance.relocalisation_score = 0.0;
    reason << "the frame is " << 1.0 / (1.0 + alignment.size_difference.relative)
           << " times as large as the part of the model that it fits";
  } else if (options.verify && !(acceptance.score >= least)) {
    reason << "registration score " << acceptance.score << " is below " << least << ": overlap " << overlap
           << ", consistency " << consistency.of_target << " and " << consistency.of_source << ", residuals " << ratio
           << " of the largest that match";
    if (bent > 1.0) reason << ", bent " << bent << " times as much as true matches may be";
    if (beyond_planes < 1.0) reason << ", all but " << alignment.off_planes << " on three planes";
    const double near = GlobalAlignOptions().max_rivalry;
    acceptance.is_hopeless = acceptance.score < near * only_near_score * options.min_score &&
                             acceptance.relocalisation_score < near * registration_limits::chance_relocalisation;
  } else if (options.verify && !is_determined) {
    // Where the camera was says nothing of a far place, and cannot stand in for what is open there.
    if (expectation != Expectation::unexpected) acceptance.decision = Decision::undetermined;
    reason << alignment.weak_directions.cols() << " direction(s) of the pose are not determined";
    if (expectation == Expectation::unexpected) reason << ", far from all guesses";
  } else {
    acceptance.decision = Decision::accepted;
    acceptance.is_clear_cut = options.verify && overlap * acceptance.score >= clear_cut_score * options.min_score;
  }
  acceptance.reason = reason.str();
  return acceptance;
}

}  // namespace

Acceptance accept(const IcpResult& alignment, const Consistency& consistency, Expectation expectation,
                  const AcceptanceOptions& options) {
  using registration_limits::least_signal;
  Acceptance acceptance = accept_as(alignment, consistency, expectation, options);
  const Looks looks = options.verify ? looks_of(consistency.likeness, options.usual) : Looks::unknown;
  if (looks == Looks::unlike) {
    const bool rests_on_colors = acceptance.decision == Decision::accepted && !(alignment.signal >= least_signal);
    if (expectation == Expectation::expected && !rests_on_colors) return acceptance;
    if (acceptance.decision != Decision::rejected) {
      std::ostringstream reason;
      reason.precision(2);
      reason << "it does not look like the model there: brightness agrees by " << consistency.likeness.agreement
             << ", and by " << options.usual->likeness.agreement << " where frames were registered";
      acceptance.reason = reason.str();
    }
    acceptance.decision = Decision::rejected;
    acceptance.relocalisation_score = 0.0;
    acceptance.is_clear_cut = false;
    return acceptance;
  }
  if (looks == Looks::unknown || acceptance.decision != Decision::rejected) return acceptance;
  Acceptance recognised = accept_as(alignment, consistency, Expectation::confirmed, options);
  if (recognised.decision == Decision::accepted) return recognised;
  acceptance.is_hopeless = acceptance.is_hopeless && recognised.is_hopeless;
  return acceptance;
}

void PlaceOdds::add(double relocalisation_score, double novelty) {
  ++num_views_;
  log_odds_ += novelty * (relocalisation_score - registration_limits::chance_relocalisation);
}

bool PlaceOdds::is_for(double relocalisation_score) {
  return relocalisation_score > registration_limits::chance_relocalisation;
}

bool PlaceOdds::is_enough(double relocalisation_score, Expectation expectation) const {
  using namespace registration_limits;
  return relocalisation_score >= (expectation == Expectation::unexpected ? enough_far : enough_alone) ||
         (num_views_ > 1 && log_odds_ >= enough_together && is_for(relocalisation_score));
}

SearchAcceptance accept_best(const std::vector<SearchFit>& fits, double min_overlap, double min_consistency,
                             double max_rivalry) {
  const auto is_close = [](const SearchFit& fit) { return fit.is_close; };
  const auto found = std::find_if(fits.begin(), fits.end(), is_close);
  if (found == fits.end()) return {GlobalAlignStatus::not_found, 0, 0.0};
  SearchAcceptance acceptance{GlobalAlignStatus::not_found, static_cast<std::size_t>(found - fits.begin()), 0.0};
  const auto rival = std::find_if(found + 1, fits.end(), is_close);
  if (rival != fits.end() && found->score > 0.0) acceptance.rivalry = std::max(0.0, rival->score / found->score);
  const bool agrees = found->score > 0.0 && found->overlap >= min_overlap && found->consistency >= min_consistency;
  if (agrees) {
    acceptance.status = acceptance.rivalry <= max_rivalry ? GlobalAlignStatus::found : GlobalAlignStatus::ambiguous;
  }
  return acceptance;
}

std::vector<std::size_t> accept_rivals(const std::vector<SearchFit>& fits, double min_overlap, double min_consistency,
                                       double max_rivalry) {
  const SearchAcceptance accepted = accept_best(fits, min_overlap, min_consistency, max_rivalry);
  if (accepted.status == GlobalAlignStatus::not_found) return {};
  std::vector<std::size_t> rivals = {accepted.best};
  for (std::size_t i = accepted.best + 1; i < fits.size(); ++i) {
    if (fits[i].is_close && fits[i].score > max_rivalry * fits[accepted.best].score) rivals.push_back(i);
  }
  return rivals;
}

std::optional<std::size_t> only_alike(const std::vector<Likeness>& rivals) {
  if (rivals.size() == 1) return 0;
  std::optional<std::size_t> found;
  for (std::size_t i = 0; i < rivals.size(); ++i) {
    if (!is_beyond_chance(rivals[i])) continue;
    if (found) return std::nullopt;
    found = i;
  }
  return found;
}

}  // namespace nacre
