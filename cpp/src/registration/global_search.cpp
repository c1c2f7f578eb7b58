#include "registration/global_search.hpp"

#include <algorithm>
#include <cmath>

#include "base/limits.hpp"
#include "base/parallel.hpp"
#include "base/se3.hpp"
#include "camera/limits.hpp"
#include "registration/icp.hpp"
#include "registration/limits.hpp"
#include "registration/rotation_grid.hpp"

namespace nacre {
namespace {

// Parts of the smaller cloud's diameter.

AlignOptions icp_options(const GlobalAlignOptions& options) {
  AlignOptions icp;
  icp.max_points = 0;
  icp.max_samples = options.max_samples;
  icp.coarse_samples = options.coarse_samples;
  icp.seed = options.seed;
  icp.num_threads = 1;  // many registrations run side by side
  return icp;
}

ViewAgreement ask(const IcpSource& source, const SearchSide& onto, const Pose& pose, const Gate& gate, double tolerance,
                  double margin) {
  const Eigen::Index count = source.cloud.points.rows();
  std::vector<std::uint32_t> nearest(static_cast<std::size_t>(count), no_slot);
  ViewAgreement agreement;
  for (const Pair& pair : onto.target.match(source, count, pose, gate, nearest)) {
    const double ratio = residual(pair, Metric::symmetric) / tolerance;
    agreement.agree += std::max(0.0, 1.0 - ratio * ratio);
  }
  for (Eigen::Index i = 0; onto.seen && i < count; ++i) {
    const Eigen::Vector3d point = pose * source.cloud.points.row(i).transpose().cast<double>();
    const FreeSpace::Seen seen = onto.seen->look(point, margin);
    if (seen == FreeSpace::Seen::free) agreement.seen_through += 1.0;
    if (seen == FreeSpace::Seen::beyond) agreement.beyond += 1.0;
    if (seen == FreeSpace::Seen::hidden) {
      const Eigen::Vector3d normal = pose.linear() * source.cloud.normals.row(i).transpose().cast<double>();
      const double facing = normal.dot((onto.seen->viewpoint() - point).normalized());
      if (facing > camera_limits::least_facing && !source.cloud.has_estimated_normals) agreement.occluded += 1.0;
    }
  }
  for (double* part : {&agreement.agree, &agreement.seen_through, &agreement.occluded, &agreement.beyond}) {
    *part /= static_cast<double>(std::max<Eigen::Index>(count, 1));
  }
  return agreement;
}

}  // namespace

bool is_enough(const SearchSide& side) { return side.all.cloud.points.rows() >= base_limits::least_points; }

SearchSide::SearchSide(const GlobalCloud& cloud_in, const GlobalAlignOptions& options, bool is_noisy)
    : cloud(cloud_in, options, is_noisy),
      all(AlignCloud(cloud.points, cloud.normals), icp_options(options)),
      few(all.few()),
      target(AlignCloud(cloud.points, cloud.normals), icp_options(options)) {
  if (cloud.points.rows() > 0) middle = cloud.points.cast<double>().colwise().mean().transpose();
  if (!cloud_in.viewpoint) return;
  seen.emplace(cloud_in.points, *cloud_in.viewpoint);
  middle += registration_limits::center_depth * seen->radius() * seen->axis();
}

GlobalSearch::GlobalSearch(const SearchSide& source, const SearchSide& target, const GlobalAlignOptions& options)
    : source_(source),
      target_(target),
      options_(options),
      size_(std::min(source.target.diameter(), target.target.diameter())),
      tolerance_(options.tolerance) {
  if (tolerance_ > 0.0) return;
  tolerance_ =
      std::max(registration_limits::least_tolerance * size_,
               static_cast<double>(base_limits::noise_sigmas) * std::hypot(source.cloud.noise, target.cloud.noise));
}

std::vector<SearchCandidate> GlobalSearch::run() const {
  std::vector<SearchCandidate> candidates(static_cast<std::size_t>(options_.num_rotations));
  parallel_for(options_.num_rotations, 4, options_.num_threads,
               [&](std::int64_t i) { candidates[static_cast<std::size_t>(i)] = start_from(static_cast<int>(i)); });
  candidates = best_different(std::move(candidates), static_cast<std::size_t>(options_.num_candidates));
  parallel_for(static_cast<std::int64_t>(candidates.size()), 1, options_.num_threads,
               [&](std::int64_t i) { refine(candidates[static_cast<std::size_t>(i)]); });
  const std::size_t num_refined = candidates.size();
  return best_different(std::move(candidates), num_refined);
}

SearchCandidate GlobalSearch::start_from(int number) const {
  AlignOptions icp = icp_options(options_);
  icp.max_distance = registration_limits::first_gate * size_;
  icp.final_distance = registration_limits::search_gate * size_;
  icp.max_iterations = 12;
  icp.weak_threshold = 0.0;
  Pose guess = Pose::Identity();
  guess.linear() = spread_rotation(number, options_.num_rotations).toRotationMatrix();
  guess.translation() = target_.middle - guess.linear() * source_.middle;
  SearchCandidate candidate;
  candidate.alignment = align_to(target_.target, source_.few, guess, icp);
  score(candidate, true, std::max(tolerance_, registration_limits::search_gate * size_));
  return candidate;
}

void GlobalSearch::refine(SearchCandidate& candidate) const {
  AlignOptions icp = icp_options(options_);
  icp.max_distance = registration_limits::search_gate * size_;
  candidate.alignment = align_to(target_.target, source_.all, candidate.alignment.target_from_source, icp);
  score(candidate, false, tolerance_);
}

void GlobalSearch::score(SearchCandidate& candidate, bool with_few, double tolerance) const {
  candidate.score = -10.0;
  if (candidate.alignment.status == AlignStatus::too_few_pairs) return;
  // Along the surface the nearest point is as far as the points are apart.
  const double spacing = std::max(source_.target.spacing(), target_.target.spacing());
  const Gate gate{tolerance + 2.0 * spacing, std::cos(options_.max_angle), false};
  const double margin = std::max(2.0 * tolerance, 0.01 * size_);
  const Pose& pose = candidate.alignment.target_from_source;
  candidate.forward = ask(with_few ? source_.few : source_.all, target_, pose, gate, tolerance, margin);
  candidate.backward = ask(with_few ? target_.few : target_.all, source_, pose.inverse(), gate, tolerance, margin);
  candidate.score = candidate.forward.score(options_.outlines) + candidate.backward.score(options_.outlines);
}

bool GlobalSearch::is_same(const Pose& a, const Pose& b) const {
  return angle_between(a, b) < camera_limits::view_turn &&
         (a * source_.middle - b * source_.middle).norm() < registration_limits::search_gate * size_;
}

std::vector<SearchCandidate> GlobalSearch::best_different(std::vector<SearchCandidate> candidates,
                                                          std::size_t most) const {
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const SearchCandidate& a, const SearchCandidate& b) { return a.score > b.score; });
  std::vector<SearchCandidate> kept;
  for (const SearchCandidate& candidate : candidates) {
    if (kept.size() == most) break;
    const auto is_known = [&](const SearchCandidate& other) {
      return is_same(candidate.alignment.target_from_source, other.alignment.target_from_source);
    };
    if (std::none_of(kept.begin(), kept.end(), is_known)) kept.push_back(candidate);
  }
  return kept;
}

}  // namespace nacre
