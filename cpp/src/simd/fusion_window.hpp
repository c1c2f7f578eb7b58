// What a window of an oriented depth image says about surface points: the symmetric implicit moving-least-squares
// residual. Image and points are in the camera's frame.
#pragma once

#include <stdint.h>

#include "simd/isa.hpp"

namespace nacre::simd {

constexpr int largest_window = 7;  // pixels on each side of a point: a row is at most 16 lanes
constexpr int paired_window = 4;   // the least, of which two rows are 16 lanes

// Planes of one row stride, from pixel (0, 0) on. Around the image is a border of zeros that windows may reach into:
// largest_window rows above and below, as many pixels to the left, and 25 to the right.
struct SurfaceImage {
  const float *x, *y, *z;                       // points [m]; 0 where there is no measurement
  const float *normal_x, *normal_y, *normal_z;  // unit length, or 0
  const float* weight;                          // 0 where a pixel says nothing
  const float *red, *green, *blue;              // null without colours
  int64_t stride;                               // from row to row
};

// One image row of a Frame, point after point.
struct FrameRow {
  int width;
  const float *points, *normals, *sigma;
};

struct SurfaceRow {
  float *x, *y, *z, *normal_x, *normal_y, *normal_z, *weight;
};

// weight = (reference_sigma / sigma)^2, 0 where the surface turns away: information relative to a measurement of the
// reference noise. The ratio has bounds, so that sums of weights, and their squares, neither overflow nor vanish.
constexpr float least_sigma_ratio = 1e-6F, largest_sigma_ratio = 1e6F;
using FillSurfaceRow = void(const FrameRow& row, float reference_sigma, bool orthographic, const SurfaceRow& out);
NACRE_DECLARE_KERNEL(FillSurfaceRow, fill_surface_row)

// The range of depth and the largest weight of the pixels that have one, in `rows` rows of `width` <= 32 pixels from
// `start` on; infinity, -infinity and 0 where there are none.
using SummarisePixels = void(const SurfaceImage& image, int64_t start, int width, int rows, float* nearest,
                             float* farthest, float* largest_weight);
NACRE_DECLARE_KERNEL(SummarisePixels, summarise_pixels)

// `count` points with what limits their windows, array by array.
struct WindowQueries {
  int count;
  const float *x, *y, *z, *normal_x, *normal_y, *normal_z;
  const float *ray_x, *ray_y, *ray_z;  // along the ray through the point, as far as takes it 1 along its normal
  const int32_t *first_u, *first_v;    // the first pixel of the window, which may lie in the border
  const int32_t* window;               // paired_window to largest_window: half of its rows, and of its columns
  const float* radius;                 // of the support, along the surface [m]
  const float* largest_offset;         // along the normal [m]
};

struct WindowSums {
  float *weight, *offset;                 // offset: already divided by the weight
  float *normal_x, *normal_y, *normal_z;  // not normalised
  float *red, *green, *blue;              // divided by the weight; null without colours
};

// Which pixels of each window show the point's own surface: bit b of rows[2 largest_window i + r] is the pixel b to the
// right of the window's left edge in its row r. Null where nobody asks.
struct WindowCover {
  const float* spacing;         // along the surface [m]
  const float* largest_offset;  // along the normal [m]
  float least_cosine;           // between the normals
  uint16_t* rows;
};

// For each point x_i with normal n_i, over the pixels j of its window, with weights w that fall from the pixel's own
// to 0 at the radius, for pixels whose normal is within an angle of n_i. Distances along the surface are to where the
// pixels' rays meet the point's tangent plane: if noise along the rays chose the weights, slanted surfaces that are
// curved would come out too deep.
//   weight = sum of w,  offset = sum of w (n_i + n_j) / 2 . (q_j - x_i) / weight,  normal = sum of w n_j.
using ObserveWindows = void(const SurfaceImage& image, const WindowQueries& queries, float least_cosine,
                            const WindowSums& sums, const WindowCover* cover);
NACRE_DECLARE_KERNEL(ObserveWindows, observe_windows)

}  // namespace nacre::simd
