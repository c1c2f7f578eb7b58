// Quadratic surfaces fitted to windows on a coarse grid over a depth image: what they leave over is noise, and their
// slopes tell where it is amplified.
#pragma once

#include <optional>
#include <vector>

#include "depth/inverse_depth_image.hpp"
#include "simd/depth_windows.hpp"

namespace nacre {

struct WindowFits {
  static constexpr int kRadius = simd::fit_radius, kStep = simd::fit_step;

  int cols = 0, rows = 0;
  DepthUnit unit;  // that depth was rounded to, where it shows
  // Of each window, row by row: see simd::WindowRow.
  std::vector<float> residual, roughness, pixel, step, slope;

  // The image column or row of a window's centre.
  static int centre(int index) { return kRadius + index * kStep; }
};

// Residuals, roughness, pixels and steps are in units of the noise of `sensor_prior`.
WindowFits fit_windows(const PlanarImage& image, const Camera& camera, const DepthUnit& unit, int num_threads);

// Without the windows whose centres a part of the image (1) leaves out.
WindowFits fits_of(const MaskRef& part, WindowFits fits);

// The Kinect's curve; for an orthographic camera a constant.
NoiseModel sensor_prior(const Camera& camera);

// How noisy an image is, as factors of the noise of `sensor_prior`.
struct NoiseScale {
  double local = 0.0;  // what surfaces fitted to windows leave over
  double total = 0.0;  // with what neighbouring pixels have in common
};
// Nothing where too few windows are whole.
std::optional<NoiseScale> measure_noise(const WindowFits& fits, int num_threads);

// The sensor's prior times a scale.
NoiseModel scaled_prior(const Camera& camera, const NoiseScale& scale);

NoiseModel estimate_noise(const WindowFits& fits, const Camera& camera, int num_threads);

// Of those values that are there (not NaN; none is negative), the one that would stand at `part` of the way if they
// were sorted. At least one is there.
double quantile(const std::vector<float>& values, double part);

}  // namespace nacre
