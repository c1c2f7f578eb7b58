// A frame whose camera is known.
#pragma once

#include <cstdint>

#include "fusion/observer.hpp"
#include "nacre/camera.hpp"
#include "nacre/depth.hpp"

namespace nacre {

struct RegisteredFrame {
  const Frame& frame;
  const Camera& camera;
  const SurfaceObserver& observer;  // of the frame and its colours
  const Pose& world_from_camera;
  std::int32_t index;                                    // in the recording
  Eigen::Vector3f color_gain = Eigen::Vector3f::Ones();  // of its exposure
};

}  // namespace nacre
