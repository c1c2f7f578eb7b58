// Normals of a row of a depth image.
#pragma once

#include <stdint.h>

#include "simd/depth_rays.hpp"
#include "simd/depth_row.hpp"
#include "simd/isa.hpp"

namespace nacre::simd {

constexpr int least_normal_window = 2;  // pixels on each side, up to largest_normal_window

struct NormalRule {
  Quadratic sigma, unit_slope;      // of the value: its noise, and its change per pixel on a slope of 1
  Quadratic gate_base, gate_slope;  // a window's members differ from its centre by at most base + distance * slope
  float slope_sigma;                // the window grows until the slope is this certain
  float min_filled;                 // members, of a full window's
  float min_spread;                 // determinant of the members' second moments, of a full window's
  float fx, fy;
};

// The plane value = w + du a_u + dv a_v, fitted by least squares to each pixel's window, as a unit normal towards the
// camera, three floats a pixel; NaN where the members are too few or in a line. Where they lie off the plane by more
// than noise, one of the halves of the window that begin at the pixel may have a better one (Kuwahara 1976): a step is
// on the other side. Unless `valid` is null, the pixels that have a normal go there, counted from `first`, and their
// number is returned.
//
// A plane a x + b y + c z = 1 is 1/z = a x/z + b y/z + c: its normal, away from the camera, is (a, b, c). The plane
// z = a x + b y + c of an orthographic camera has the normal (a, b, -1), towards it.
using FitNormals = int(const PlanarRow& row, const NormalRule& rule, const RayRow& rays, float* normals, int32_t first,
                       int32_t* valid);
NACRE_DECLARE_KERNEL(FitNormals, fit_normals)

}  // namespace nacre::simd
