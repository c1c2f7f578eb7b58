#include "tracking/frame_registration.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/se3.hpp"
#include "base/statistics.hpp"
#include "camera/limits.hpp"
#include "camera/point_spacing.hpp"
#include "camera/view_distance.hpp"
#include "fusion/limits.hpp"
#include "nacre/global_registration.hpp"
#include "outlines/limits.hpp"
#include "registration/limits.hpp"
#include "registration/open_directions.hpp"
#include "tracking/likeness.hpp"
#include "tracking/limits.hpp"
#include "tracking/shared_errors.hpp"

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
    determine_open_directions(pairing, colors_of(surfaces.view, pairing, pairing.source), by_shape);
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

// Where noise may feign what the shapes tell, outlines or colours may know better; where the camera seems to rest, or
// not to go on as predicted, colours are asked.
TrackingResult FrameRegistration::without_doubt(TrackingResult result, const Surfaces& surfaces, const Pairing& pairing,
                                                const Pose& start, const Pose& guess, Expectation expectation) const {
  const Pose& pose = result.alignment.target_from_source;
  const WeakTest by_noise{pairing.options.weak_threshold, registration_limits::least_signal};
  const bool is_doubtful = result.alignment.signal < by_noise.least_signal;
  const bool is_unclear = is_doubtful && !result.is_clear_cut;
  const bool is_surprise = result.expectation == Expectation::expected && !are_close(pose, guess);
  const bool may_slide = is_surprise || (are_close(pose, target_.last_view.world_from_camera) &&
                                         result.alignment.signal < registration_limits::signal_at_rest);
  WeakTest doubt = by_noise;
  std::optional<ColorRegistration> colors;
  if (may_slide || is_unclear) colors = colors_of(surfaces.view, pairing, pairing.source.few(1));
  if (colors && may_slide) doubt.least_signal = registration_limits::signal_at_rest;
  if (colors && is_surprise) doubt.told_otherwise = colors->information(result.alignment);
  if (colors && !is_unclear && !contradict(*colors, pairing, pose, doubt)) {
    colors.reset();
    doubt = by_noise;
  }
  if (!colors && !is_doubtful) return result;
  std::optional<IcpResult> other_alignment = without_doubtful(pairing, colors, start, pose, doubt);
  if (!other_alignment) return result;
  const TrackingResult other = test(std::move(*other_alignment), surfaces, guess, expectation);
  if (colors && may_slide) {
    // Where colours agree with the shapes, those are more exact; where shapes fit in both places, colours decide.
    const bool is_rival = other.score > GlobalAlignOptions().max_rivalry * result.score;
    return is_rival && !are_close(pose, other.alignment.target_from_source) ? other : result;
  }
  return result.score < tracking_limits::clearly_better * other.score ? other : result;
}

// Where few matches tell of a direction, a registration may come to rest beside the right place, at the next door frame
// of a corridor: the rest fits there, too, and what does not counts as new. Then frame and model contradict each other
// more than usual, and other places along that direction are tried.
TrackingResult FrameRegistration::best_along_weakest(TrackingResult found, const Surfaces& surfaces,
                                                     const Pairing& pairing, const Pose& guess,
                                                     Expectation expectation) const {
  for (int round = 0; round < tracking_limits::most_slides; ++round) {
    const bool contradicts = !target_.usual || GlobalAlignOptions().max_rivalry * found.consistency.contradiction() >=
                                                   target_.usual->contradiction();
    const bool may_slide = found.alignment.weakest_part < 1.0 - tracking_limits::clearly_better;
    if (found.is_lost() || !contradicts || !may_slide) break;
    const IcpSource few = pairing.source.few();
    const TrackingResult before = found;
    const Pose& pose = before.alignment.target_from_source;
    for (const double gates : {-2.0, -1.0, 1.0, 2.0}) {
      const Vector6 slide = gates * pairing.options.max_distance * before.alignment.weakest;
      const Pose start = motion_about(before.alignment.center, slide) * pose;
      IcpResult by_few = align_to(pairing.target, few, start, pairing.options);
      if (are_close(by_few.target_from_source, pose)) continue;
      const TrackingResult of_few = test(std::move(by_few), surfaces, guess, expectation);
      if (of_few.score < GlobalAlignOptions().max_rivalry * before.score) continue;
      IcpResult alignment = align_to(pairing.target, pairing.source, start, pairing.options);
      if (alignment.weak_directions.cols() > 0) continue;
      const TrackingResult other = test(std::move(alignment), surfaces, guess, expectation);
      const bool is_better = before.score < tracking_limits::clearly_better * other.score && found.score < other.score;
      if (!other.is_lost() && is_better) found = other;
    }
    if (!(found.score > before.score)) break;
  }
  return found;
}

