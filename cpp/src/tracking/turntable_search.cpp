#include "tracking/turntable_search.hpp"

#include <algorithm>
#include <cmath>

#include "base/parallel.hpp"
#include "base/se3.hpp"
#include "registration/planar.hpp"

namespace nacre {
namespace {

constexpr int num_angles = 72;  // from which the search starts
constexpr std::size_t num_candidates = 10;
constexpr Eigen::Index coarse_samples = 300, climb_samples = 800;
constexpr double same_turn = 0.15;                             // [rad]
constexpr double same_shift = 0.08;                            // of the object's size
constexpr double first_gate = 0.25;                            // of the object's size
constexpr double least_score = 0.1, least_view_overlap = 0.1;  // parts of the samples
constexpr double least_consistency = 0.75;

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
        target_(AlignCloud(rows_of(model.points), rows_of(model.normals)), options_) {
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
    std::vector<Candidate> candidates(num_angles);
    parallel_for(num_angles, 2, num_threads_, [&](std::int64_t i) {
      Pose turn = Pose::Identity();
      turn.linear() = Eigen::AngleAxisd(static_cast<double>(i) * 2.0 * static_cast<double>(EIGEN_PI) / num_angles,
                                        Eigen::Vector3d::UnitZ())
                          .toRotationMatrix();
      const PlaneGates gates{first_gate * frame_.size, 3.0 * frame_.tolerance, 14, coarse_samples};
      candidates[static_cast<std::size_t>(i)] = align(plane_ * turn * ground_frame_.inverse(), gates, coarse_samples);
    });
    candidates = different(std::move(candidates), num_candidates);
    parallel_for(static_cast<std::int64_t>(candidates.size()), 1, num_threads_, [&](std::int64_t i) {
      Candidate& candidate = candidates[static_cast<std::size_t>(i)];
      const PlaneGates gates{4.0 * frame_.tolerance, 2.0 * frame_.tolerance, 30, frame_.points.rows()};
      candidate = climb(align(candidate.alignment.target_from_source, gates, frame_.points.rows()));
    });
    const std::size_t num_refined = candidates.size();
    return different(std::move(candidates), num_refined);
  }

  // The surfaces decide in the end, closer than the score asks for.
  IcpResult settle(const Candidate& candidate) const {
    const PlaneGates gates{2.0 * frame_.tolerance, frame_.tolerance, 30, frame_.points.rows()};
    const IcpResult settled = align_on_plane(target_, source_, candidate.alignment.target_from_source, normal_, gates);
    return settled.status != AlignStatus::too_few_pairs ? settled : candidate.alignment;
  }

 private:
  static AlignOptions single_threaded(AlignOptions options) {
    options.method = Metric::symmetric;
    options.num_threads = 1;
    return options;
  }
  static PointsRef rows_of(const std::vector<Eigen::Vector3f>& vectors) {
    return Eigen::Map<const Points>(vectors.front().data(), static_cast<Eigen::Index>(vectors.size()), 3);
  }

  Candidate align(const Pose& guess, const PlaneGates& gates, Eigen::Index num_samples) const {
    Candidate candidate;
    candidate.alignment = align_on_plane(target_, source_, guess, normal_, gates);
    if (candidate.alignment.status != AlignStatus::too_few_pairs) score(candidate, num_samples);
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
    score(best, climb_samples);
    const Eigen::Vector3d axes[] = {normal_, plane_.linear().col(0), plane_.linear().col(1)};
    for (double step = frame_.tolerance; step > 0.1 * frame_.tolerance; step *= 0.5) {
      bool is_better = true;
      for (int round = 0; round < 8 && is_better; ++round) {
        is_better = false;
        for (int direction = 0; direction < 6; ++direction) {
          const Eigen::Vector3d& axis = axes[direction / 2];
          const double length = direction % 2 == 0 ? step : -step;
          Candidate next = best;
          Pose& pose = next.alignment.target_from_source;
          if (direction < 2) {
            const Eigen::Vector3d center = pose * frame_.center();
            pose = Eigen::Translation3d(center) * Eigen::AngleAxisd(3.0 * length / frame_.size, axis) *
                   Eigen::Translation3d(-center) * pose;
          } else {
            pose.pretranslate(length * axis);
          }
          score(next, climb_samples);
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
        return angle_between(pose, other_pose) < same_turn &&
               (pose * middle - other_pose * middle).norm() < same_shift * frame_.size;
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
  IcpSource source_;
  IcpTarget target_;
  Pose plane_, ground_frame_;  // world and camera, from a frame in the plane below the object's middle
  Eigen::Vector3d normal_;
};

}  // namespace

std::optional<PlaneFit> fit_on_plane(const PointModel& model, const std::vector<ObjectView>& views,
                                     const ObjectView& frame, const Camera& camera, const AlignOptions& options) {
  if (model.size() == 0 || views.empty()) return std::nullopt;
  const TurntableSearch search(model, views, frame, camera, options);
  const std::vector<Candidate> candidates = search.run();
  const Candidate& best = candidates.front();
  if (!(best.score > least_score) || !(best.overlap > least_view_overlap)) return std::nullopt;
  PlaneFit fit;
  fit.score = best.score;
  fit.overlap = best.overlap;
  fit.consistency = best.agree / (best.agree + best.through);
  const bool has_rival = candidates.size() > 1 && candidates[1].score > 0.0;  // not contradicted
  if (has_rival || fit.consistency < least_consistency) return std::nullopt;
  fit.alignment = search.settle(best);
  fit.alignment.target_from_source = orthonormal(fit.alignment.target_from_source);
  return fit;
}

}  // namespace nacre
