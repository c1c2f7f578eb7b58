// The steps of preprocess_depth.
#pragma once

#include "nacre/depth.hpp"

namespace nacre {

// preprocess_depth, where unset noise is what a calibration says once it has seen this image, or the part of it that is
// the scene (empty: all); and label_pixels.
DepthImage clean_depth(const DepthRef& depth, const Camera& camera, const DepthOptions& options, const MaskRef& mask,
                       NoiseCalibration* calibration, DepthReport* report, MaskImage* labels, int num_threads,
                       const MaskRef& scene = MaskImage());

}  // namespace nacre
