#include "relocalisation.hpp"

#include <algorithm>
#include <utility>

namespace nacre {

std::vector<Pose> most_promising(const PointModel& model, const IcpSource& source, const std::vector<Pose>& guesses,
                                 const AlignOptions& options, std::size_t count) {
  const PointsRef points = Eigen::Map<const Points>(model.points.front().data(), model.size(), 3);
  const PointsRef normals = Eigen::Map<const Points>(model.normals.front().data(), model.size(), 3);
  const IcpTarget whole(AlignCloud(points, normals), options);
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

}  // namespace nacre
