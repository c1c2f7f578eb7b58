#include "tracking/tracking.hpp"

#include <algorithm>
#include <utility>

#include "camera/limits.hpp"
#include "camera/view_distance.hpp"
#include "nacre/global_registration.hpp"
#include "tracking/limits.hpp"
#include "tracking/relocalisation.hpp"
#include "tracking/search_starts.hpp"
#include "tracking/turntable_search.hpp"

namespace nacre {
namespace {

void keep_better(const TrackingResult& found, TrackingResult& best) {
  if (found.rank() >= best.rank()) best = found;
}

// What a frame leaves open is held by where the camera was going: another guess would make it stand still, or leap.
TrackingResult with_open_directions_held(TrackingResult found, const Pose& guess, const TrackingPrior& prior) {
  const bool is_prediction = prior.is_predicted && &guess == &prior.guesses.front();
  if (found.decision == Decision::undetermined && !is_prediction) {
    found.decision = Decision::rejected;
    found.reason += ", and where the camera was going does not tell them";
  }
  return found;
}

// A lost camera is looked for where the frames lead, before where it was last.
void guess_where_followed(TrackingPrior& prior) {
  if (!prior.followed || std::exchange(prior.guesses_followed, true)) return;
  prior.guesses.insert(prior.guesses.begin(), prior.followed->world_from_camera);
  prior.is_predicted = prior.followed->is_determined;
}

// With a narrow gate first, which is safest. From the best of the guesses it is asked whether something moves. Of a
// camera that is lost already, only the most trusted guess is tried with a wide one.
void try_guesses(const FrameRegistration& registration, TrackingPrior& prior, TrackingResult& best) {
  using Gate = FrameRegistration::Gate;
  for (const Gate gate : {Gate::narrow, Gate::wide}) {
    if (gate == Gate::wide && !(best.is_lost() && registration.has_automatic_gate())) return;
    std::optional<TrackingResult> nearest;
    const Pose* start = nullptr;
    for (const Pose& guess : prior.guesses) {
      const TrackingResult found =
          with_open_directions_held(registration.whole_from(guess, guess, gate, prior.expectation), guess, prior);
      prior.tried.push_back(found);
      if (nearest && found.rank() < nearest->rank()) continue;
      nearest = found;
      start = &guess;
      if (found.is_clear_cut || (gate == Gate::wide && prior.was_lost)) break;
    }
    if (!nearest) return;
    if (gate == Gate::narrow) {
      nearest =
          with_open_directions_held(registration.without_moving(*nearest, *start, prior.expectation), *start, prior);
      prior.tried.push_back(*nearest);
      nearest =
          with_open_directions_held(registration.without_pulling(*nearest, *start, prior.expectation), *start, prior);
    }
    keep_better(*nearest, best);
    if (nearest->is_clear_cut) return;
  }
}

// Of places where a frame fits the model as well, the only one where it looks like it.
std::optional<TrackingResult> only_alike(const std::vector<TrackingResult>& places) {
  std::vector<Likeness> looks;
  for (const TrackingResult& place : places) looks.push_back(place.consistency.likeness);
  const auto found = only_alike(looks);
  return found ? std::optional(places[*found]) : std::nullopt;
}

// An object that turned on its plane. The search has compared all places.
std::optional<TrackingResult> turned_on_plane(const FrameRegistration& registration, const TrackingTarget& target,
                                              const CurrentFrame& now, const RelocalisationPlaces& places,
                                              const TrackingOptions& options) {
  if (places.views == nullptr || places.views->empty()) return std::nullopt;
  const std::optional<ObjectView> view = places.view_of_frame();
  if (!view) return std::nullopt;
  const std::vector<PlaneFit> fits =
      fits_on_plane(target.model, *places.views, *view, now.camera, options.registration, registration.has_colors());
  std::vector<TrackingResult> found;
  for (const PlaneFit& fit : fits) {
    TrackingResult result;
    result.alignment = fit.alignment;
    result.consistency.of_target = fit.consistency;
    result.consistency.likeness = registration.likeness_at(fit.alignment.target_from_source);
    result.expectation = Expectation::only_place;
    result.test(options, target.usual);
    result.is_to_whole_model = result.is_on_plane = true;
    found.push_back(std::move(result));
  }
  return only_alike(found);
}

// The place that fits best of those that were found with less noise.
std::optional<Pose> best_with_less_noise(const TrackingPrior& prior, double noise_factor) {
  const TrackingResult* best = nullptr;
  for (const TrackingResult& place : prior.tried) {
    if (place.noise_factor < noise_factor && (best == nullptr || place.score > best->score)) best = &place;
  }
  if (best == nullptr) return std::nullopt;
  return best->alignment.target_from_source;
}

// Beside the last pose, as where the camera turned fast. Directions that stay open could be those of any candidate.
// More noise makes wider gates, which may lead away from a place that narrower ones have found.
void try_beside(const FrameRegistration& registration, const CurrentFrame& now, const DepthView& last_view,
                TrackingPrior& prior, const TrackingOptions& options, TrackingResult& best) {
  const Pose& last = prior.guesses.back();
  if (!prior.beside) {
    const PointsInView& view = registration.in_view(last);
    prior.beside = most_promising(AlignCloud(view.points, view.normals), registration.source(),
                                  starts_beside(last, view.points), options.registration);
    const auto start = start_by_keypoints(now.view, last_view, now.camera, prior.depth, options.registration.seed,
                                          options.num_threads);
    if (start) prior.beside->insert(prior.beside->begin(), *start);
  }
  std::vector<Pose> starts = *prior.beside;
  if (const auto found = best_with_less_noise(prior, now.noise_factor)) starts.push_back(*found);
  for (const Pose& start : starts) {
    const TrackingResult found = registration.from(start, last, FrameRegistration::Gate::narrow, Expectation::beside);
    if (found.decision == Decision::accepted) keep_better(found, best);
    prior.tried.push_back(found);
  }
}

// Where directions are open the camera was taken to have gone on as before. Where nothing fits it may be elsewhere
// along what the places leave open: at the only one of them that fits.
std::optional<TrackingResult> only_along_open(const FrameRegistration& registration, TrackingPrior& prior,
                                              const TrackingOptions& options) {
  const Pose& last = prior.guesses.back();
  const auto is_apart = [&](const Pose& a, const Pose& b) {
    return view_distance(a, b, prior.depth) > tracking_limits::least_new_view;
  };
  std::vector<IcpResult> open;
  for (const TrackingResult& place : prior.tried) {
    const bool is_new = std::all_of(open.begin(), open.end(), [&](const IcpResult& other) {
      return is_apart(other.target_from_source, place.alignment.target_from_source);
    });
    if (place.alignment.weak_directions.cols() > 0 && is_new) open.push_back(place.alignment);
  }
  if (open.empty()) return std::nullopt;
  const double gate = registration.narrow_gate(last);
  std::vector<Pose> starts;
  for (const IcpResult& place : open) {
    for (const Pose& start : starts_along_open(place, last, gate, prior.depth)) starts.push_back(start);
  }
  const PointsInView& view = registration.in_view(last);
  TrackingResult best;
  for (const Pose& start : most_promising(AlignCloud(view.points, view.normals), registration.source(), starts,
                                          options.registration, prior.depth)) {
    const TrackingResult found = registration.from(start, FrameRegistration::Gate::narrow, Expectation::beside);
    keep_better(found, best);
    prior.tried.push_back(found);
  }
  const bool has_rival = std::any_of(prior.tried.begin(), prior.tried.end(), [&](const TrackingResult& other) {
    return (other.decision == Decision::accepted || best.decision != Decision::accepted) &&
           other.score > GlobalAlignOptions().max_rivalry * best.score &&
           is_apart(other.alignment.target_from_source, best.alignment.target_from_source);
  });
  return best.is_lost() || has_rival ? std::nullopt : std::optional(best);
}

// A place that the model alone says too little of, but to which the frame before leads, too.
std::optional<TrackingResult> confirmed_by_odometry(const FrameRegistration& registration,
                                                    const FrameOdometry& odometry, TrackingPrior& prior,
                                                    const TrackingOptions& options,
                                                    const std::optional<Consistency>& usual) {
  if (!prior.has_moved || !prior.followed || !prior.followed->is_determined) return std::nullopt;
  const Pose& followed = prior.followed->world_from_camera;
  if (!prior.guesses_followed) {
    prior.tried.push_back(registration.from(followed, FrameRegistration::Gate::narrow, prior.expectation));
  }
  TrackingResult best;
  for (TrackingResult place : prior.tried) {
    if (!odometry.allows(place.alignment.target_from_source, tracking_limits::least_new_view)) continue;
    place.expectation = Expectation::confirmed;
    place.test(options, usual);
    if (place.decision == Decision::accepted) keep_better(place, best);
  }
  return best.is_lost() ? std::nullopt : std::optional(best);
}

// A place that a search has led to. Beside the last pose it is no surprise, however it was found.
TrackingResult found_at(const Pose& place, const FrameRegistration& registration, const TrackingPrior& prior) {
  using Gate = FrameRegistration::Gate;
  TrackingResult found = prior.elsewhere.beside
                             ? registration.from(place, prior.guesses.back(), Gate::narrow, Expectation::beside)
                             : registration.from(place, Gate::narrow, Expectation::unexpected);
  return with_open_directions_held(std::move(found), place, prior);
}

// From every place where a camera has been, and around it.
TrackingResult around_key_poses(const FrameRegistration& registration, const PointModel& model,
                                const TrackingPrior& prior, const TrackingOptions& options) {
  std::vector<Pose> starts;
  for (const Pose& key_pose : prior.elsewhere.key_poses()) {
    const PointsInView& view = registration.in_view(key_pose);
    for (const Pose& start : starts_around(key_pose, view.points, options.registration.max_angle)) {
      starts.push_back(start);
    }
  }
  TrackingResult best;
  for (const Pose& candidate : most_promising(AlignCloud(as_rows(model.points), as_rows(model.normals)),
                                              registration.source(), starts, options.registration)) {
    keep_better(found_at(candidate, registration, prior), best);
  }
  return best;
}

}  // namespace

std::optional<TrackingResult> only_near(const TrackingPrior& prior, const TrackingOptions& options,
                                        const std::optional<Consistency>& usual) {
  if (!options.relocalise || !prior.has_moved || !prior.elsewhere.beside) return std::nullopt;
  // As far from the last pose as a guess that turned about what it saw, and again as far.
  const double farthest = 2.0 * camera_limits::new_direction / camera_limits::view_shift;
  std::vector<TrackingResult> near, places = prior.tried;
  for (TrackingResult& place : places) {
    place.expectation = Expectation::only_near;
    place.test(options, usual);
    const bool is_near =
        view_distance(prior.guesses.back(), place.alignment.target_from_source, prior.depth) <= farthest;
    if (is_near) near.push_back(place);
  }
  const auto is_lower = [](const TrackingResult& a, const TrackingResult& b) { return a.score < b.score; };
  const auto best = std::max_element(near.begin(), near.end(), is_lower);
  if (best == near.end() || best->decision != Decision::accepted) return std::nullopt;
  if (!PlaceOdds::is_for(best->relocalisation_score)) return std::nullopt;
  const bool has_rival = std::any_of(places.begin(), places.end(), [&](const TrackingResult& other) {
    return other.score > GlobalAlignOptions().max_rivalry * best->score &&
           camera_limits::view_turn *
                   view_distance(other.alignment.target_from_source, best->alignment.target_from_source, prior.depth) >
               tracking_limits::beside_turn;
  });
  return has_rival ? std::nullopt : std::optional(*best);
}

TrackingResult track(const CurrentFrame& now, const TrackingTarget& target, TrackingPrior& prior,
                     FrameOdometry& odometry, PlaceHypothesis& hypothesis, const TrackingOptions& options) {
  FrameRegistration registration(now, target, options);
  const IcpSource& source = registration.source();
  const auto follow = [&] {
    odometry.follow(source, now.cells, now.view, now.camera, camera_limits::surface_spacings * target.spacing,
                    target.usual, options);
    prior.followed = odometry.place();
  };
  odometry.look_at(source);
  prior.depth = registration.depth();
  if (prior.was_lost) {
    registration.ask_few_points_first();
    follow();
    guess_where_followed(prior);
  }
  const std::optional<Pose> followed = hypothesis.predict(odometry.motion());
  TrackingResult best;
  best.alignment.target_from_source = prior.guesses.front();
  try_guesses(registration, prior, best);
  if (best.is_lost() && target.oldest_frame > 0) {
    registration.include_older_points();
    try_guesses(registration, prior, best);
    best.is_to_whole_model = true;
  }
  const bool looks_beside =
      prior.elsewhere.beside && (best.decision != Decision::undetermined || prior.elsewhere.beside_if_open);
  if (looks_beside && registration.may_be_beside(best, prior.guesses.front())) {
    try_beside(registration, now, target.last_view, prior, options, best);
    if (best.is_lost()) {
      if (const auto only = only_near(prior, options, target.usual)) return *only;
    }
    if (best.decision != Decision::accepted) {
      const auto only = only_along_open(registration, prior, options);
      const bool is_better = only && (best.is_lost() || (only->decision == Decision::accepted &&
                                                         best.score < tracking_limits::clearly_better * only->score));
      if (is_better && registration.explains_change(only->alignment.target_from_source)) best = *only;
    }
  }
  if (best.decision == Decision::accepted) return best;
  follow();
  if (!best.is_lost()) return best;
  if (const auto confirmed = confirmed_by_odometry(registration, odometry, prior, options, target.usual)) {
    return *confirmed;
  }

  registration.include_older_points();
  const RelocalisationPlaces& places = prior.elsewhere;
  const auto turned = turned_on_plane(registration, target, now, places, options);
  if (turned && !turned->is_lost()) return *turned;
  // Where nobody saw the camera go, it may have been carried away: to a place that speaks for itself.
  const auto keep_if_possible = [&](TrackingResult found) {
    const bool is_sure = found.decision == Decision::accepted && !odometry.is_seen();
    if (is_sure || odometry.allows(found.alignment.target_from_source)) keep_better(found, best);
  };
  if (followed) {
    keep_if_possible(registration.from(*followed, FrameRegistration::Gate::narrow, Expectation::unexpected));
  }
  const bool goes_on = followed && hypothesis.is_confirmed_by(best);
  if (!goes_on && places.by_keypoints) {
    if (const auto place = places.by_keypoints()) keep_if_possible(found_at(*place, registration, prior));
  }
  if (!goes_on && places.key_poses && best.is_lost()) {
    keep_if_possible(around_key_poses(registration, target.model, prior, options));
  }
  if (best.is_lost() && !goes_on && places.everywhere) {
    const std::vector<Pose> fits = fits_anywhere(target.model, source, options.registration, registration.has_colors());
    std::vector<TrackingResult> found;
    for (const Pose& place : fits) found.push_back(found_at(place, registration, prior));
    if (const auto only = only_alike(found)) keep_if_possible(*only);
  }
  best.is_to_whole_model = true;
  if (best.is_lost() && options.relocalise && options.verify && hypothesis.add(best, prior.depth)) {
    best.decision = Decision::accepted;
    best.reason.clear();
  }
  return best;
}

}  // namespace nacre
