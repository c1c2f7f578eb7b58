#include <algorithm>
#include <cmath>
#include <limits>

#include "base/check.hpp"
#include "nacre/global_registration.hpp"
#include "registration/acceptance.hpp"
#include "registration/global_search.hpp"

namespace nacre {
namespace {

double consistency_of(const ViewAgreement& agreement, bool outlines) {
  const double compared = agreement.agree + agreement.against(outlines);
  return compared > 0.0 ? agreement.agree / compared : 0.0;
}

}  // namespace

const char* to_string(GlobalAlignStatus status) {
  switch (status) {
    case GlobalAlignStatus::found:
      return "found";
    case GlobalAlignStatus::ambiguous:
      return "ambiguous";
    case GlobalAlignStatus::not_found:
      return "not_found";
    default:
      return "too_few_points";
  }
}

void GlobalAlignOptions::check() const {
  require(num_rotations >= 1, "num_rotations", "at least 1", num_rotations);
  require(num_candidates >= 2, "num_candidates", "at least 2", num_candidates);
  require(tolerance >= 0.0 && std::isfinite(tolerance), "tolerance", "0 (automatic) or a positive distance in metres",
          tolerance);
  require(max_angle > 0.0, "max_angle", "a positive angle in radians", max_angle);
  require(min_overlap >= 0.0 && min_overlap <= 1.0, "min_overlap", "in [0, 1]", min_overlap);
  require(min_consistency >= 0.0 && min_consistency <= 1.0, "min_consistency", "in [0, 1]", min_consistency);
  require(max_residual > 0.0, "max_residual", "positive", max_residual);
  require(max_rivalry >= 0.0 && max_rivalry <= 1.0, "max_rivalry", "in [0, 1]", max_rivalry);
  require(max_points >= 0, "max_points", "0 (no limit) or more", max_points);
  require(max_samples >= 1, "max_samples", "at least 1", max_samples);
  require(coarse_samples >= 1, "coarse_samples", "at least 1", coarse_samples);
  require(num_threads >= 0, "num_threads", "0 (all) or more", num_threads);
}

GlobalCloud::GlobalCloud(const PointsRef& points_in, const PointsRef& normals_in,
                         const std::optional<Eigen::Vector3d>& viewpoint_in)
    : points(points_in), normals(normals_in), viewpoint(viewpoint_in) {
  require(normals.rows() == 0 || normals.rows() == points.rows(), "normals", "one row per point", normals.rows());
  if (viewpoint) require(viewpoint->allFinite(), "viewpoint", "finite", viewpoint->transpose());
}

GlobalAcceptance accept_motion(const std::vector<SearchCandidate>& candidates, const GlobalAlignOptions& options,
                               double tolerance) {
  std::vector<SearchFit> fits;
  fits.reserve(candidates.size());
  for (const SearchCandidate& candidate : candidates) {
    fits.push_back({candidate.score, std::max(candidate.forward.agree, candidate.backward.agree),
                    std::min(consistency_of(candidate.forward, options.outlines),
                             consistency_of(candidate.backward, options.outlines)),
                    candidate.alignment.rmse <= options.max_residual * tolerance});
  }
  const SearchAcceptance accepted =
      accept_best(fits, options.min_overlap, options.min_consistency, options.max_rivalry);
  const SearchFit& fit = fits[accepted.best];
  GlobalAcceptance acceptance{accepted.status, candidates[accepted.best], fit.overlap,
                              fit.consistency, accepted.rivalry,          {}};
  const bool is_open = acceptance.best.alignment.weak_directions.cols() > 0;
  if (acceptance.status == GlobalAlignStatus::found && is_open) acceptance.status = GlobalAlignStatus::ambiguous;
  if (is_open) return acceptance;
  for (const std::size_t i : accept_rivals(fits, options.min_overlap, options.min_consistency, options.max_rivalry)) {
    acceptance.rivals.push_back(candidates[i].alignment.target_from_source);
  }
  return acceptance;
}

GlobalAlignResult align_global(const GlobalCloud& source_cloud, const GlobalCloud& target_cloud,
                               const GlobalAlignOptions& options) {
  options.check();
  GlobalAlignResult result;
  result.alignment.rmse = std::numeric_limits<double>::quiet_NaN();
  const SearchSide source(source_cloud, options, true), target(target_cloud, options, true);
  if (!is_enough(source) || !is_enough(target)) return result;
  const GlobalSearch search(source, target, options);
  const GlobalAcceptance acceptance = accept_motion(search.run(), options, search.tolerance());
  result.status = acceptance.status;
  result.alignment = acceptance.best.alignment;
  result.overlap = acceptance.overlap;
  result.consistency = acceptance.consistency;
  result.rivalry = acceptance.rivalry;
  result.tolerance = search.tolerance();
  return result;
}

}  // namespace nacre
