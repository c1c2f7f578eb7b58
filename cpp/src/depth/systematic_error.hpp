// Errors of depth cameras that no averaging removes.
#pragma once

namespace nacre {

// What a depth camera is wrong by beyond its noise, so that no averaging removes it: a standard deviation [m].
float systematic_error(float z);

}  // namespace nacre
