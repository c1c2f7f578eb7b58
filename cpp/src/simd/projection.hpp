// Points of the world as a camera sees them.
#pragma once

#include <stdint.h>

#include "simd/isa.hpp"

namespace nacre::simd {

// What maps the world to a camera's image. Lens distortion is not part of it.
struct View {
  float rotation[9];     // camera_from_world, row by row
  float translation[3];  // [m]
  float fx, fy, cx, cy;  // [pixels]; for an orthographic camera per metre
  bool orthographic;
};

struct ProjectedPoints {
  float *x, *y, *z, *normal_x, *normal_y, *normal_z;  // camera frame
  float *u, *v;                                       // [pixels]; of no meaning where z <= 0 (pinhole)
  float* facing;                                      // cosine between the normal and the direction to the camera
};

// The pixel nearest to each place, of those of the image: -1 for NaN. inside: whether the place is in the image.
using NearestPixels = void(const float* u, const float* v, int count, int width, int height, int32_t* pixel,
                           int32_t* inside);
NACRE_DECLARE_KERNEL(NearestPixels, nearest_pixels)

// points and normals: `count` times x, y, z.
using ProjectPoints = void(const View& view, const float* points, const float* normals, int count,
                           const ProjectedPoints& out);
NACRE_DECLARE_KERNEL(ProjectPoints, project_points)

}  // namespace nacre::simd
