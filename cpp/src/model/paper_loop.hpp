// The loop of Blackburn, Kubacki and Stratton 2010: what the preset "paper" does with a frame, in the paper's order.
#pragma once

#include "nacre/model_options.hpp"
#include "tracking/frame_registration.hpp"

namespace nacre {

struct PaperLoop {
  const ModelOptions& options;
  std::int32_t frame_index;  // from which the random choices follow

  // Normals of the model from the k nearest points; NaN where fewer lie within the radius, as at the model's rims.
  Points model_normals(const PointModel& model) const;

  // Iterative closest point of the frame to the whole model. A pose, right or not, wherever six pairs match.
  TrackingResult register_frame(const CurrentFrame& now, const TrackingTarget& target, const Pose& guess) const;

  // The points that WLOP moves: a part of the model, and new points in proportion to it; of the first frame, a part.
  PointModel samples(const PointModel& model, const PointModel& fresh) const;
};

// `count` points of a cloud, chosen by random numbers that depend on the seed and the point's number only.
PointModel choose(const PointModel& cloud, double count, std::uint64_t seed);
void append(PointModel& model, const PointModel& more);

}  // namespace nacre
