// What a frame shows of a shape, and what of the shape it may show.
#pragma once

#include <cstdint>
#include <vector>

#include "nacre/camera.hpp"
#include "nacre/fusion.hpp"
#include "tracking/frame_samples.hpp"

namespace nacre {

struct ShownSurface {
  Points points, normals;     // world frame
  Values sigma;               // standard deviation of each point along its normal [m]
  Values reach;               // how far off the surface that a point shows may be, at last [m]
  double shared_error = 0.0;  // part of the variance that neighbouring points share
  double spacing = 0.0;       // of the model [m]
  Values brightness = {};     // of each point; empty: unknown
  Points gradient = {};       // of it along the surface [1/m]
};

// spacing: of the model [m].
ShownSurface shown_surface(const FrameSamples& samples, const Pose& world_from_camera, const Camera& camera,
                           double spacing);

// Gives it the brightness of pixels, in the camera's frame.
void add_brightness(ShownSurface& shown, const FrameSamples& samples, const Pose& world_from_camera,
                    const BrightCloud& pixels, double spacing, int num_threads);

// The rows of the model's points that are in the camera's image and turned towards it.
std::vector<std::int32_t> rows_facing(const PointModel& model, const Camera& camera, const Pose& world_from_camera);

}  // namespace nacre
