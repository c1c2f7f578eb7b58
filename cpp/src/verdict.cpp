#include "verdict.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "frame_samples.hpp"
#include "model_view.hpp"
#include "parallel.hpp"

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

double consistency_of(const PointsRef& points, const PointsRef& normals, const Sight& sight,
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
          const float behind = sight.depth[pixel] - block.z[i];
          if (!std::isfinite(behind)) continue;
          const float error = std::hypot(4.0F * sight.sigma[pixel], 2.0F * systematic_error(sight.depth[pixel]));
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

void judge(TrackingResult& result, const ModelOptions& options, bool strict) {
  constexpr double chance = 0.58;       // the rms of a uniform distribution, 1 / sqrt(3)
  constexpr double strictness = 1.2;    // times min_evidence
  constexpr double beyond_doubt = 2.0;  // times min_evidence
  constexpr double least_ratio = 0.01;  // data without noise is no more certain
  std::ostringstream reason;
  reason.precision(3);
  result.status = FrameStatus::lost;
  const double overlap = result.alignment.overlap;
  const double ratio = std::max(least_ratio, result.alignment.residual_ratio);
  const double misfit = std::max(1.0, result.alignment.misfit);
  const double per_match = std::max(0.0, std::log(chance / ratio));
  result.evidence = overlap * overlap * std::pow(result.consistency, 4) * per_match / (misfit * misfit);
  result.recognition =
      misfit > 1.0 ? 0.0 : overlap * std::pow(result.consistency, 8) * per_match * result.alignment.normal_information;
  const double least = options.min_evidence * (strict ? strictness : 1.0);
  if (result.alignment.status == AlignStatus::too_few_pairs) {
    result.evidence = result.recognition = 0.0;
    reason << "too few points of the frame match the model";
  } else if (options.verify && !(result.evidence >= least)) {
    reason << "evidence " << result.evidence << " is below " << least << ": overlap " << overlap << ", consistency "
           << result.consistency << ", residuals " << ratio << " of the largest that match";
    if (misfit > 1.0) reason << ", bent " << misfit << " times as much as noise explains";
  } else if (options.verify && result.alignment.weak_directions.cols() > 0) {
    result.status = FrameStatus::weak;
    reason << result.alignment.weak_directions.cols() << " direction(s) of the pose are not determined";
  } else {
    result.status = FrameStatus::tracked;
    result.is_beyond_doubt = options.verify && result.evidence >= beyond_doubt * options.min_evidence;
  }
  result.reason = reason.str();
}

}  // namespace nacre
