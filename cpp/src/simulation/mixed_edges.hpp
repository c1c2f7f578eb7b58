// Pixels that see both sides of an edge.
#pragma once

#include <cstdint>
#include <vector>

#include "simulation/view.hpp"

namespace nacre {

// 1 for the pixels that may see a depth edge within `radius`: the corners of each square of four pixels through which
// an edge runs, and their neighbours where the radius is more than a pixel.
std::vector<std::uint8_t> find_edges(const View& view, const Hits& hits, double radius, int num_threads);

// What rays see that hit nothing: `given`, or where that is 0 a place behind the farthest visible point.
double background_of(const View& view, const Hits& hits, double given);

// The mean depth of a square of rays around a place (u, v), weighted by a tent; NaN where all see the background. A
// tent is a box (the blur) over a box (the pixel, where the image is sampled down).
double mixed_depth(const View& view, double u, double v, double radius, double background);

}  // namespace nacre
