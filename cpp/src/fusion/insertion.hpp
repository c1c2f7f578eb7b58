// New points: the surface of a frame that the model lacks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "fusion/pixel_index.hpp"
#include "fusion/registered_frame.hpp"
#include "nacre/fusion.hpp"

namespace nacre {

// What of the image the model knows.
struct KnownSurface {
  struct Point {
    std::size_t point;
    std::int32_t pixel;
  };
  PixelSet covered;           // pixels whose surface the model has
  std::vector<Point> points;  // that were observed, or stand for surface from beside the image
};

// Adds points to the model, a spacing [m] apart, where it lacks the frame's surface. Returns how many.
std::int64_t insert_points(PointModel& model, KnownSurface known, const RegisteredFrame& now, double spacing,
                           bool with_colors, int num_threads);

}  // namespace nacre
