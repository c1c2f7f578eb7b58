#include "depth/systematic_error.hpp"

namespace nacre {

// Depth cameras are also systematically wrong, the more the farther they see, which averaging does not remove
// (Teichman, Miller and Thrun 2013). The form and the figure are what tracked best on recordings of structured light in
// rooms.
float systematic_error(float z) {
  constexpr float growth = 0.0015F;  // [1/m^2]
  return growth * z * z * z;
}

}  // namespace nacre
