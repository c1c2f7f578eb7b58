#include "tracking/turntable_search.hpp"

#include <algorithm>
#include <cmath>

#include "base/parallel.hpp"
#include "base/se3.hpp"
#include "camera/limits.hpp"
#include "registration/acceptance.hpp"
#include "registration/icp.hpp"
#include "registration/limits.hpp"
#include "tracking/limits.hpp"
#include "tracking/points_in_view.hpp"

namespace nacre {
namespace {

struct Candidate {
  IcpResult alignment;
  double score = -1e9, overlap = 0.0, agree = 0.0, through = 0.0;
};

class TurntableSearch {
 public:
  TurntableSearch(const PointModel& model, const std::vector<ObjectView>& views, const ObjectView& frame,
                  const Camera& camera, const AlignOptions& options)
      : views_(views),
        frame_(frame),
        camera_(camera),
        options_(single_threaded(options)),
        num_threads_(options.num_threads),
        source_(AlignCloud(frame.points, frame.normals), options_),
        few_(source_.few()),
        target_(AlignCloud(as_rows(model.points), as_rows(model.normals)), options_) {
    const ObjectView& first = views.front();
    plane_ = first.world_from_camera * first.ground_frame();
    normal_ = plane_.linear().col(2);
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const ObjectView& view : views)
      middle += view.world_from_camera * view.center() / static_cast<double>(views.size());
    plane_.translation() += middle - plane_.translation() - normal_.dot(middle - plane_.translation()) * normal_;
    ground_frame_ = frame.ground_frame();
    const Eigen::Vector3d center = frame.center() - ground_frame_.translation();
    ground_frame_.translation() += center - ground_frame_.linear().col(2).dot(center) * ground_frame_.linear().col(2);
  }

  std::vector<Candidate> run() const {
    std::vector<Candidate> candidates(tracking_limits::num_turns);
    parallel_for(tracking_limits::num_turns, 2, num_threads_, [&](std::int64_t i) {
      Pose turn = Pose::Identity();
      turn.linear() =
          Eigen::AngleAxisd(static_cast<double>(i) * 2.0 * static_cast<double>(EIGEN_PI) / tracking_limits::num_turns,
                            Eigen::Vector3d::UnitZ())
              .toRotationMatrix();
      candidates[static_cast<std::size_t>(i)] =
          align(few_, plane_ * turn * ground_frame_.inverse(),
                gates(registration_limits::first_gate * frame_.size, tracking_limits::narrow_gate,
                      tracking_limits::most_coarse_steps));
    });
    candidates = different(std::move(candidates), tracking_limits::num_turn_candidates);
    parallel_for(static_cast<std::int64_t>(candidates.size()), 1, num_threads_, [&](std::int64_t i) {
      Candidate& candidate = candidates[static_cast<std::size_t>(i)];
      candidate =
          climb(align(source_, candidate.alignment.target_from_source,
                      gates(tracking_limits::narrow_gate * frame_.tolerance, 1.0, tracking_limits::most_turn_steps)));
    });
    const std::size_t num_refined = candidates.size();
    return different(std::move(candidates), num_refined);
  }

  // The surfaces decide in the end, closer than the score asks for.
  IcpResult settle(const Candidate& candidate) const {
    const IcpResult settled =
        align_along(motions_on_plane(normal_), target_, source_, candidate.alignment.target_from_source,
                    gates(frame_.tolerance, 1.0, tracking_limits::most_turn_steps));
    return settled.status != AlignStatus::too_few_pairs ? settled : candidate.alignment;
  }

 private:
  static AlignOptions single_threaded(AlignOptions options) {
    options.method = Metric::symmetric;
    options.coarse_samples = static_cast<int>(tracking_limits::coarse_turn_samples);
    options.weak_threshold = 0.0;
    options.num_threads = 1;
    return options;
  }

  // From a gate [m] down to one of so many tolerances.
  AlignOptions gates(double first, double last, int max_iterations) const {
    AlignOptions options = options_;
    options.max_distance = first;
    options.final_distance = last * frame_.tolerance;
    options.max_iterations = max_iterations;
    return options;
  }

  Candidate align(const IcpSource& source, const Pose& guess, const AlignOptions& options) const {
    Candidate candidate;
    candidate.alignment = align_along(motions_on_plane(normal_), target_, source, guess, options);
    if (candidate.alignment.status != AlignStatus::too_few_pairs) score(candidate, source.cloud.points.rows());
    return candidate;
  }

