// Where the camera is: what the pipeline asks of tracking for each frame.
#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "base/limits.hpp"
#include "base/point_rows.hpp"
#include "base/se3.hpp"
#include "camera/limits.hpp"
#include "camera/view_distance.hpp"
#include "model/limits.hpp"
#include "model/paper_loop.hpp"
#include "model/pipeline.hpp"
#include "model/stopwatch.hpp"
#include "outlines/refinement.hpp"
#include "tracking/limits.hpp"

namespace nacre {

// Where the camera is. A lost one is reported where it was last.
TrackingResult Pipeline::locate(const FrameExtras& extras, FrameReport& report) {
  const Stopwatch watch(report.milliseconds.registration);
  TrackingResult tracking = register_frame(extras, report.region);
  static_cast<TrackingReport&>(report) = tracking.report();
  if (report.status == FrameStatus::lost) {
    report.world_from_camera = history.num_registered() == 0 ? Pose::Identity() : history.registered_pose(0);
  } else {
    hypothesis.forget();
  }
  return tracking;
}

TrackingResult Pipeline::register_frame(const FrameExtras& extras, const RegionReport& region_report) {
  TrackingResult result;
  result.alignment.rmse = std::numeric_limits<double>::quiet_NaN();
  outline.clear();
  if (frame.valid.size() < base_limits::least_points) {
    const std::string count = "only " + std::to_string(frame.valid.size()) + " pixels of the frame are usable";
    result.reason = region_report.reason.empty() ? count : region_report.reason;
    return result;
  }
  if (keeps_key_frames()) outline = find_outline(now, camera, model_limits::most_outline_points, options.num_threads);
  if (cloud.size() == 0 || extras.keep_guess) {
    if (cloud.size() > 0) learn_from_given(*extras.guess);
    result.decision = Decision::accepted;
    result.alignment.target_from_source = extras.guess.value_or(Pose::Identity());
    result.alignment.rmse = 0.0;
    result.alignment.overlap = 1.0;
    result.consistency = {};
    return result;
  }
  if (options.registration.method == Metric::paper) {
    return PaperLoop{options, static_cast<std::int32_t>(history.size())}.register_frame(
        {frame, cells, camera, observer, now, noise_factor}, tracking_target(), guesses(extras).front());
  }
  const Expectation expectation = was_lost() || jumped() ? Expectation::near_lost : Expectation::expected;
  const bool is_predicted = !was_lost() || extras.guess.has_value();
  const bool has_moved = history.num_registered() > 1 || is_trial;
  if (!extras.search) hypothesis.forget();
  result = track_frame(
      {guesses(extras), expectation, is_predicted, has_moved, num_vain > 0, elsewhere(region_report, extras.search)},
      extras.search);
  const bool is_determined = result.decision == Decision::accepted && result.alignment.weak_directions.cols() == 0;
  if (is_determined && !result.is_on_plane) {
    refine_by_outlines(result.alignment, outline, loops.outlines_near(result.alignment.target_from_source),
                       options.num_threads);
  }
  return result;
}

// Until frames have told how noisy the camera is, a frame that is lost may be noisier where it is expected; elsewhere
// it is looked for with the noise that is known. Before one has told, its residuals must show the noise that was
// tried.
TrackingResult Pipeline::track_frame(TrackingPrior prior, bool may_search) {
  const std::int32_t oldest_frame = options.loop_closure && !was_lost() ? loops.oldest_frame() : 0;
  const CurrentFrame current{frame, cells, camera, observer, now, noise_factor};
  const TrackingTarget target = tracking_target(oldest_frame);
  TrackingResult result;
  TrackingOptions nearby = options;
  nearby.relocalise = false;
  if (learns_noise() && !residual_noise.is_known()) {
    const auto is_as_noisy = [&](const TrackingResult& found) {
      return found.noise_factor == known_noise_factor() || residual_noise.has_told() ||
             found.alignment.residual_sigmas >= tracking_limits::least_residual_sigmas;
    };
    const auto is_found = [&] {
      if (result.is_lost()) return false;
      if (noise_factor == known_noise_factor()) return true;
      return is_as_noisy(result) && result.expectation != Expectation::unexpected;
    };
    RelocalisationPlaces elsewhere = std::exchange(prior.elsewhere, {});
    prior.elsewhere.beside = elsewhere.beside;
    prior.elsewhere.beside_if_open = elsewhere.beside_if_open;
    for (const double factor : noise_factors()) {
      if (is_found()) break;
      set_noise_factor(factor);
      result = track(current, target, prior, odometry, hypothesis, nearby);
    }
    prior.elsewhere = std::move(elsewhere);
    if (!is_found()) {
      const auto is_too_quiet = [&](const TrackingResult& place) { return !is_as_noisy(place); };
      prior.tried.erase(std::remove_if(prior.tried.begin(), prior.tried.end(), is_too_quiet), prior.tried.end());
      result = only_near(prior, options, usual_consistency.mean()).value_or(TrackingResult());
      set_noise_factor(result.is_lost() ? known_noise_factor() : result.noise_factor);
    }
  }
  if (result.is_lost()) result = track(current, target, prior, odometry, hypothesis, may_search ? options : nearby);
  open_noise_factor = result.decision == Decision::undetermined ? noise_factor : 1.0;
  if (result.decision == Decision::accepted) learn_from(result);
  return result;
}

// Those that are tried in turn where it is not known: first that of the frame before, if it left directions open and so
// told none.
std::vector<double> Pipeline::noise_factors() const {
  std::vector<double> factors;
  if (open_noise_factor > noise_factor) factors.push_back(open_noise_factor);
  for (double factor = noise_factor; factor <= tracking_limits::largest_noise_factor; factor *= 2.0) {
    factors.push_back(factor);
  }
  return factors;
}

// A frame whose pose is given is registered there as well, until it is known how noisy the camera is, and now and then.
void Pipeline::learn_from_given(const Pose& pose) {
  if (options.registration.method == Metric::paper) return;
  const bool is_due =
      learns_noise() && (!residual_noise.is_known() || history.size() % model_limits::search_interval == 0);
  if (is_due) {
    track_frame({{pose}, Expectation::expected, true, history.num_registered() > 1, was_lost(), {}}, false);
  } else {
    const CurrentFrame current{frame, cells, camera, observer, now, noise_factor};
    odometry.look_at(FrameRegistration(current, tracking_target(), options).source());
  }
}

void Pipeline::learn_from(const TrackingResult& tracking) {
  const bool is_far = tracking.expectation == Expectation::unexpected || tracking.is_on_plane;
  if (!is_far) usual_consistency.add(tracking.consistency);
  if (!learns_noise() || tracking.is_on_plane || (shape && shape->is_bent())) return residual_noise.add(0.0, false);
  residual_noise.add(noise_factor * tracking.alignment.residual_sigmas, tells_noise(tracking));
  set_noise_factor(residual_noise.factor());
}

TrackingTarget Pipeline::tracking_target(std::int32_t oldest_frame) const {
  const bool was_open = num_open > 0;
  return {
      cloud, blocks, spacing, before, still_scene, earlier_pose(), was_open, oldest_frame, usual_consistency.mean()};
}

Pose Pipeline::earlier_pose() const {
  if (history.num_registered() == 0) return Pose::Identity();
  return history.registered_pose(std::min(tracking_limits::telling_frames, history.num_registered() - 1));
}

// Whether the camera has not rested lately: errors that stay where they are in the image show where others saw what it
// sees.
bool Pipeline::tells_noise(const TrackingResult& tracking) const {
  return mean_pixel_motion(cells, earlier_pose().inverse() * tracking.alignment.target_from_source) >=
         tracking_limits::telling_motion;
}

// Whether the camera's last motion was none that goes on: views far apart, in any order.
bool Pipeline::jumped() const {
  if (history.num_registered() < 2) return false;
  return angle_between(history.registered_pose(1), history.registered_pose(0)) > options.registration.max_angle;
}

std::vector<Pose> Pipeline::guesses(const FrameExtras& extras) const {
  if (extras.guess) return {*extras.guess};
  const Pose last = history.registered_pose(0);
  const bool goes_on = options.registration.method == Metric::paper || !jumped();  // the paper's is a turntable
  if (!options.predict_motion || history.num_registered() < 2 || !goes_on) return {last};
  if (was_lost()) {
    const std::optional<Pose> predicted = odometry.predicted();
    return predicted && is_in_view(*predicted, last) ? std::vector{*predicted, last} : std::vector{last};
  }
  // What frames since have left open, noise may have decided in some of them: it is no motion.
  const auto determined = static_cast<std::size_t>(num_open);
  if (history.num_registered() < determined + 2) return {last};
  const Pose motion = history.registered_pose(determined + 1).inverse() * history.registered_pose(determined);
  return {orthonormal(last * motion), last};
}

// Whether the camera would look at something there that was in the newest view.
bool Pipeline::is_in_view(const Pose& world_from_camera, const Pose& last) const {
  const Eigen::Vector3d ahead(0.0, 0.0, median_depth(take_rows<Points>(frame.points, frame.valid)));
  const Eigen::Vector2d pixel = camera.project(last.inverse() * world_from_camera * ahead);
  return pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() < camera.width() && pixel.y() < camera.height();
}

// Some of the newest poses from which the camera looked in different directions.
std::vector<Pose> Pipeline::key_poses() const {
  std::vector<Pose> chosen;
  for (std::size_t age = 0; age < history.num_registered() && chosen.size() < model_limits::most_key_poses; ++age) {
    const Pose pose = history.registered_pose(age);
    const bool is_new = std::all_of(chosen.begin(), chosen.end(), [&](const Pose& other) {
      return angle_between(other, pose) > camera_limits::new_direction;
    });
    if (is_new) chosen.push_back(pose);
  }
  return chosen;
}

// Around some poses, and everywhere: but not at every frame where that has been to no avail.
RelocalisationPlaces Pipeline::elsewhere(const RegionReport& region_report, bool may_search) const {
  RelocalisationPlaces places;
  places.beside = options.relocalise && (!may_search || (num_vain == 0 && !jumped()));
  places.beside_if_open = num_open % model_limits::search_interval == 0;
  if (!options.relocalise || !may_search) return places;
  places.views = &views;
  places.view_of_frame = [&] { return view_of_object(region_report); };
  if (num_vain % model_limits::search_interval == 0) {
    places.by_keypoints = [this] { return loops.place_by_keypoints(now, num_vain / model_limits::search_interval); };
    places.key_poses = [this] { return key_poses(); };
  }
  places.everywhere = places.key_poses && (num_vain < model_limits::patience || num_vain % model_limits::patience == 0);
  return places;
}

// Of the newest frame, where it shows an object that stands on a plane.
std::optional<ObjectView> Pipeline::view_of_object(const RegionReport& report) const {
  if (report.support < 0) return std::nullopt;
  return object_view(frame, region, report.planes[static_cast<std::size_t>(report.support)],
                     sample_frame(frame, observer, options), options.registration.seed);
}

}  // namespace nacre
