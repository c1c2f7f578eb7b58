#include "tracking/frame_registration.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/statistics.hpp"
#include "camera/limits.hpp"
#include "camera/point_spacing.hpp"
#include "camera/view_distance.hpp"
#include "outlines/limits.hpp"
#include "tracking/likeness.hpp"
#include "tracking/limits.hpp"

namespace nacre {

FrameRegistration::FrameRegistration(const CurrentFrame& now, const TrackingTarget& target,
                                     const TrackingOptions& options)
    : FrameRegistration(now, target, options, sample_frame(now.frame, now.observer, options)) {}

FrameRegistration::FrameRegistration(const CurrentFrame& now, const TrackingTarget& target,
                                     const TrackingOptions& options, const FrameSamples& samples)
    : now_(now),
      target_(target),
      options_(options),
      source_(AlignCloud(samples.points, samples.normals, samples.sigma), options.registration),
      noise_(samples.noise),
      depth_(median_depth(samples.points)) {}

TrackingResult FrameRegistration::from(const Pose& guess, Gate gate, Expectation expectation) const {
  return from(guess, guess, gate, expectation);
}

TrackingResult FrameRegistration::from(const Pose& start, const Pose& guess, Gate gate, Expectation expectation) const {
  TrackingResult whole = whole_from(start, guess, gate, expectation);
  const bool is_near = expectation == Expectation::expected || expectation == Expectation::near_lost;
  return is_near && gate == Gate::narrow ? without_moving(whole, start, expectation) : whole;
}

TrackingResult FrameRegistration::whole_from(const Pose& start, const Pose& guess, Gate gate,
                                             Expectation expectation) const {
  return registered({source_, in_view(start), 0.0, in_view(start)}, start, guess, gate, expectation);
}

TrackingResult FrameRegistration::registered(const Surfaces& surfaces, const Pose& start, const Pose& guess, Gate gate,
                                             Expectation expectation) const {
  const Pairing pairing = paired(surfaces, gate);
  if (asks_few_first_) {
    AlignOptions coarse = pairing.options;
    coarse.max_iterations = std::min(coarse.max_iterations, tracking_limits::most_coarse_steps);
    IcpResult few = align_to(pairing.target, pairing.source.few(), start, coarse);
    const TrackingResult of_few = test(std::move(few), surfaces, guess, expectation);
    if (of_few.is_hopeless) return of_few;
  }
  IcpResult by_shape = align_to(pairing.target, pairing.source, start, pairing.options);
  hold_feigned_directions(pairing, by_shape);
  if (by_shape.weak_directions.cols() > 0) {
    hold_open_directions(pairing, guess, by_shape);
    hold_feigned_directions(pairing, by_shape);
    by_shape = with_open_decided(pairing, colors_of(surfaces.view, pairing, pairing.source), std::move(by_shape));
    return test(std::move(by_shape), surfaces, guess, expectation);
  }
  TrackingResult result = test(std::move(by_shape), surfaces, guess, expectation);
  // What moves before the scene contradicts it wherever the camera is, unless it is left out.
  const bool is_still = surfaces.moving > 0.0 || !target_.still_scene.is_passed();
  if (expectation == Expectation::expected && gate == Gate::narrow && is_still) {
    result = best_along_weakest(std::move(result), surfaces, pairing, guess, expectation);
  }
  return result.is_hopeless ? result : without_doubt(std::move(result), surfaces, pairing, start, guess, expectation);
}

FrameRegistration::Pairing FrameRegistration::paired(const Surfaces& surfaces, Gate gate) const {
  AlignOptions options = options_.registration;
  options.max_points = 0;  // the view is thin enough
  IcpTarget target(AlignCloud(surfaces.view.points, surfaces.view.normals), options);
  IcpSource source = gated(surfaces.samples, surfaces.view, target);
  if (!(options.final_distance > 0.0)) {
    options.final_distance = source.reach.size() > 0 ? static_cast<double>(median_of(source.reach)) : 0.0;
  }
  if (has_automatic_gate() && gate == Gate::narrow) {
    options.max_distance = tracking_limits::narrow_gate * options.final_distance;
  }
  return {std::move(target), std::move(source), std::move(options)};
}

// By how much what is ahead moves between two poses [m].
double FrameRegistration::shift_ahead(const Pose& a, const Pose& b) const {
  const Eigen::Vector3d ahead(0.0, 0.0, depth_);
  return (a * ahead - b * ahead).norm();
}

// No farther apart than outlines that match. Errors that images share hold what is ahead where it is in the image.
bool FrameRegistration::are_close(const Pose& a, const Pose& b) const {
  return shift_ahead(a, b) < outlines_limits::last_gate * now_.camera.footprint(depth_);
}

TrackingResult FrameRegistration::test(IcpResult alignment, const Surfaces& surfaces, const Pose& guess,
                                       Expectation expectation) const {
  TrackingResult result;
  result.noise_factor = now_.noise_factor;
  result.moving = surfaces.moving;
  result.alignment = std::move(alignment);
  const Pose& pose = result.alignment.target_from_source;
  result.consistency = consistency(surfaces, pose);
  const double nearby = camera_limits::new_direction / camera_limits::view_turn;
  const double distance = view_distance(guess, pose, depth_);
  const bool has_jumped = expectation == Expectation::expected && target_.usual && distance > nearby;
  if (has_jumped) expectation = Expectation::beside;
  // A place beside a guess is as far from it as from a start again.
  const double farthest = expectation == Expectation::beside ? 2.0 * nearby : nearby;
  result.expectation = distance > farthest ? Expectation::unexpected : expectation;
  result.test(options_, target_.usual);
  return result;
}

const PointsInView& FrameRegistration::in_view(const Pose& world_from_camera) const {
  if (!newest_view_ || newest_view_->first.matrix() != world_from_camera.matrix()) {
    newest_view_.emplace(world_from_camera,
                         points_in_view(target_.model, target_.blocks, now_.camera, world_from_camera,
                                        target_.oldest_frame, options_.num_threads));
  }
  return newest_view_->second;
}

void FrameRegistration::include_older_points() {
  target_.oldest_frame = 0;
  newest_view_.reset();
  decided_.clear();
}

// A match may be about as far along the surface as the model's points are apart, and as far across it as noise and the
// shape between the points take it.
IcpSource FrameRegistration::gated(IcpSource source, const PointsInView& view, const IcpTarget& target) const {
  const auto count = static_cast<Eigen::Index>(source.cloud.rows.size());
  source.noise.resize(count);
  source.reach.resize(count);
  source.largest_residual.resize(count);
  const double set = options_.registration.final_distance;
  // Noise or spacing that is large against one of the surfaces would match anything.
  const Points& points = source.cloud.points;
  const auto extent = static_cast<double>((points.colwise().maxCoeff() - points.colwise().minCoeff()).norm());
  const double largest = tracking_limits::largest_reach * std::min(target.diameter(), extent);
  for (Eigen::Index i = 0; i < count; ++i) {
    const float sigma = noise_[source.cloud.rows[static_cast<std::size_t>(i)]];
    source.noise[i] = sigma;
    const double apart = spacing_at(points(i, 2), sigma, now_.camera, target_.spacing);
    const double along = tracking_limits::reach_spacings * view.thinning * apart;
    const double across = largest_offset(apart, sigma);
    source.reach[i] = static_cast<float>(set > 0.0 ? set : std::min(along, largest));
    source.largest_residual[i] = static_cast<float>(set > 0.0 ? set : std::min(across, largest));
  }
  return source;
}

Likeness FrameRegistration::likeness_at(const Pose& world_from_camera) const {
  return likeness_in(in_view(world_from_camera), world_from_camera);
}

Likeness FrameRegistration::likeness_in(const PointsInView& model, const Pose& world_from_camera) const {
  const double pixels = static_cast<double>(now_.frame.valid.size()) / tracking_limits::likeness_squares;
  return likeness(model, now_.view, world_from_camera, now_.camera, {camera_limits::surface_spacings * target_.spacing},
                  static_cast<int>(std::ceil(std::sqrt(pixels))));
}

// 0 where too few of the model's points are seen: then nothing is known.
Consistency FrameRegistration::consistency(const Surfaces& surfaces, const Pose& world_from_camera) const {
  const VisibilityMargin margin = {camera_limits::surface_spacings * target_.spacing};
  const PointsInView& model = surfaces.view;
  const IcpCloud& samples = surfaces.samples.cloud;
  const auto part_or = [](const VisibilityCounts& counts, double otherwise) {
    const double part = counts.consistency(tracking_limits::least_judged);
    return std::isfinite(part) ? part : otherwise;
  };
  const DepthView& last = target_.last_view;
  return {part_or(compare(model.points, model.normals, now_.view, world_from_camera, now_.camera, margin,
                          options_.num_threads),
                  0.0),
          part_or(compare(samples.points, samples.normals, last, world_from_camera.inverse() * last.world_from_camera,
                          now_.camera, margin, options_.num_threads, take_rows<Values>(noise_, samples.rows)),
                  1.0),
          likeness_in(surfaces.whole, world_from_camera)};
}

bool FrameRegistration::may_be_beside(const TrackingResult& found, const Pose& guess) const {
  if (found.is_lost() || found.decision == Decision::undetermined) return true;
  const double distance = view_distance(guess, found.alignment.target_from_source, depth_);
  return !found.is_clear_cut && distance * camera_limits::view_turn > 0.5 * tracking_limits::beside_turn;
}

double FrameRegistration::narrow_gate(const Pose& guess) const {
  return paired({source_, in_view(guess), 0.0, in_view(guess)}, Gate::narrow).options.max_distance;
}

}  // namespace nacre
