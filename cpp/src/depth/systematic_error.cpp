#include "depth/systematic_error.hpp"

#include "depth/limits.hpp"

namespace nacre {

// Depth cameras are also systematically wrong, the more the farther they see, which averaging does not remove
// (Teichman, Miller and Thrun 2013). The form and the figure are what tracked best on recordings of structured light in
// rooms.
float systematic_error(float z) { return depth_limits::systematic_growth * z * z * z; }

}  // namespace nacre
