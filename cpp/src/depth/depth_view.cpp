#include "depth/depth_view.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/parallel.hpp"
#include "camera/point_projection.hpp"
#include "depth/systematic_error.hpp"

namespace nacre {
namespace {

struct Counts {
  std::int64_t agree = 0, violated = 0;
  Counts& operator+=(const Counts& other) {
    agree += other.agree;
    violated += other.violated;
    return *this;
  }
};

}  // namespace

double consistency_of(const PointsRef& points, const PointsRef& normals, const DepthView& view,
                      const Pose& world_from_camera, const Camera& camera, double spacing, int num_threads) {
  constexpr std::int64_t block_size = ModelView::capacity, least_judged = 20;
  const ModelView model_view(camera, world_from_camera);
  const Counts counts =
      block_reduce(points.rows(), block_size, num_threads, Counts{}, [&](std::int64_t begin, std::int64_t end) {
        ModelView::Block block;
        model_view.project(points.data() + 3 * begin, normals.data() + 3 * begin, static_cast<int>(end - begin), block);
        Counts sum;
        for (int i = 0; i < static_cast<int>(end - begin); ++i) {
          if (!block.inside[i] || !(block.facing[i] > 0.3F)) continue;
          const std::int32_t pixel = block.pixel[i];
          const float behind = view.depth[pixel] - block.z[i];
          if (!std::isfinite(behind)) continue;
          const float error = std::hypot(4.0F * view.sigma[pixel], 2.0F * systematic_error(view.depth[pixel]));
          const float tolerance = std::max(3.0F * static_cast<float>(spacing), error) / block.facing[i];
          if (behind > tolerance) {
            ++sum.violated;
          } else if (behind > -tolerance) {
            ++sum.agree;
          }
        }
        return sum;
      });
  const std::int64_t judged = counts.agree + counts.violated;
  return judged >= least_judged ? static_cast<double>(counts.agree) / static_cast<double>(judged)
                                : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace nacre
