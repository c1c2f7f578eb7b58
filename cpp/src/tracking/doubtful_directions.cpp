// Directions of a frame's pose that its shapes leave open, or that noise may feign: colours, outlines and the camera's
// motion tell more.
#include <cmath>
#include <utility>

#include "base/se3.hpp"
#include "camera/limits.hpp"
#include "fusion/limits.hpp"
#include "nacre/global_registration.hpp"
#include "registration/limits.hpp"
#include "registration/open_directions.hpp"
#include "tracking/frame_registration.hpp"
#include "tracking/limits.hpp"
#include "tracking/shared_errors.hpp"

namespace nacre {

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
    held = with_open_decided(pairing, colors, std::move(held));
    if (held.weak_directions.cols() == 0) return held;
  }
  return std::nullopt;
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

// What the shapes leave open, colours or outlines may decide. Several starts lead to one place, from which they lead on
// to one, too.
IcpResult FrameRegistration::with_open_decided(const Pairing& pairing, const std::optional<ColorRegistration>& colors,
                                               IcpResult open) const {
  if (open.weak_directions.cols() == 0) return open;
  const std::int64_t num_points = pairing.source.cloud.points.rows();
  const std::int64_t num_colors = colors ? colors->num_samples() : 0;
  for (const Decided& other : decided_) {
    const bool is_same =
        other.num_points == num_points && other.num_colors == num_colors &&
        other.open.weak_directions.cols() == open.weak_directions.cols() &&
        mean_pixel_motion(now_.cells, other.open.target_from_source.inverse() * open.target_from_source) < 1.0;
    if (is_same) return other.alignment;
  }
  IcpResult alignment = colors ? colors->determine(open) : open;
  if (alignment.weak_directions.cols() == open.weak_directions.cols()) {
    alignment = determine_by_outline(pairing.target, pairing.source, outlines(), alignment, pairing.options);
  }
  decided_.push_back({num_points, num_colors, std::move(open), alignment});
  return alignment;
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

}  // namespace nacre
