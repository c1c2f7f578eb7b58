#include "registration/gauss_newton.hpp"

#include "registration/weak_directions.hpp"

namespace nacre {
namespace {

Vector6 twist_row(const Eigen::Vector3d& lever, const Eigen::Vector3d& gradient, double extent) {
  Vector6 row;
  row << lever.cross(gradient) / extent, gradient;
  return row;
}

}  // namespace

Vector6 gauss_newton_step(const std::vector<MotionRow>& rows, const TwistBasis& basis, double extent,
                          const Damping& damping) {
  Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(basis.cols(), basis.cols());
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(basis.cols());
  double weight = 0.0;
  for (const MotionRow& pair : rows) {
    const Eigen::VectorXd row = basis.transpose() * twist_row(pair.lever, pair.gradient, extent);
    hessian += pair.weight * row * row.transpose();
    gradient -= pair.weight * pair.residual * row;
    weight += pair.weight;
  }
  hessian.diagonal().array() += damping.of_trace * hessian.trace() + damping.of_weight * weight;
  return basis * solve_normal_equations(hessian, gradient);
}

Eigen::MatrixXd agreed_information(const std::vector<MotionRow>& rows, const TwistBasis& basis, double extent,
                                   double scale) {
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(basis.cols(), basis.cols());
  for (const MotionRow& pair : rows) {
    const Eigen::VectorXd a = basis.transpose() * twist_row(pair.lever, pair.target_gradient, extent);
    const Eigen::VectorXd b = basis.transpose() * twist_row(pair.lever, pair.source_gradient, extent);
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
  const IcpResult back = align_held(target, source, result.target_from_source, held);
  if (back.status == AlignStatus::too_few_pairs) return false;
  const int iterations = result.iterations + back.iterations;
  const AlignStatus status = result.status;
  result = back;
  result.status = status;
  result.iterations = iterations;
  return true;
}

}  // namespace nacre
