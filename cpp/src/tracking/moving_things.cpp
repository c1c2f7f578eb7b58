// What of a frame is registered where something moves before the scene: what stays.
#include <algorithm>
#include <cmath>
#include <utility>

#include "base/limits.hpp"
#include "camera/limits.hpp"
#include "tracking/frame_registration.hpp"
#include "tracking/limits.hpp"

namespace nacre {

// Scores count what hides the scene in the whole as new, and what is left out in the rest as untold, which is as much.
TrackingResult FrameRegistration::without_moving(const TrackingResult& whole, const Pose& guess,
                                                 Expectation expectation) const {
  const auto fit = [](const TrackingResult& result) { return result.score * result.alignment.overlap; };
  const PointsInView& view = in_view(guess);
  TrackingResult best = whole;
  for (const Pose& pose : {guess, whole.alignment.target_from_source}) {
    const auto still = still_at(pose, view);
    if (!still) continue;
    const TrackingResult found = registered({still->samples, view.part(still->points), still->moving, view}, pose,
                                            guess, Gate::narrow, expectation);
    const bool is_better = best.is_lost()
                               ? found.rank() > best.rank()
                               : !found.is_lost() && fit(best) < tracking_limits::clearly_better * fit(found);
    if (is_better && still_at(found.alignment.target_from_source, view)) best = found;
    if (!best.is_lost()) break;
  }
  return best;
}

// Whoever moves by less than he is wide hides and uncovers strips beside him. Where most of what tells the camera's
// motion is on him, he is followed, and all the rest conflicts with the last view: more than from where it was
// expected.
TrackingResult FrameRegistration::without_pulling(const TrackingResult& found, const Pose& guess,
                                                  Expectation expectation) const {
  if (found.is_clear_cut) return found;
  const PointsInView& view = in_view(guess);
  // By how many standard deviations fewer conflicts are counted at one place than at another.
  const auto fewer = [](Eigen::Index at_one, Eigen::Index at_other) {
    return static_cast<double>(at_other - at_one) / std::sqrt(std::max(1.0, static_cast<double>(at_one + at_other)));
  };
  const double least = tracking_limits::fewer_conflicts;
  const Eigen::Index num_found = conflicts_at(found.alignment.target_from_source, view).rows();
  Points conflicts = conflicts_at(guess, view);
  const double at_guess = fewer(conflicts.rows(), num_found);
  if (found.is_lost() ? at_guess < -least : at_guess <= least) return found;
  TrackingResult other;
  for (int round = 0; round < 2; ++round) {
    const Pose& pose = round == 0 ? guess : other.alignment.target_from_source;
    const ConflictZones zones(conflicts, pose.translation());
    const auto still = zones.empty() ? std::nullopt : far_from(zones, pose, view);
    if (!still) return found;
    other = registered({still->samples, view.part(still->points), still->moving, view}, guess, guess, Gate::narrow,
                       expectation);
    conflicts = conflicts_at(other.alignment.target_from_source, view);
  }
  if (other.is_lost() || other.expectation != expectation) return found;
  const double at_other = fewer(conflicts.rows(), num_found);
  const bool is_better = found.is_lost() ? other.is_clear_cut && at_other > -least : at_other > least;
  if (!is_better) return found;
  const Pose& pose = other.alignment.target_from_source;
  other.still = pixels_far_from(ConflictZones(conflicts, pose.translation()), pose);
  return other;
}

// Of what conflicts where the camera was, little may be left.
bool FrameRegistration::explains_change(const Pose& pose) const {
  const auto count_at = [&](const Pose& place) {
    return static_cast<double>(conflicts_at(place, in_view(place)).rows());
  };
  const double left = count_at(pose), before = count_at(target_.last_view.world_from_camera);
  const double deviation = std::sqrt(std::max(1.0, left));
  return left - tracking_limits::unexplained_conflicts * before <
         static_cast<double>(base_limits::noise_sigmas) * deviation;
}

// Of this frame as seen from a pose, and what the camera saw before.
Points FrameRegistration::conflicts_at(const Pose& pose, const PointsInView& view) const {
  DepthView now = now_.view;
  now.world_from_camera = pose;
  const double margin = camera_limits::surface_spacings * target_.spacing;
  const Points in_front = seen_through(now, target_.last_view, now_.camera, margin);
  const Points gone = seen_through(view.points, view.normals, Values(), now, now_.camera, margin);
  Points all(in_front.rows() + gone.rows(), 3);
  all << in_front, gone;
  return all;
}

MaskImage FrameRegistration::pixels_far_from(const ConflictZones& zones, const Pose& pose) const {
  std::vector<std::uint8_t> is_near;
  for (const Cell& cell : now_.cells.cells) {
    is_near.push_back(cell.has_point() && zones.include((pose * cell.point.cast<double>()).cast<float>()));
  }
  return pixels_without(is_near, now_.cells, now_.camera.width(), now_.camera.height());
}

std::optional<FrameRegistration::Still> FrameRegistration::far_from(const ConflictZones& zones, const Pose& pose,
                                                                    const PointsInView& view) const {
  const Points& samples = source_.cloud.points;
  std::vector<std::uint8_t> stays(static_cast<std::size_t>(samples.rows()));
  for (Eigen::Index i = 0; i < samples.rows(); ++i) {
    stays[static_cast<std::size_t>(i)] =
        !zones.include((pose * samples.row(i).transpose().cast<double>()).cast<float>());
  }
  std::vector<std::int32_t> points;
  for (Eigen::Index i = 0; i < view.points.rows(); ++i) {
    if (!zones.include(view.points.row(i).transpose())) points.push_back(static_cast<std::int32_t>(i));
  }
  auto still = still_of(source_.part(stays), std::move(points), view);
  // What is near conflicts of the model is no part of the frame: that may show all of the rest.
  if (still)
    still->moving = 1.0 - static_cast<double>(still->samples.cloud.rows.size()) / static_cast<double>(samples.rows());
  return still;
}

// For each point of the camera's frame, whether a region of its image shows it: an empty one is all of it.
std::vector<std::uint8_t> FrameRegistration::shows(const MaskImage& region, const Points& points) const {
  std::vector<std::uint8_t> found(static_cast<std::size_t>(points.rows()), 1);
  if (region.size() == 0) return found;
  const PointProjection projection(now_.camera, Pose::Identity());
  visit_points_in_view(points, points, 0, points.rows(), projection, [&](auto i, const auto& block, int k) {
    found[static_cast<std::size_t>(i)] = region.data()[block.pixel[k]];
  });
  return found;
}

std::optional<FrameRegistration::Still> FrameRegistration::still_at(const Pose& pose, const PointsInView& view) const {
  const double margin = camera_limits::surface_spacings * target_.spacing;
  const MaskImage still = target_.still_scene.still_region(now_.cells, pose, margin);
  std::vector<std::int32_t> points = still_points(view.points, view.normals, now_.view, pose, now_.camera, margin);
  if (still.size() == 0 && static_cast<Eigen::Index>(points.size()) == view.points.rows()) return std::nullopt;
  return still_of(source_.part(shows(still, source_.cloud.points)), std::move(points), view);
}

// None where too little is left.
std::optional<FrameRegistration::Still> FrameRegistration::still_of(IcpSource samples, std::vector<std::int32_t> points,
                                                                    const PointsInView& view) const {
  if (std::min(samples.cloud.rows.size(), points.size()) < base_limits::least_points) return std::nullopt;
  const auto part = [](std::size_t left, std::size_t all) {
    return static_cast<double>(left) / static_cast<double>(all);
  };
  const double left = part(samples.cloud.rows.size(), source_.cloud.rows.size()) *
                      part(points.size(), static_cast<std::size_t>(view.points.rows()));
  return Still{std::move(samples), std::move(points), 1.0 - left};
}

}  // namespace nacre
