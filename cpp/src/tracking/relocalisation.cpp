#include "tracking/relocalisation.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "base/parallel.hpp"
#include "camera/view_distance.hpp"
#include "registration/global_search.hpp"
#include "registration/icp.hpp"
#include "tracking/limits.hpp"
#include "tracking/points_in_view.hpp"

namespace nacre {

std::vector<Pose> most_promising(const AlignCloud& model, const IcpSource& source, const std::vector<Pose>& guesses,
                                 const AlignOptions& options, double depth) {
  const IcpTarget target(model, options);
  AlignOptions coarse = options;
  coarse.num_threads = 1;
  coarse.max_iterations = tracking_limits::most_coarse_steps;

  struct Candidate {
    Pose guess, found;
    double overlap;
  };
  std::vector<Candidate> candidates;
  for (const Pose& guess : guesses) candidates.push_back({guess, guess, 0.0});
  const auto keep_best = [&](std::size_t most, int num_samples) {
    coarse.max_samples = coarse.coarse_samples = num_samples;
    const IcpSource few(AlignCloud(source.cloud.points, source.cloud.normals, source.cloud.sigma), coarse);
    parallel_for(static_cast<std::int64_t>(candidates.size()), 1, options.num_threads, [&](std::int64_t i) {
      Candidate& candidate = candidates[static_cast<std::size_t>(i)];
      const AlignResult result = align_to(target, few, candidate.guess, coarse);
      candidate.found = result.target_from_source;
      candidate.overlap = result.overlap;
    });
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& a, const Candidate& b) { return a.overlap > b.overlap; });
    std::vector<Candidate> best;
    for (const Candidate& candidate : candidates) {
      const bool is_known =
          depth > 0.0 && std::any_of(best.begin(), best.end(), [&](const Candidate& better) {
            return view_distance(better.found, candidate.found, depth) < tracking_limits::least_new_view;
          });
      if (!is_known && best.size() < most) best.push_back(candidate);
    }
    candidates = std::move(best);
  };
  keep_best(tracking_limits::num_semifinalists, tracking_limits::first_samples);
  keep_best(tracking_limits::num_finalists, tracking_limits::coarse_turn_samples);
  std::vector<Pose> best;
  for (const Candidate& candidate : candidates) best.push_back(candidate.found);
  return best;
}

std::vector<Pose> fits_anywhere(const PointModel& model, const IcpSource& source, const AlignOptions& options,
                                bool with_rivals) {
  GlobalAlignOptions search_options;
  search_options.seed = options.seed;
  search_options.num_threads = options.num_threads;
  const GlobalCloud frame(source.cloud.points, source.cloud.normals, Eigen::Vector3d::Zero());
  const GlobalCloud whole(as_rows(model.points), as_rows(model.normals));
  const SearchSide moving(frame, search_options, false), still(whole, search_options, false);
  if (!is_enough(moving) || !is_enough(still)) return {};
  const GlobalSearch search(moving, still, search_options);
  const GlobalAcceptance acceptance = accept_motion(search.run(), search_options, search.tolerance());
  return with_rivals || acceptance.status == GlobalAlignStatus::found ? acceptance.rivals : std::vector<Pose>();
}

}  // namespace nacre
