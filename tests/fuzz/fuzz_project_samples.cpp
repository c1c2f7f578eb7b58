// WLOP's iteration of any samples and points, with hints.
#include "options.hpp"

namespace {

template <class Matrix>
void run(nacre_fuzz::Bytes& bytes) {
  using namespace nacre;
  const Matrix points = bytes.rows<Matrix>(200), samples = bytes.rows<Matrix>(60);
  const ConsolidateOptions options = nacre_fuzz::consolidate_options(bytes);
  ProjectionHints hints;
  if (bytes.boolean()) {
    hints.point_weights = bytes.values(points.rows());
    hints.sample_normals = bytes.normals(samples.rows());
    if (bytes.boolean()) hints.frozen.assign(static_cast<std::size_t>(samples.rows()), std::uint8_t{bytes.boolean()});
  }
  const Matrix moved = project_samples(samples, points, options, hints);
  NACRE_HOLDS(moved.rows() == samples.rows());
  for (Eigen::Index i = 0; i < moved.rows(); ++i) {
    NACRE_HOLDS(moved.row(i).allFinite() == samples.row(i).allFinite());
  }
}

}  // namespace

NACRE_FUZZ_TARGET(bytes) {
  if (bytes.boolean()) {
    run<nacre::Points>(bytes);
  } else {
    run<nacre::PointsDouble>(bytes);
  }
}
