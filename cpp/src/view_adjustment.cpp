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
constexpr double first_gate = 2.0, last_gate = 1.0, decay = 0.8;  // in tolerances

struct Side {
  IcpSource source;
  IcpTarget target;
};

}  // namespace

std::vector<Pose> adjust_views(const std::vector<ObjectView>& views, int num_threads) {
  std::vector<Pose> poses;
  for (const ObjectView& view : views) poses.push_back(view.world_from_camera);
  if (views.size() < 3) return poses;
  AlignOptions options;
  options.max_samples = static_cast<int>(num_samples);
  options.num_threads = 1;
  std::vector<std::unique_ptr<Side>> sides(views.size());
  parallel_for(static_cast<std::int64_t>(views.size()), 1, num_threads, [&](std::int64_t i) {
    const ObjectView& view = views[static_cast<std::size_t>(i)];
    const AlignCloud cloud(view.points, view.normals);
    sides[static_cast<std::size_t>(i)] =
        std::make_unique<Side>(Side{IcpSource(cloud, options), IcpTarget(cloud, options)});
  });
  const Eigen::Vector3d normal = poses.front().linear() * views.front().support.normal;
  const PlaneMotion motion{normal, poses.front() * views.front().body()};
  const double tolerance = std::max_element(views.begin(), views.end(), [](const ObjectView& a, const ObjectView& b) {
                             return a.tolerance < b.tolerance;
                           })->tolerance;

  const auto count = static_cast<Eigen::Index>(views.size());
  double gate = first_gate;
  for (int iteration = 0; iteration < num_iterations; ++iteration) {
    std::vector<std::vector<Pair>> matches(views.size() * views.size());
    parallel_for(count * count, 1, num_threads, [&](std::int64_t k) {
      const auto i = static_cast<std::size_t>(k / count), j = static_cast<std::size_t>(k % count);
      if (i == j) return;
      const IcpSource& source = sides[i]->source;
      std::vector<std::uint32_t> nearest(static_cast<std::size_t>(source.cloud.points.rows()), no_slot);
      std::vector<Pair> pairs =
          sides[j]->target.match(source, source.cloud.points.rows(), poses[j].inverse() * poses[i],
                                 {gate * tolerance, cos_angle, false}, nearest);
      if (pairs.size() < least_pairs) return;
      weight_robustly(pairs, 0.05 * tolerance);
      for (Pair& pair : pairs) {
        pair.p = poses[j] * pair.p;
        pair.q = poses[j] * pair.q;
        pair.normal = poses[j].linear() * pair.normal;
      }
      matches[static_cast<std::size_t>(k)] = std::move(pairs);
    });
    // Each residual grows with the motion of one view and shrinks with that of the other.
    Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(3 * count, 3 * count);
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(3 * count);
    for (Eigen::Index k = 0; k < count * count; ++k) {
      const Eigen::Index i = 3 * (k / count), j = 3 * (k % count);
      for (const Pair& pair : matches[static_cast<std::size_t>(k)]) {
        const Eigen::Vector3d row = motion.row(pair);
        const Eigen::Matrix3d square = pair.weight * row * row.transpose();
        const Eigen::Vector3d side = pair.weight * residual(pair, Metric::symmetric) * row;
        hessian.block<3, 3>(i, i) += square;
        hessian.block<3, 3>(j, j) += square;
        hessian.block<3, 3>(i, j) -= square;
        hessian.block<3, 3>(j, i) -= square;
        gradient.segment<3>(i) -= side;
        gradient.segment<3>(j) += side;
      }
    }
    hessian.diagonal().array() += 1e-6 * hessian.trace() / static_cast<double>(3 * count);
    const Eigen::Index rest = 3 * (count - 1);
    const Eigen::VectorXd solution =
        Eigen::MatrixXd(hessian.bottomRightCorner(rest, rest)).ldlt().solve(gradient.tail(rest));
    for (Eigen::Index k = 1; k < count; ++k) {
      Pose& pose = poses[static_cast<std::size_t>(k)];
      pose = orthonormal(motion.apply(solution.segment<3>(3 * (k - 1))) * pose);
    }
    gate = std::max(last_gate, decay * gate);
  }
  return poses;
}

}  // namespace nacre
