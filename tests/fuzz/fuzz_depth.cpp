// Cleaning of any image: what stays is what came, to half a coarse unit, or fills a gap, and every pixel is counted
// once.
#include <array>
#include <cmath>

#include "depth/coarse_depth.hpp"
#include "options.hpp"

NACRE_FUZZ_TARGET(bytes) {
  using namespace nacre;
  const Camera camera = bytes.camera();
  const DepthImage depth = bytes.depth(camera);
  const MaskImage mask = bytes.mask(camera);
  const DepthOptions options = nacre_fuzz::depth_options(bytes);
  const int threads = bytes.threads();

  DepthReport report;
  const DepthImage clean = preprocess_depth(depth, camera, options, mask, &report, threads);
  NACRE_HOLDS(clean.rows() == depth.rows() && clean.cols() == depth.cols());
  const DepthUnit unit = coarse_unit(depth);
  const auto is_within_step = [&](float clean_depth, float measured) {
    const float apart = unit.is_of_inverse ? 1.0F / clean_depth - 1.0F / measured : clean_depth - measured;
    return std::abs(apart) <= 0.56F * unit.step;
  };
  std::int64_t num_kept = 0;
  for (Eigen::Index i = 0; i < clean.size(); ++i) {
    if (std::isnan(clean.data()[i])) continue;
    const float measured = depth.data()[i];
    const bool may_be_filled = !(measured > 0.0F && std::isfinite(measured));
    NACRE_HOLDS(clean.data()[i] > 0.0F && (is_within_step(clean.data()[i], measured) || may_be_filled));
    ++num_kept;
  }
  NACRE_HOLDS(num_kept == report.num_kept && report.num_pixels == clean.size());
  NACRE_HOLDS(report.num_invalid + report.num_out_of_range + report.num_masked + report.num_edge + report.num_slanted +
                  report.num_isolated + report.num_kept ==
              report.num_pixels);

  const MaskImage labels = label_pixels(depth, camera, options, mask, threads);
  std::array<std::int64_t, 7> counts{};
  for (Eigen::Index i = 0; i < labels.size(); ++i) {
    NACRE_HOLDS(labels.data()[i] < counts.size());
    ++counts[labels.data()[i]];
    NACRE_HOLDS((labels.data()[i] == static_cast<std::uint8_t>(PixelLabel::kept)) == !std::isnan(clean.data()[i]));
  }
  NACRE_HOLDS(counts[1] == report.num_invalid && counts[4] == report.num_edge && counts[6] == report.num_isolated);

  const Points points = back_project(clean, camera, threads);
  NACRE_HOLDS(points.rows() <= num_kept);  // fewer where the distortion model ends before the image
}
