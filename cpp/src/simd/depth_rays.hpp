// What the kernels know of a camera: the rays of one row of its image.
#pragma once

namespace nacre::simd {

// point = origin + depth * direction. The arrays may be read 15 floats beyond the row's end.
struct RayRow {
  const float *x, *y, *z;  // directions; y is null where it is row_y for the whole row
  float row_y;
  const float* origin_x;
  float origin_y;
  // A distorted image: (d(x / z, y / z) / d(u, v))^-1 of each pixel, row by row. Else null, and the matrix is
  // diag(fx, fy).
  const float* pixel_from_ray[4];
};

}  // namespace nacre::simd
