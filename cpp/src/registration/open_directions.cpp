#include "registration/open_directions.hpp"

#include "base/se3.hpp"

namespace nacre {

IcpResult determine_open_directions(const IcpResult& geometric, OpenDirectionSearch& search) {
  TwistBasis known;
  IcpResult result = geometric;
  for (const bool restricted : {false, true}) {
    const OpenFit fit = search.fit(geometric, restricted ? &known : nullptr);
    if (!fit.agrees) return geometric;
    // What shape says only where the search took it must be said by the rows, too.
    const bool is_shaped = fit.result.weak_directions.cols() == 0;
    const TwistBasis open = is_shaped ? geometric.weak_directions : fit.result.weak_directions;
    const Directions directions = search.determined(fit, open);
    if (is_shaped) return directions.weak.cols() == 0 ? fit.result : geometric;
    if (directions.sure.cols() == 0) return geometric;
    known = open * directions.sure;
    result = fit.result;
    result.weak_directions = open * directions.weak;
    add_information(fit.rows, known, fit.extent, fit.noise, result.information);
    if (directions.weak.cols() == 0) break;
  }
  return result;
}

Pose nearest_to(const Pose& guess, const IcpResult& result, double lever) {
  const TwistBasis& weak = result.weak_directions;
  const TwistBasis twists =
      (TwistBasis(6, weak.cols()) << weak.topRows<3>() / result.extent, weak.bottomRows<3>()).finished();
  const Pose& pose = result.target_from_source;
  const Eigen::AngleAxisd turn(pose.linear() * guess.linear().transpose());
  const Eigen::Vector3d arm = pose.translation() - result.center;
  Eigen::MatrixXd motions(6, weak.cols());
  motions << lever * twists.topRows<3>(), twists.bottomRows<3>() - cross_matrix(arm) * twists.topRows<3>();
  Vector6 from_guess;
  from_guess << lever * turn.angle() * turn.axis(), pose.translation() - guess.translation();
  const Eigen::VectorXd least = -(motions.transpose() * motions).ldlt().solve(motions.transpose() * from_guess);
  return motion_about(result.center, twists * least) * pose;
}

}  // namespace nacre
