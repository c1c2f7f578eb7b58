#include "tracking/relocalisation_filter.hpp"

#include <algorithm>

#include "camera/view_distance.hpp"
#include "tracking/limits.hpp"

namespace nacre {

std::optional<Pose> PlaceHypothesis::predict(const std::optional<Pose>& motion) {
  if (!place_) return std::nullopt;
  if (!motion) {
    forget();
    return std::nullopt;
  }
  place_->pose = place_->pose * *motion;
  place_->followed = place_->followed * *motion;
  return place_->pose;
}

bool PlaceHypothesis::is_near(const TrackingResult& result) const {
  return place_ &&
         view_distance(place_->followed, result.alignment.target_from_source, depth_) < tracking_limits::largest_gap;
}

bool PlaceHypothesis::is_confirmed_by(const TrackingResult& result) const {
  return is_near(result) && PlaceOdds::is_for(result.relocalisation_score) &&
         result.alignment.weak_directions.cols() == 0;
}

bool PlaceHypothesis::add(const TrackingResult& best, double depth) {
  depth_ = depth;
  const Pose& pose = best.alignment.target_from_source;
  const bool is_determined = best.alignment.weak_directions.cols() == 0;
  if (!is_near(best) || !is_determined) {
    forget();
    if (!is_determined || !PlaceOdds::is_for(best.relocalisation_score)) return false;
    place_ = Place{pose, pose, {}, {}};
  }
  place_->pose = pose;
  double distance = 1.0;
  for (const Pose& view : place_->views) distance = std::min(distance, view_distance(view, pose, depth_));
  if (distance < tracking_limits::least_new_view) return false;
  place_->views.push_back(pose);
  place_->odds.add(best.relocalisation_score, distance);
  if (!place_->odds.is_against()) return place_->odds.is_enough(best.relocalisation_score, best.expectation);
  forget();
  return false;
}

}  // namespace nacre
