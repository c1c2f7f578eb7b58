#include "registration/gauss_newton.hpp"

#include "base/linear_algebra.hpp"

namespace nacre {
namespace {

// Of and between the directions of a basis.
using Amounts = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1>;
using Products = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6>;

Vector6 twist_row(const Eigen::Vector3d& lever, const Eigen::Vector3d& gradient, double extent) {
  Vector6 row;
  row << lever.cross(gradient) / extent, gradient;
  return row;
}

}  // namespace

Vector6 gauss_newton_step(const std::vector<MotionRow>& rows, const TwistBasis& basis, double extent, double damping) {
  Products hessian = Products::Zero(basis.cols(), basis.cols());
  Amounts gradient = Amounts::Zero(basis.cols());
  double weight = 0.0;
  for (const MotionRow& pair : rows) {
    const Amounts row = basis.transpose() * twist_row(pair.lever, pair.gradient, extent);
    hessian += pair.weight * row * row.transpose();
    gradient -= pair.weight * pair.residual * row;
    weight += pair.weight;
  }
  hessian.diagonal().array() += damping * weight;
  return basis * solve_symmetric(hessian, gradient);
}

Eigen::MatrixXd agreed_information(const std::vector<MotionRow>& rows, const TwistBasis& basis, double extent,
                                   double scale) {
  Products sum = Products::Zero(basis.cols(), basis.cols());
  for (const MotionRow& pair : rows) {
    const Amounts a = basis.transpose() * twist_row(pair.lever, pair.target_gradient, extent);
    const Amounts b = basis.transpose() * twist_row(pair.lever, pair.source_gradient, extent);
    sum += 0.5 * pair.weight * scale * scale * (a * b.transpose() + b * a.transpose());
  }
  return sum;
}

void add_information(const std::vector<MotionRow>& rows, const TwistBasis& basis, double extent, double noise,
                     Matrix6& information) {
  for (const MotionRow& pair : rows) {
    Vector6 row = basis * (basis.transpose() * twist_row(pair.lever, pair.target_gradient, extent));
    row.head<3>() *= extent;
    information += pair.weight / (noise * noise) * row * row.transpose();
  }
}

bool return_to_surface(const IcpTarget& target, const IcpSource& source, const AlignOptions& held, IcpResult& result) {
  const IcpResult back = align_held(target, source, result.target_from_source, held, result.weak_test);
  if (back.status == AlignStatus::too_few_pairs) return false;
  const int iterations = result.iterations + back.iterations;
  const AlignStatus status = result.status;
  result = back;
  result.status = status;
  result.iterations = iterations;
  return true;
}

}  // namespace nacre
