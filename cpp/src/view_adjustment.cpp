#include "view_adjustment.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include "icp_target.hpp"
#include "parallel.hpp"
#include "plane_registration.hpp"
#include "rigid_motion.hpp"

namespace nacre {
namespace {

constexpr int num_iterations = 12;
constexpr Eigen::Index num_samples = 800;
constexpr double cos_angle = 0.7;                                 // between normals that match
constexpr std::size_t least_pairs = 40;                           // of two views that see the same surface
constexpr double still = 1e-6;                                    // motions of all views together [rad], [m]
constexpr double first_gate = 2.0, last_gate = 1.0, decay = 0.8;  // in tolerances

struct Side {
  IcpSource source;
  IcpTarget target;
};

}  // namespace

std::vector<Pose> adjust_views(const std::vector<AdjustableView>& views, const MotionBasis& motions, double tolerance,
                               int num_threads) {
  std::vector<Pose> poses;
  for (const AdjustableView& view : views) poses.push_back(view.world_from_camera);
  if (views.size() < 3) return poses;
  AlignOptions options;
  options.max_samples = static_cast<int>(num_samples);
  options.num_threads = 1;
  std::vector<std::unique_ptr<Side>> sides(views.size());
  parallel_for(static_cast<std::int64_t>(views.size()), 1, num_threads, [&](std::int64_t i) {
    const AdjustableView& view = views[static_cast<std::size_t>(i)];
    const AlignCloud cloud(view.points, view.normals);
    sides[static_cast<std::size_t>(i)] =
        std::make_unique<Side>(Side{IcpSource(cloud, options), IcpTarget(cloud, options)});
  });
  const auto count = static_cast<Eigen::Index>(views.size());
  const Eigen::Index freedom = motions.twists.cols();
  std::vector<std::uint8_t> see_the_same(views.size() * views.size(), 1);
  for (std::size_t i = 0; i < views.size(); ++i) see_the_same[i * views.size() + i] = 0;
  double gate = first_gate;
  for (int iteration = 0; iteration < num_iterations; ++iteration) {
    std::vector<std::vector<Pair>> matches(see_the_same.size());
    parallel_for(count * count, 1, num_threads, [&](std::int64_t k) {
      const auto i = static_cast<std::size_t>(k / count), j = static_cast<std::size_t>(k % count);
      if (see_the_same[static_cast<std::size_t>(k)] == 0) return;
      const IcpSource& source = sides[i]->source;
      std::vector<std::uint32_t> nearest(static_cast<std::size_t>(source.cloud.points.rows()), no_slot);
      std::vector<Pair> pairs =
          sides[j]->target.match(source, source.cloud.points.rows(), poses[j].inverse() * poses[i],
                                 {gate * tolerance, cos_angle, false}, nearest);
      if (pairs.size() < least_pairs) {
        if (gate == last_gate) see_the_same[static_cast<std::size_t>(k)] = 0;
        return;
      }
      weight_robustly(pairs, 0.05 * tolerance);
      const double reach = gate * tolerance;
      for (Pair& pair : pairs) {
        // Beyond a view's rim, matches only continue it: the farther along the surface, the less they count.
        const double across = residual(pair, Metric::symmetric),
                     along = (pair.p - pair.q).squaredNorm() - across * across;
        const double part = std::max(0.0, 1.0 - along / (reach * reach));
        pair.weight *= part * part;
        pair.p = poses[j] * pair.p;
        pair.q = poses[j] * pair.q;
        pair.normal = poses[j].linear() * pair.normal;
      }
      matches[static_cast<std::size_t>(k)] = std::move(pairs);
    });
    // Each residual grows with the motion of one view and shrinks with that of the other.
    Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(freedom * count, freedom * count);
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(freedom * count);
    for (Eigen::Index k = 0; k < count * count; ++k) {
      if (matches[static_cast<std::size_t>(k)].empty()) continue;
      Matrix6 squares = Matrix6::Zero();
      Vector6 right_side = Vector6::Zero();
      for (const Pair& pair : matches[static_cast<std::size_t>(k)]) {
        const MotionBasis::Amounts row = motions.row(pair);
        squares.topLeftCorner(freedom, freedom).noalias() += pair.weight * row * row.transpose();
        right_side.head(freedom) += pair.weight * residual(pair, Metric::symmetric) * row;
      }
      const Eigen::Index i = freedom * (k / count), j = freedom * (k % count);
      const auto square = squares.topLeftCorner(freedom, freedom);
      hessian.block(i, i, freedom, freedom) += square;
      hessian.block(j, j, freedom, freedom) += square;
      hessian.block(i, j, freedom, freedom) -= square;
      hessian.block(j, i, freedom, freedom) -= square;
      gradient.segment(i, freedom) -= right_side.head(freedom);
      gradient.segment(j, freedom) += right_side.head(freedom);
    }
    hessian.diagonal().array() += 1e-6 * hessian.trace() / static_cast<double>(freedom * count);
    const Eigen::Index rest = freedom * (count - 1);
    const Eigen::VectorXd solution =
        Eigen::MatrixXd(hessian.bottomRightCorner(rest, rest)).ldlt().solve(gradient.tail(rest));
    for (Eigen::Index k = 1; k < count; ++k) {
      Pose& pose = poses[static_cast<std::size_t>(k)];
      pose = orthonormal(motions.apply(solution.segment(freedom * (k - 1), freedom)) * pose);
    }
    if (gate == last_gate && solution.norm() < still) break;
    gate = std::max(last_gate, decay * gate);
  }
  return poses;
}

}  // namespace nacre
