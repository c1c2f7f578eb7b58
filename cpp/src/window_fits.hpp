// Quadratic surfaces fitted to windows on a coarse grid over a depth image: what they leave over is noise, and their
// slopes tell where it is amplified.
#pragma once

#include <vector>

#include "planar_image.hpp"
#include "simd/window_row.hpp"

namespace nacre {

struct WindowFits {
  static constexpr int kRadius = simd::fit_radius, kStep = simd::fit_step;

  int cols = 0, rows = 0;
  // Of each window, row by row: see simd::WindowRow.
  std::vector<float> residual, pixel, step, slope;

  // The image column or row of a window's centre.
  static int centre(int index) { return kRadius + index * kStep; }
};

// Residuals, pixels and steps are in units of the noise of `sensor_prior`.
WindowFits fit_windows(const PlanarImage& image, const Camera& camera, int num_threads);

// The Kinect's curve; for an orthographic camera a constant.
NoiseModel sensor_prior(const Camera& camera);

NoiseModel estimate_noise(const WindowFits& fits, const Camera& camera, int num_threads);

}  // namespace nacre
