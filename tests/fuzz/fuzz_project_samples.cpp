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
  constexpr double large = 1e15;
  const auto is_far = [](const auto& value) { return std::abs(static_cast<double>(value)) > large; };
  const bool is_moderate = !points.unaryExpr(is_far).any() && !samples.unaryExpr(is_far).any() &&
                           options.radius > 1e-6 && options.radius < large;
  for (Eigen::Index i = 0; is_moderate && i < moved.rows(); ++i) {
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
