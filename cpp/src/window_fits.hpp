// Quadratic surfaces fitted to windows on a coarse grid over a depth image: what they leave over is noise, and their
// slopes tell where it is amplified.
#pragma once

#include <vector>

#include "planar_image.hpp"

namespace nacre {

struct WindowFits {
  static constexpr int kRadius = 3;  // windows of 7 x 7
  static constexpr int kStep = 5;    // from window to window

  int cols = 0, rows = 0;
  std::vector<float> residual;  // standard deviation of the planar image about the surface; NaN: a pixel is missing
  std::vector<float> slope;     // of the surface, in the planar image, per pixel

  // The image column or row of a window's centre.
  static int centre(int index) { return kRadius + index * kStep; }
};

WindowFits fit_windows(const PlanarImage& image, int num_threads);

NoiseModel estimate_noise(const PlanarImage& image, const WindowFits& fits, const Camera& camera);

// For each window of the grid the smallest slope among it and its neighbours, so that edges do not count; 0 where
// there is none.
std::vector<float> smooth_slopes(const WindowFits& fits);

}  // namespace nacre
