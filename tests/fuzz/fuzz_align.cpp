// Registration of any two clouds: a rigid motion comes out, or the one that went in.
#include "options.hpp"

NACRE_FUZZ_TARGET(bytes) {
  using namespace nacre;
  const Points target = bytes.points(250);
  Points source = bytes.points(250);
  if (bytes.boolean()) source = target;
  const Points source_normals = bytes.normals(source.rows()), target_normals = bytes.normals(target.rows());
  const Values source_sigma = bytes.values(source.rows()), target_sigma = bytes.values(target.rows());
  const Values source_gray = bytes.values(source.rows()), target_gray = bytes.values(target.rows());
  const Pose initial = bytes.pose();
  const AlignOptions options = nacre_fuzz::align_options(bytes);
  const AlignResult result = align(AlignCloud(source, source_normals, source_sigma, source_gray),
                                   AlignCloud(target, target_normals, target_sigma, target_gray), initial, options);
  NACRE_HOLDS(result.target_from_source.matrix().allFinite());
  const Eigen::Matrix3d rotation = result.target_from_source.linear();
  NACRE_HOLDS((rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-3);
  NACRE_HOLDS(result.overlap >= 0.0 && result.overlap <= 1.0 && !(result.rmse < 0.0));
  // Brightness takes at most twelve steps at each of two levels, and six iterations on the shapes after each.
  const bool has_gray = source_gray.size() > 0 && target_gray.size() > 0;
  NACRE_HOLDS(result.iterations >= 0);
  NACRE_HOLDS(result.iterations <= options.max_iterations + (has_gray ? 2 * 12 * 6 : 0));
}
