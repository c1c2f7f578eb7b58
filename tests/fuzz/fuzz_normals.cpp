// Normals of any points.
#include "bytes.hpp"
#include "nacre/normals.hpp"

namespace {

template <class Matrix>
void estimate(nacre_fuzz::Bytes& bytes) {
  const Matrix points = bytes.rows<Matrix>(300);
  nacre::NormalOptions options;
  bytes.change(options.k, -1, 400), bytes.change(options.max_radius);
  options.num_threads = bytes.threads();
  Eigen::Vector3d viewpoint = Eigen::Vector3d::Zero();
  if (bytes.boolean()) viewpoint << bytes.number(), bytes.number(), bytes.number();
  const Matrix normals = nacre::estimate_normals(points, options, viewpoint);
  NACRE_HOLDS(normals.rows() == points.rows());
  for (Eigen::Index i = 0; i < normals.rows(); ++i) {
    const double length = normals.row(i).template cast<double>().norm();
    NACRE_HOLDS(std::isnan(length) || std::abs(length - 1.0) < 1e-3);
    if (!points.row(i).allFinite()) NACRE_HOLDS(std::isnan(length));
  }
}

}  // namespace

NACRE_FUZZ_TARGET(bytes) {
  if (bytes.boolean()) {
    estimate<nacre::Points>(bytes);
  } else {
    estimate<nacre::PointsDouble>(bytes);
  }
}
