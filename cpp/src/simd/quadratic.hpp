#pragma once

namespace nacre::simd {

// constant + x (linear + x square)
struct Quadratic {
  float constant, linear, square;
};

}  // namespace nacre::simd
