// The rays of a camera, in arrays of floats that vectors can read.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "simd/depth_rays.hpp"

namespace nacre {

struct RayTable {
  // Without distortion, and with depth along the axis, a ray's x is that of its column and its y that of its row.
  bool is_grid = true;
  std::ptrdiff_t width = 0;
  std::vector<float> x, y, z;             // directions: of the columns, the rows and the columns, or of each pixel
  std::vector<float> origin_x, origin_y;  // of the columns and of the rows
  std::array<std::vector<float>, 4> pixel_from_ray;  // of each pixel, see simd::RayRow; empty without distortion

  simd::RayRow row(int v) const {
    const std::ptrdiff_t first = is_grid ? 0 : v * width;
    const auto i = static_cast<std::size_t>(v);
    simd::RayRow row = {x.data() + first,
                        is_grid ? nullptr : y.data() + first,
                        z.data() + first,
                        is_grid ? y[i] : 0.0F,
                        origin_x.data(),
                        origin_y[i],
                        {}};
    for (std::size_t k = 0; k < 4; ++k) {
      row.pixel_from_ray[k] = pixel_from_ray[k].empty() ? nullptr : pixel_from_ray[k].data() + first;
    }
    return row;
  }
};

}  // namespace nacre
