// The steps of preprocess_depth. Each marks pixels in a byte image (row by row, 1 = noise).
#pragma once

#include <cstdint>
#include <vector>

#include "planar_image.hpp"
#include "window_fits.hpp"

namespace nacre {

using Marks = std::vector<std::uint8_t>;

struct EdgeMarks {
  Marks edge, slanted;
};

// The paper's strong edges: pixels whose 3 x 3 Sobel gradient exceeds options.gradient_threshold a pixel. A missing
// neighbour is a strong edge: in the paper's images nothing is behind the object.
EdgeMarks mark_gradient_edges(const DepthRef& depth, const DepthOptions& options, int num_threads);

// Second differences of the planar image above the noise, and slants above options.max_slant.
EdgeMarks mark_planar_edges(const PlanarImage& image, const WindowFits& fits, const NoiseModel& noise,
                            const DepthOptions& options, int num_threads);

// Grows the marks by a radius, in both directions of the image.
void dilate(int width, int height, int radius, int num_threads, Marks& marks);

// Kept pixels (keep = 1) with more than max_missing of their 5 x 5 neighbours missing.
Marks mark_lonely(int width, int height, const Marks& keep, double max_missing, int num_threads);

// Kept pixels in 4-connected components of fewer than min_component pixels; neighbours are connected when the surface
// between them is not steeper than max_slant.
Marks mark_specks(const PlanarImage& image, const NoiseModel& noise, const DepthOptions& options, const Marks& keep);

}  // namespace nacre
