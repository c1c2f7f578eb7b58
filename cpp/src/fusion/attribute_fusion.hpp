// Attributes, fused along with the points: passes of their own, so that frames without attributes cost nothing.
#pragma once

#include <vector>

#include "fusion/block_index.hpp"
#include "fusion/registered_frame.hpp"
#include "nacre/fusion.hpp"

namespace nacre {

// Throws std::invalid_argument unless every attribute has a name of its own, a row per pixel, and as many channels as
// the model's of that name.
void check_attributes(const std::vector<FrameAttribute>& attributes, const Camera& camera, const PointModel& model);

// The attributes of one frame, ready to be averaged around points.
class AttributePlanes {
 public:
  AttributePlanes(const std::vector<FrameAttribute>& attributes, const SurfaceObserver& observer, const Camera& camera,
                  int num_threads);

  // Where an attribute's channels are among the averages.
  struct Part {
    const FrameAttribute* attribute;
    int first;     // of its channels
    int coverage;  // the channel with the part of the window that has values; -1: all of it
  };
  const std::vector<Part>& parts() const { return parts_; }
  int num_planes() const { return num_planes_; }

  // averages[plane * ObservationBlock::capacity + i] for the points i of a block; its weights come with it.
  void observe(ObservationBlock& block, float* averages) const;

 private:
  const SurfaceObserver& observer_;
  std::vector<Part> parts_;
  std::vector<float> values_;
  std::int64_t plane_size_;
  int num_planes_ = 0;
};

// Adds what a frame says about the attributes of some of the model's points. Before the points themselves are updated:
// their confidence is the weight of what is known already.
void fuse_attributes(PointModel& model, const std::vector<PointRange>& ranges, const RegisteredFrame& now,
                     const AttributePlanes& planes, int num_threads);

}  // namespace nacre