// Whether they would move the camera by a pixel or more at once.
bool FrameRegistration::contradict(const ColorRegistration& colors, const Pairing& pairing, const Pose& pose,
                                   const WeakTest& doubt) const {
  const IcpResult held = align_held(pairing.target, pairing.source.few(), pose, pairing.options, doubt);
  return shift_ahead(pose, colors.one_step(held)) >= now_.camera.footprint(depth_);
}

std::optional<ColorRegistration> FrameRegistration::colors_of(const PointsInView& view, const Pairing& pairing,
                                                              IcpSource samples) const {
  if (view.brightness.size() == 0 || !now_.observer.has_colors()) return std::nullopt;
  return ColorRegistration(pairing.target, std::move(samples), BrightCloud(view.points, view.brightness),
                           bright_cloud(now_.frame, now_.observer), pairing.options);
}

// Noise may feign what the shapes tell: outlines or colours may know better. They are asked where the camera is
// expected, and where the shapes lead.
std::optional<IcpResult> FrameRegistration::without_doubtful(const Pairing& pairing,
                                                             const std::optional<ColorRegistration>& colors,
                                                             const Pose& start, const Pose& by_shape,
                                                             const WeakTest& doubt) const {
  const IcpSource few = pairing.source.few();
  for (const Pose& pose : {start, by_shape}) {
    IcpResult held = align_held(pairing.target, few, pose, pairing.options, doubt);
    if (held.weak_directions.cols() == 0) continue;
    determine_open_directions(pairing, colors, held);
    if (held.weak_directions.cols() == 0) return held;
  }
  return std::nullopt;
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

// What the shapes leave open is the camera's to keep, not the scene's: one that turns on the spot does not go about
// what it sees. Where more is open there, the shapes told more than it seemed.
void FrameRegistration::hold_open_directions(const Pairing& pairing, const Pose& guess, IcpResult& result) const {
  const double lever = camera_limits::view_shift * depth_ / camera_limits::view_turn;
  const Pose nearest = nearest_to(guess, result, lever);
  IcpResult held = align_held(pairing.target, pairing.source, nearest, pairing.options, result.weak_test);
  const bool is_found = held.status != AlignStatus::too_few_pairs;
  if (is_found && held.weak_directions.cols() <= result.weak_directions.cols()) result = std::move(held);
}

// What noise may feign, as far as it tilts normals, which stand on a few pixels: where the camera may stick to what
// they err by, and where directions were open before.
void FrameRegistration::hold_feigned_directions(const Pairing& pairing, IcpResult& result) const {
  const double support = fusion_limits::least_support * now_.camera.footprint(depth_);
  const bool is_felt = result.weakest_part > std::pow(median_sigma(now_.frame) / support, 2);
  if (is_felt || result.signal >= registration_limits::signal_at_rest) return;
  if (may_stick(now_.cells, target_.earlier.inverse() * result.target_from_source)) {
    hold_feigned(pairing.target, pairing.source, pairing.options, registration_limits::signal_at_rest, result);
  } else if (target_.was_open) {
    hold_feigned(pairing.target, pairing.source, pairing.options, registration_limits::least_signal, result);
  }
}

// What the shapes leave open, colours or outlines may decide.
void FrameRegistration::determine_open_directions(const Pairing& pairing,
                                                  const std::optional<ColorRegistration>& colors,
                                                  IcpResult& result) const {
  const Eigen::Index num_weak = result.weak_directions.cols();
  if (num_weak > 0 && colors) result = colors->determine(result);
  if (num_weak > 0 && result.weak_directions.cols() == num_weak) {
    result = determine_by_outline(pairing.target, pairing.source, outlines(), result, pairing.options);
  }
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

const OutlinePair& FrameRegistration::outlines() const {
  if (!outlines_) {
    const auto outline_of = [&](const DepthView& view, std::size_t most) {
      return find_outline(view, now_.camera, most, options_.num_threads);
    };
    outlines_.emplace(OutlinePair{now_.camera, target_.last_view,
                                  outline_of(target_.last_view, tracking_limits::last_outline_points),
                                  outline_of(now_.view, tracking_limits::outline_points), now_.view.depth,
                                  static_cast<double>(median_sigma(now_.frame))});
  }
  return *outlines_;
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
