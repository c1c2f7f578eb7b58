#include "registration/dominant_planes.hpp"

#include <algorithm>
#include <cmath>

#include "base/limits.hpp"
#include "base/linear_algebra.hpp"
#include "registration/limits.hpp"

namespace nacre {
namespace {

using Pairs = std::vector<const Pair*>;

struct Plane {
  Eigen::Vector3d point, normal;
  double tolerance;  // in largest residuals

  bool holds(const Pair& pair) const {
    return std::abs((pair.q - point).dot(normal)) <= tolerance * pair.largest_residual;
  }
  std::size_t count(const Pairs& pairs) const {
    return static_cast<std::size_t>(
        std::count_if(pairs.begin(), pairs.end(), [&](const Pair* p) { return holds(*p); }));
  }
};

// Every so many, at most as many as given.
Pairs some_of(const Pairs& pairs, std::size_t most) {
  const std::size_t step = (pairs.size() + most - 1) / most;
  Pairs some;
  for (std::size_t i = 0; i < pairs.size(); i += step) some.push_back(pairs[i]);
  return some;
}

// The least-squares plane of the pairs that a plane holds.
Plane refined(const Plane& plane, const Pairs& pairs) {
  double count = 0.0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  for (const Pair* pair : pairs) {
    if (!plane.holds(*pair)) continue;
    const Eigen::Vector3d offset = pair->q - plane.point;
    sum += offset;
    squares += offset * offset.transpose();
    count += 1.0;
  }
  if (count < 3.0) return plane;
  const Eigen::Matrix3d scatter = squares - sum * sum.transpose() / count;
  return {plane.point + sum / count, eigensystem(scatter).vectors.col(0), plane.tolerance};
}

// As RANSAC has it (Fischler and Bolles 1981), but from one point with its normal, and from points in turn.
Plane plane_of_most(const Pairs& pairs, double tolerance) {
  Plane best{pairs.front()->q, pairs.front()->normal, tolerance};
  std::size_t most = 0;
  for (const Pair* pair : some_of(pairs, registration_limits::plane_probes)) {
    const Plane plane = refined({pair->q, pair->normal, tolerance}, pairs);
    const std::size_t count = plane.count(pairs);
    if (count <= most) continue;
    most = count;
    best = plane;
  }
  return refined(best, pairs);
}

}  // namespace

double share_off_planes(const std::vector<Pair>& pairs, double residual_ratio) {
  const double tolerance = std::min(1.0, base_limits::noise_sigmas * residual_ratio);
  Pairs all(pairs.size());
  std::transform(pairs.begin(), pairs.end(), all.begin(), [](const Pair& pair) { return &pair; });
  if (all.empty()) return 0.0;
  all = some_of(all, registration_limits::plane_pairs);
  Pairs off = all;
  for (int planes = 0; planes < 3 && !off.empty(); ++planes) {
    const Plane plane = plane_of_most(off, tolerance);
    off.erase(std::remove_if(off.begin(), off.end(), [&](const Pair* p) { return plane.holds(*p); }), off.end());
  }
  return static_cast<double>(off.size()) / static_cast<double>(all.size());
}

}  // namespace nacre
