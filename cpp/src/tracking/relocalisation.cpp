#include "tracking/relocalisation.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "base/parallel.hpp"
#include "registration/global_search.hpp"
#include "registration/icp.hpp"
#include "tracking/limits.hpp"
#include "tracking/points_in_view.hpp"

namespace nacre {

std::vector<Pose> most_promising(const PointModel& model, const IcpSource& source, const std::vector<Pose>& guesses,
                                 const AlignOptions& options) {
  const IcpTarget whole(AlignCloud(as_rows(model.points), as_rows(model.normals)), options);
  AlignOptions coarse = options;
  coarse.max_samples = coarse.coarse_samples = tracking_limits::coarse_turn_samples;
  coarse.num_threads = 1;
  coarse.max_iterations = tracking_limits::most_coarse_turn_steps;
  const IcpSource few(AlignCloud(source.cloud.points, source.cloud.normals, source.cloud.sigma), coarse);

  std::vector<std::pair<double, Pose>> candidates(guesses.size());
  parallel_for(static_cast<std::int64_t>(guesses.size()), 1, options.num_threads, [&](std::int64_t i) {
    const auto k = static_cast<std::size_t>(i);
    const AlignResult result = align_to(whole, few, guesses[k], coarse);
    candidates[k] = {result.overlap, result.target_from_source};
  });
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<Pose> best;
  for (const auto& [overlap, pose] : candidates) {
    if (best.size() < tracking_limits::num_finalists) best.push_back(pose);
  }
  return best;
}

std::optional<Pose> fit_anywhere(const PointModel& model, const IcpSource& source, const AlignOptions& options) {
  GlobalAlignOptions search_options;
  search_options.seed = options.seed;
  search_options.num_threads = options.num_threads;
  const GlobalCloud frame(source.cloud.points, source.cloud.normals, Eigen::Vector3d::Zero());
  const GlobalCloud whole(as_rows(model.points), as_rows(model.normals));
  const SearchSide moving(frame, search_options, false), still(whole, search_options, false);
  if (!is_enough(moving) || !is_enough(still)) return std::nullopt;
  const GlobalSearch search(moving, still, search_options);
  const GlobalAcceptance acceptance = accept_motion(search.run(), search_options, search.tolerance());
  if (acceptance.status != GlobalAlignStatus::found) return std::nullopt;
  return acceptance.best.alignment.target_from_source;
}

}  // namespace nacre
