// A row of a depth image as values of the planar image, and as points.
#pragma once

#include <stdint.h>

#include "simd/depth_rays.hpp"
#include "simd/isa.hpp"

namespace nacre::simd {

// value / scale; NaN for 0 and 65535.
using FillDepthRow = void(const uint16_t* raw, float scale, int width, float* depth);
NACRE_DECLARE_KERNEL(FillDepthRow, fill_depth_row)

// The planar image's values: z, or 1 / z; NaN where there is no measurement. direction_z: of the rays where depth is
// measured along them, else null.
using FillPlanarRow = void(const float* depth, const float* direction_z, bool is_inverse, int width, float* values);
NACRE_DECLARE_KERNEL(FillPlanarRow, fill_planar_row)

// sigma(z) = constant + quadratic (z - offset)^2
struct SigmaCurve {
  float constant, quadratic, offset;
};

// Points, three floats a pixel, and the standard deviations of their depths; NaN where there is no measurement.
using FillPointRow = void(const float* depth, const RayRow& rays, const SigmaCurve& curve, int width, float* points,
                          float* sigma);
NACRE_DECLARE_KERNEL(FillPointRow, fill_point_row)

// The pixels that hold a measurement and see something: how many, and their points, three floats each. `count` of them
// are written whatever has become of the image since they were counted: another thread may have written to it.
using CountPoints = int(const float* depth, const RayRow& rays, int width);
NACRE_DECLARE_KERNEL(CountPoints, count_points)
using GatherPoints = void(const float* depth, const RayRow& rays, int width, float* points, int count);
NACRE_DECLARE_KERNEL(GatherPoints, gather_points)

}  // namespace nacre::simd
