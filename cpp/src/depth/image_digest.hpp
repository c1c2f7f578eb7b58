// Tells whether a depth image is the one before once more, as recordings have it where colour images come faster.
#pragma once

#include <cstdint>
#include <cstring>

#include "base/random.hpp"
#include "depth/limits.hpp"
#include "nacre/depth.hpp"

namespace nacre {

// Of some of its rows: a camera's noise makes all of them differ.
inline std::uint64_t image_digest(const DepthRef& depth) {
  std::uint64_t digest = 0;
  for (Eigen::Index v = 0; v < depth.rows(); v += depth_limits::probed_rows) {
    for (Eigen::Index u = 0; u < depth.cols(); ++u) {
      const float value = depth(v, u);
      std::uint32_t bits;
      std::memcpy(&bits, &value, sizeof bits);
      digest = mix64(digest ^ bits);
    }
  }
  return digest;
}

}  // namespace nacre
