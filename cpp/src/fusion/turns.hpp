// Which part of a frame is folded in.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "fusion/image_tiles.hpp"
#include "fusion/registered_frame.hpp"
#include "nacre/fusion.hpp"

namespace nacre {

// Images that follow each other fast, from about the same place, err alike: a surface that the model knows well
// learns little from each of them. What of an image shows such a surface is folded in in turn, a tile after the other;
// what the model lacks, and what the camera sees from another direction than before, at once.
class FusionTurns {
 public:
  static std::size_t num_tiles(const Camera& camera);
  // The tiles of the newest frame that are to be folded in.
  ImageTiles next(const PointModel& model, const RegisteredFrame& now, double spacing, const FusionOptions& options,
                  int num_threads);

 private:
  friend struct PrivateState;
  std::vector<Pose> seen_from_;  // of each tile: where the camera was when it was folded in
  std::int64_t turn_ = 0;
};

}  // namespace nacre