  void score(Candidate& candidate, Eigen::Index num_samples) const {
    candidate.score = candidate.overlap = candidate.agree = candidate.through = 0.0;
    const Pose& pose = candidate.alignment.target_from_source;
    for (const ObjectView& view : views_) {
      const Pose view_from_frame = view.world_from_camera.inverse() * pose;
      const ViewAgreement forward = look_at(frame_, view, view_from_frame, camera_, num_samples);
      const ViewAgreement backward = look_at(view, frame_, view_from_frame.inverse(), camera_, num_samples);
      candidate.score += forward.score() + backward.score();
      candidate.overlap = std::max(candidate.overlap, std::max(forward.agree, backward.agree));
      candidate.agree += forward.agree + backward.agree;
      candidate.through += forward.seen_through + backward.seen_through;
    }
  }

  // Depth that is wrong by the same over a patch pulls surfaces off each other's outlines: the pattern search of Hooke
  // and Jeeves 1961 on the score, in which outlines count.
  Candidate climb(Candidate best) const {
    if (best.alignment.status == AlignStatus::too_few_pairs) return best;
    score(best, registration_limits::view_samples);
    const Eigen::Vector3d axes[] = {normal_, plane_.linear().col(0), plane_.linear().col(1)};
    for (double step = frame_.tolerance; step > tracking_limits::least_climb_step * frame_.tolerance; step *= 0.5) {
      bool is_better = true;
      for (int round = 0; round < tracking_limits::most_climb_rounds && is_better; ++round) {
        is_better = false;
        for (int direction = 0; direction < 6; ++direction) {
          const Eigen::Vector3d& axis = axes[direction / 2];
          const double length = direction % 2 == 0 ? step : -step;
          Candidate next = best;
          Pose& pose = next.alignment.target_from_source;
          if (direction < 2) {
            const Eigen::Vector3d center = pose * frame_.center();
            pose = Eigen::Translation3d(center) *
                   Eigen::AngleAxisd(tracking_limits::climb_lever * length / frame_.size, axis) *
                   Eigen::Translation3d(-center) * pose;
          } else {
            pose.pretranslate(length * axis);
          }
          score(next, registration_limits::view_samples);
          if (next.score <= best.score) continue;
          best = next;
          is_better = true;
        }
      }
    }
    score(best, frame_.points.rows());
    return best;
  }

  std::vector<Candidate> different(std::vector<Candidate> candidates, std::size_t most) const {
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& a, const Candidate& b) { return a.score > b.score; });
    const Eigen::Vector3d middle = frame_.center();
    std::vector<Candidate> kept;
    for (const Candidate& candidate : candidates) {
      if (kept.size() == most) break;
      const Pose& pose = candidate.alignment.target_from_source;
      const auto is_known = [&](const Candidate& other) {
        const Pose& other_pose = other.alignment.target_from_source;
        return angle_between(pose, other_pose) < camera_limits::view_turn &&
               (pose * middle - other_pose * middle).norm() < registration_limits::search_gate * frame_.size;
      };
      if (std::none_of(kept.begin(), kept.end(), is_known)) kept.push_back(candidate);
    }
    return kept;
  }

  const std::vector<ObjectView>& views_;
  const ObjectView& frame_;
  const Camera& camera_;
  AlignOptions options_;
  int num_threads_;
  IcpSource source_, few_;
  IcpTarget target_;
  Pose plane_, ground_frame_;  // world and camera, from a frame in the plane below the object's middle
  Eigen::Vector3d normal_;
};

}  // namespace

std::vector<PlaneFit> fits_on_plane(const PointModel& model, const std::vector<ObjectView>& views,
                                    const ObjectView& frame, const Camera& camera, const AlignOptions& options,
                                    bool with_rivals) {
  if (model.size() == 0 || views.empty()) return {};
  const TurntableSearch search(model, views, frame, camera, options);
  const std::vector<Candidate> candidates = search.run();
  std::vector<SearchFit> fits;
  fits.reserve(candidates.size());
  for (const Candidate& candidate : candidates) {
    fits.push_back({candidate.score, candidate.overlap, candidate.agree / (candidate.agree + candidate.through), true});
  }
  // A rival that is not contradicted is enough for doubt.
  const GlobalAlignOptions usual;
  const std::vector<std::size_t> accepted = accept_rivals(fits, usual.min_overlap, usual.min_consistency, 0.0);
  if (accepted.size() > 1 && !with_rivals) return {};
  std::vector<PlaneFit> found;
  for (const std::size_t i : accepted) {
    found.push_back({search.settle(candidates[i]), fits[i].consistency});
    Pose& pose = found.back().alignment.target_from_source;
    pose = orthonormal(pose);
  }
  return found;
}

}  // namespace nacre
