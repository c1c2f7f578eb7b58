#include "tracking/acceptance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

namespace nacre {
namespace {

// What is asked of a registration. Far from all guesses there are many places, and some resemble: boxes' corners fit
// corners, and of unrelated round shapes that match the misfit is 0.54 and more.
struct Demands {
  double score;              // times min_score
  double consistency_power;  // in the score
  double largest_misfit;     // that does not lower the score
  double size_sigma;         // largest standard deviation of a size that counts
  double size_certainty;     // standard deviations by which a size must differ to be another
};

Demands demands_on(Expectation expectation) {
  switch (expectation) {
    case Expectation::expected:
      return {1.0, 4.0, 1.0, 0.005, 5.0};
    case Expectation::near_lost:
      return {1.2, 4.0, 1.0, 0.005, 5.0};
    default:
      return {1.2, 8.0, 0.5, std::numeric_limits<double>::infinity(), 3.0};
  }
}

}  // namespace

TrackingReport TrackingResult::report() const {
  return {
      status, reason,         alignment.target_from_source, alignment.num_inliers,    alignment.overlap, consistency,
      score,  alignment.rmse, alignment.information,        alignment.weak_directions};
}

void accept_frame(TrackingResult& result, const TrackingOptions& options) {
  constexpr double chance = 0.58;  // the rms of a uniform distribution, 1 / sqrt(3)
  constexpr double plane_information = 0.1, plane_score = 4.0;
  constexpr double clear_cut = 2.0;     // times min_score
  constexpr double least_ratio = 0.01;  // data without noise is no more certain
  constexpr double other_size = 0.025;  // relative; of right registrations of real depth 0.015 at most
  std::ostringstream reason;
  reason.precision(3);
  result.status = FrameStatus::lost;
  const IcpResult& alignment = result.alignment;
  const Demands demands = demands_on(result.expectation);
  const double overlap = alignment.overlap;
  const double ratio = std::max(least_ratio, alignment.residual_ratio);
  const double bent = std::max(1.0, alignment.misfit / demands.largest_misfit);
  const double per_match = std::max(0.0, std::log(chance / ratio)) / (bent * bent);
  result.score = overlap * overlap * std::pow(result.consistency, demands.consistency_power) * per_match;
  result.relocalisation_score =
      overlap * std::pow(result.consistency, 12) * per_match / (bent * bent) * alignment.normal_information;
  const bool is_plane = alignment.normal_information < plane_information;
  const bool is_doubtful_plane = is_plane && result.expectation == Expectation::unexpected;
  const double least = options.min_score * (is_doubtful_plane ? plane_score : demands.score);
  const auto [size, size_sigma] = alignment.size_difference;
  const bool is_other_size =
      size_sigma <= demands.size_sigma && std::abs(size) > std::max(other_size, demands.size_certainty * size_sigma);
  if (alignment.status == AlignStatus::too_few_pairs) {
    result.score = result.relocalisation_score = 0.0;
    reason << "too few points of the frame match the model";
  } else if (options.verify && is_other_size) {
    result.relocalisation_score = 0.0;
    reason << "the frame is " << 1.0 / (1.0 + size) << " times as large as the part of the model that it fits";
  } else if (options.verify && !(result.score >= least)) {
    reason << "registration score " << result.score << " is below " << least << ": overlap " << overlap
           << ", consistency " << result.consistency << ", residuals " << ratio << " of the largest that match";
    if (bent > 1.0) reason << ", bent " << bent << " times as much as true matches may be";
  } else if (options.verify && alignment.weak_directions.cols() > 0) {
    result.status = FrameStatus::weak;
    reason << alignment.weak_directions.cols() << " direction(s) of the pose are not determined";
  } else {
    result.status = FrameStatus::tracked;
    result.is_clear_cut = options.verify && result.score >= clear_cut * options.min_score;
  }
  result.reason = reason.str();
}

}  // namespace nacre
