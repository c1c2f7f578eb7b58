#include "tracking/relocalisation.hpp"

#include <algorithm>
#include <utility>

#include "registration/global_search.hpp"
#include "registration/icp.hpp"

namespace nacre {
namespace {

PointsRef rows_of(const std::vector<Eigen::Vector3f>& vectors) {
  return Eigen::Map<const Points>(vectors.front().data(), static_cast<Eigen::Index>(vectors.size()), 3);
}

}  // namespace

std::vector<Pose> most_promising(const PointModel& model, const IcpSource& source, const std::vector<Pose>& guesses,
                                 const AlignOptions& options, std::size_t count) {
  const IcpTarget whole(AlignCloud(rows_of(model.points), rows_of(model.normals)), options);
  AlignOptions coarse = options;
  coarse.max_samples = coarse.coarse_samples = 300;
  coarse.max_iterations = 15;
  const IcpSource few(AlignCloud(source.cloud.points, source.cloud.normals, source.cloud.sigma), coarse);

  std::vector<std::pair<double, Pose>> candidates;
  candidates.reserve(guesses.size());
  for (const Pose& guess : guesses) {
    const AlignResult result = align_to(whole, few, guess, coarse);
    candidates.emplace_back(result.overlap, result.target_from_source);
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<Pose> best;
  for (std::size_t i = 0; i < std::min(count, candidates.size()); ++i) best.push_back(candidates[i].second);
  return best;
}

std::optional<Pose> fit_anywhere(const PointModel& model, const IcpSource& source, const AlignOptions& options) {
  GlobalAlignOptions search_options;
  // A wrong frame spoils the model: less is believed than of two clouds.
  search_options.max_residual = 0.6;
  search_options.seed = options.seed;
  search_options.num_threads = options.num_threads;
  const GlobalCloud frame(source.cloud.points, source.cloud.normals, Eigen::Vector3d::Zero());
  const GlobalCloud whole(rows_of(model.points), rows_of(model.normals));
  const SearchSide moving(frame, search_options, false), still(whole, search_options, false);
  if (!is_enough(moving) || !is_enough(still)) return std::nullopt;
  const GlobalSearch search(moving, still, search_options);
  const std::vector<SearchCandidate> candidates = search.run();
  const GlobalAcceptance acceptance = accept_motion(candidates, search_options, search.tolerance());
  if (acceptance.status != GlobalAlignStatus::found) return std::nullopt;
  const double rival = search_options.max_rivalry * acceptance.best.score;
  const auto num_good = std::count_if(candidates.begin(), candidates.end(),
                                      [&](const SearchCandidate& candidate) { return candidate.score > rival; });
  if (num_good > 1) return std::nullopt;
  return acceptance.best.alignment.target_from_source;
}

}  // namespace nacre
