// What the confidence is worth that a camera tells with its pixels.
#pragma once

#include <array>
#include <cstdint>

#include "nacre/depth.hpp"
#include "nacre/fusion.hpp"

namespace nacre {

// Cameras that tell how sure they are of a pixel, as telephones do in three levels, do not say what that means. Where
// frames are registered, the residuals of the pixels of each level tell: by them standard deviations are multiplied,
// by 1 for the level that is best.
class ConfidenceNoise {
 public:
  // A registered frame, scaled as far as was known, and the model before the frame became part of it.
  void add(const MaskImage& confidence, const Frame& frame, const PointModel& model, const Pose& world_from_camera,
           const Camera& camera);
  // The standard deviations of a frame's pixels, as far as is known.
  void scale(const MaskImage& confidence, Frame& frame) const;

 private:
  friend struct PrivateState;
  struct Level {
    double log_scale = 0.0, count = 0.0;  // of residuals, the mean; frames
  };
  using Factors = std::array<float, 256>;
  Factors factors() const;

  std::array<Level, 256> levels_;
};

}  // namespace nacre
