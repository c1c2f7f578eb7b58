// Registration of any two clouds without a first guess.
#include "nacre/global_registration.hpp"
#include "options.hpp"

NACRE_FUZZ_TARGET(bytes) {
  using namespace nacre;
  const Points target = bytes.points(120);
  Points source = bytes.points(120);
  if (bytes.boolean()) source = target;
  const Points source_normals = bytes.normals(source.rows()), target_normals = bytes.normals(target.rows());
  std::optional<Eigen::Vector3d> viewpoint;
  if (bytes.boolean()) viewpoint = Eigen::Vector3d(bytes.number(), bytes.number(), bytes.number());
  GlobalAlignOptions options;
  options.num_rotations = 12;
  options.num_candidates = 2;
  bytes.change(options.num_rotations, -1, 40), bytes.change(options.num_candidates, -1, 50);
  bytes.change(options.tolerance), bytes.change(options.max_angle), bytes.change(options.min_overlap);
  bytes.change(options.min_consistency), bytes.change(options.max_residual), bytes.change(options.max_rivalry);
  bytes.change(options.outlines), bytes.change(options.max_points, -1, 200), bytes.change(options.max_samples, -1, 100);
  bytes.change(options.coarse_samples, -1, 100);
  options.num_threads = bytes.threads();
  const GlobalAlignResult result = align_global(GlobalCloud(source, source_normals, viewpoint),
                                                GlobalCloud(target, target_normals, viewpoint), options);
  NACRE_HOLDS(result.alignment.target_from_source.matrix().allFinite());
  NACRE_HOLDS(result.overlap >= 0.0 && result.overlap <= 1.0);
  NACRE_HOLDS(result.consistency >= 0.0 && result.consistency <= 1.0);
}
