// The depths of simulated sensors that err like real ones.
#pragma once

#include "simulation/smooth_noise.hpp"
#include "simulation/view.hpp"

namespace nacre {

Depths sense_stereo(const View& view, const Seeds& seeds, int num_threads);
Depths sense_structured_light(const View& view, const Seeds& seeds, int num_threads);
Depths sense_phone_lidar(const View& view, const Seeds& seeds, int num_threads);
// Silhouettes mix with what is at `background`; 0: behind the farthest visible point.
Depths sense_time_of_flight(const View& view, const Seeds& seeds, double background, int num_threads);

}  // namespace nacre
