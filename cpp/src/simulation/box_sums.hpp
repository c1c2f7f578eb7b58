// Sums over the squares around pixels.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace nacre {

using PixelSum = Eigen::Array2d;  // of values, and how many
using PixelSums = std::vector<PixelSum>;

// Replaces each pixel by the sum over the square of 2 radius + 1 pixels around it.
void sum_boxes(PixelSums& image, std::int64_t width, std::int64_t radius, int num_threads);

}  // namespace nacre
