#include "registration/multiview.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include "base/limits.hpp"
#include "base/linear_algebra.hpp"
#include "base/numbers.hpp"
#include "base/parallel.hpp"
#include "base/se3.hpp"
#include "registration/icp.hpp"
#include "registration/limits.hpp"
#include "registration/normal_equations.hpp"
#include "registration/weak_directions.hpp"

namespace nacre {
namespace {

constexpr double no_limit = infinity<double>;

struct Side {
  IcpSource source;
  IcpTarget target;
};

// The pairs of two views, in the world; `nearest` as IcpTarget::match has it.
std::vector<Pair> match(const IcpSource& source, const IcpTarget& target, const Pose& world_from_source,
                        const Pose& world_from_target, double tolerance, std::vector<std::uint32_t>& nearest) {
  nearest.resize(static_cast<std::size_t>(source.cloud.points.rows()), no_slot);
  std::vector<Pair> pairs =
      target.match(source, source.cloud.points.rows(), world_from_target.inverse() * world_from_source,
                   {tolerance, base_limits::same_surface_cosine, false}, nearest);
  if (pairs.size() < base_limits::least_points) return {};
  weight_pairs(pairs, Metric::symmetric, true, registration_limits::least_residual_scale * tolerance);
  for (Pair& pair : pairs) {
    // Beyond a view's rim, matches only continue it: the farther along the surface, the less they count.
    const double across = residual(pair, Metric::symmetric);
    const double along = (pair.p - pair.q).squaredNorm() - across * across;
    const double part = std::max(0.0, 1.0 - along / (tolerance * tolerance));
    pair.weight *= part * part;
    pair.p = world_from_target * pair.p;
    pair.q = world_from_target * pair.q;
    pair.normal = world_from_target.linear() * pair.normal;
    pair.half_difference = world_from_target.linear() * pair.half_difference;
  }
  return pairs;
}

// What the pairs of two views say about the motion of the first, a twist about a centre.
struct Overlap {
  double agreement = 0.0;
  NormalEquations equations;

  Overlap() = default;
  Overlap(const std::vector<Pair>& pairs, const Eigen::Vector3d& center) {
    if (pairs.empty()) return;
    for (const Pair& pair : pairs) agreement += pair.weight;
    equations = normal_equations(pairs, Metric::point_to_plane, &Pair::weight, center, center, 1.0, 1);
  }
};

// The normal equations of all views' motions. Each residual grows with the motion of one view and shrinks with that of
// the other.
struct JointEquations {
  Eigen::MatrixXd hessian, chance;  // see registration/normal_equations.hpp
  Eigen::VectorXd gradient;
  double agreement = 0.0;

  explicit JointEquations(Eigen::Index size)
      : hessian(Eigen::MatrixXd::Zero(size, size)), chance(hessian), gradient(Eigen::VectorXd::Zero(size)) {}

  void add(const Overlap& overlap, const TwistBasis& twists, Eigen::Index moved, Eigen::Index other) {
    if (!(overlap.agreement > 0.0)) return;
    const Eigen::Index freedom = twists.cols(), i = freedom * moved, j = freedom * other;
    const MotionBasis::Amounts by_amounts = twists.transpose() * overlap.equations.gradient;
    add_block(twists.transpose() * overlap.equations.hessian * twists, i, j, hessian);
    add_block(twists.transpose() * overlap.equations.chance * twists, i, j, chance);
    gradient.segment(i, freedom) += by_amounts;
    gradient.segment(j, freedom) -= by_amounts;
    agreement += overlap.agreement;
  }

  // The first view stays; so do directions that only noise in the normals determines.
  Eigen::VectorXd solve(Eigen::Index count, double weak_threshold) {
    hessian.diagonal().array() += 1e-6 * hessian.trace() / static_cast<double>(hessian.rows());
    const Eigen::Index rest = hessian.rows() / count * (count - 1);
    const double least = weak_threshold > 0.0 ? weak_threshold * agreement / static_cast<double>(count) : -no_limit;
    const Eigen::MatrixXd sure = split_directions((hessian - chance).bottomRightCorner(rest, rest), least).sure;
    return solve_symmetric_along(sure, hessian.bottomRightCorner(rest, rest), gradient.tail(rest));
  }

 private:
  static void add_block(const Eigen::MatrixXd& block, Eigen::Index i, Eigen::Index j, Eigen::MatrixXd& sum) {
    const Eigen::Index size = block.rows();
    sum.block(i, i, size, size) += block;
    sum.block(j, j, size, size) += block;
    sum.block(i, j, size, size) -= block;
    sum.block(j, i, size, size) -= block;
  }
};

}  // namespace

std::vector<Pose> adjust_views(const std::vector<AdjustableView>& views, const MotionBasis& motions, double tolerance,
                               double weak_threshold, int num_threads) {
  std::vector<Pose> poses;
  poses.reserve(views.size());
  for (const AdjustableView& view : views) poses.push_back(view.world_from_camera);
  if (views.size() < 3) return poses;
  AlignOptions options;
  options.max_samples = static_cast<int>(registration_limits::view_samples);
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
  std::vector<std::vector<std::uint32_t>> nearest(see_the_same.size());
  for (int iteration = 0; iteration < registration_limits::most_steps; ++iteration) {
    std::vector<Overlap> overlaps(see_the_same.size());
    parallel_for(count * count, 1, num_threads, [&](std::int64_t index) {
      const auto k = static_cast<std::size_t>(index), i = k / views.size(), j = k % views.size();
      if (see_the_same[k] == 0) return;
      const std::vector<Pair> pairs =
          match(sides[i]->source, sides[j]->target, poses[i], poses[j], tolerance, nearest[k]);
      overlaps[k] = Overlap(pairs, motions.center);
      if (pairs.empty()) see_the_same[k] = 0;
    });
    JointEquations equations(freedom * count);
    for (Eigen::Index k = 0; k < count * count; ++k) {
      equations.add(overlaps[static_cast<std::size_t>(k)], motions.twists, k / count, k % count);
    }
    const Eigen::VectorXd solution = equations.solve(count, weak_threshold);
    for (Eigen::Index k = 1; k < count; ++k) {
      Pose& pose = poses[static_cast<std::size_t>(k)];
      pose = orthonormal(motions.apply(solution.segment(freedom * (k - 1), freedom)) * pose);
    }
    if (solution.norm() < registration_limits::still) break;
  }
  return poses;
}

}  // namespace nacre
