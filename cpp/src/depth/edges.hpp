// Pixels at depth edges.
#pragma once

#include "depth/byte_image.hpp"
#include "depth/inverse_depth_image.hpp"
#include "depth/window_fits.hpp"
#include "nacre/depth.hpp"

namespace nacre {

// The paper's strong edges: pixels whose 3 x 3 Sobel gradient exceeds options.gradient_threshold a pixel. A missing
// neighbour is a strong edge: in the paper's images nothing is behind the object. Marks as in simd/depth_edges.hpp.
ByteImage mark_gradient_edges(const DepthRef& depth, const DepthOptions& options, int num_threads);

// Second differences of the planar image above the noise, and slants above options.max_slant. Marks as in
// simd/depth_edges.hpp.
ByteImage mark_planar_edges(const PlanarImage& image, const WindowFits& fits, const NoiseModel& noise,
                            const DepthOptions& options, int num_threads);

// Grows the marks by a radius, in both directions of the image.
ByteImage dilated(const ByteImage& marks, int radius, int num_threads);

// Takes the marks from pixels that lie on the plane through the unmarked ones beside them, from these inwards: those
// that the dilation marked, and one more, which the edge's second difference marked beside it. `first_marks` are those
// before the dilation.
void keep_planar(const PlanarImage& image, const ByteImage& first_marks, const NoiseModel& noise,
                 const DepthOptions& options, int num_threads, ByteImage& marks);

}  // namespace nacre
