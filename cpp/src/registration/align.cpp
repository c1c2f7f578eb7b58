#include <cmath>

#include "base/check.hpp"
#include "base/pose_check.hpp"
#include "nacre/registration.hpp"
#include "registration/color.hpp"
#include "registration/icp.hpp"
#include "registration/paper_icp.hpp"

namespace nacre {

const char* to_string(AlignStatus status) {
  switch (status) {
    case AlignStatus::converged:
      return "converged";
    case AlignStatus::max_iterations:
      return "max_iterations";
    default:
      return "too_few_pairs";
  }
}

void AlignOptions::check() const {
  require(max_iterations >= 1, "max_iterations", "at least 1", max_iterations);
  require(max_distance >= 0.0 && std::isfinite(max_distance), "max_distance",
          "0 (automatic) or a positive distance in metres", max_distance);
  require(final_distance >= 0.0 && std::isfinite(final_distance), "final_distance",
          "0 (automatic) or a positive distance in metres", final_distance);
  require(gate_decay > 0.0 && gate_decay <= 1.0, "gate_decay", "in (0, 1]", gate_decay);
  require(max_angle > 0.0, "max_angle", "a positive angle in radians", max_angle);
  require(sample_fraction > 0.0 && sample_fraction <= 1.0, "sample_fraction", "in (0, 1]", sample_fraction);
  require(max_points >= 0, "max_points", "0 (no limit) or more", max_points);
  require(max_samples >= 0, "max_samples", "0 (no limit) or more", max_samples);
  require(coarse_samples >= 0, "coarse_samples", "0 (no limit) or more", coarse_samples);
  require(weak_threshold >= 0.0, "weak_threshold", "at least 0", weak_threshold);
  require(num_threads >= 0, "num_threads", "0 (all) or more", num_threads);
}

AlignCloud::AlignCloud(const PointsRef& points_in, const PointsRef& normals_in, const ValuesRef& sigma_in,
                       const ValuesRef& brightness_in)
    : points(points_in), normals(normals_in), sigma(sigma_in), brightness(brightness_in) {
  require(normals.rows() == 0 || normals.rows() == points.rows(), "normals", "one row per point", normals.rows());
  require(sigma.size() == 0 || sigma.size() == points.rows(), "sigma", "one value per point", sigma.size());
  require(brightness.size() == 0 || brightness.size() == points.rows(), "brightness", "one value per point",
          brightness.size());
}

AlignResult align(const AlignCloud& source, const AlignCloud& target, const Pose& initial,
                  const AlignOptions& options) {
  options.check();
  require_rigid(initial, "initial");
  if (options.method == Metric::paper) return align_as_in_paper(source, target, initial, options);
  const IcpTarget prepared_target(target, options);
  const IcpSource prepared_source(source, options);
  IcpResult result = align_to(prepared_target, prepared_source, initial, options);
  const bool has_colors = source.brightness.size() > 0 && target.brightness.size() > 0;
  if (result.weak_directions.cols() == 0 || !has_colors) return result;
  return ColorRegistration(prepared_target, prepared_source, BrightCloud(target.points, target.brightness),
                           BrightCloud(source.points, source.brightness), options)
      .determine(result);
}

}  // namespace nacre
