#include "keypoints/motion.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "base/parallel.hpp"
#include "base/random.hpp"
#include "keypoints/limits.hpp"

namespace nacre {
namespace {

using namespace keypoints_limits;

// The two least of some distances, and where the first of the least is.
struct Nearest {
  std::int32_t row = -1;
  int distance = std::numeric_limits<int>::max(), second = std::numeric_limits<int>::max();

  void add(std::int32_t candidate, int its_distance) {
    if (its_distance < distance) {
      second = distance;
      distance = its_distance;
      row = candidate;
    } else {
      second = std::min(second, its_distance);
    }
  }
  bool is_clear() const { return distance <= most_differing && distance < clearly_nearest * second; }
};

// Matched points, a pair a column.
struct MatchedPoints {
  Eigen::Matrix3Xd source, target;
  Eigen::ArrayXd tolerance;  // [m]

  Pose motion(const std::vector<Eigen::Index>& columns) const {
    return Pose(Eigen::umeyama(source(Eigen::all, columns), target(Eigen::all, columns), false));
  }
  std::vector<Eigen::Index> explained_by(const Pose& motion) const {
    const Eigen::ArrayXd distance = (motion * source - target).colwise().norm().transpose().array();
    std::vector<Eigen::Index> columns;
    for (Eigen::Index i = 0; i < distance.size(); ++i) {
      if (distance[i] < tolerance[i]) columns.push_back(i);
    }
    return columns;
  }
  // Whether they may be moved onto one another, and fix a motion.
  bool is_rigid(const std::vector<Eigen::Index>& three) const {
    for (std::size_t k = 0; k < three.size(); ++k) {
      const Eigen::Index i = three[k], j = three[(k + 1) % three.size()];
      const double length = (source.col(i) - source.col(j)).norm();
      const double difference = std::abs(length - (target.col(i) - target.col(j)).norm());
      const double lever = least_lever * std::min(source(2, i), source(2, j));
      if (length < lever || difference > tolerance[i] + tolerance[j]) return false;
    }
    return true;
  }
};

MatchedPoints matched_points(const Keypoints& source, const Keypoints& target,
                             const std::vector<KeypointMatch>& matches) {
  const auto count = static_cast<Eigen::Index>(matches.size());
  MatchedPoints pairs{Eigen::Matrix3Xd(3, count), Eigen::Matrix3Xd(3, count), Eigen::ArrayXd(count)};
  for (Eigen::Index i = 0; i < count; ++i) {
    const KeypointMatch& match = matches[static_cast<std::size_t>(i)];
    pairs.source.col(i) = source.points.row(match.source).transpose().cast<double>();
    pairs.target.col(i) = target.points.row(match.target).transpose().cast<double>();
    pairs.tolerance[i] = match_tolerance * std::min(pairs.source(2, i), pairs.target(2, i));
  }
  return pairs;
}

}  // namespace

std::vector<KeypointMatch> match_keypoints(const Keypoints& source, const Keypoints& target, int num_threads) {
  const std::size_t num_targets = target.descriptors.size();
  std::vector<Nearest> nearest(source.descriptors.size()), nearest_source(num_targets);
  std::vector<std::uint16_t> distances(nearest.size() * num_targets);
  parallel_for(static_cast<std::int64_t>(nearest.size()), 16, num_threads, [&](std::int64_t i) {
    const auto row = static_cast<std::size_t>(i);
    for (std::size_t j = 0; j < num_targets; ++j) {
      const int distance = num_differing(source.descriptors[row], target.descriptors[j]);
      distances[row * num_targets + j] = static_cast<std::uint16_t>(distance);
      nearest[row].add(static_cast<std::int32_t>(j), distance);
    }
  });
  for (std::size_t row = 0; row < nearest.size(); ++row) {
    for (std::size_t j = 0; j < num_targets; ++j) {
      nearest_source[j].add(static_cast<std::int32_t>(row), distances[row * num_targets + j]);
    }
  }
  std::vector<KeypointMatch> matches;
  for (std::size_t row = 0; row < nearest.size(); ++row) {
    const auto i = static_cast<std::int32_t>(row), j = nearest[row].row;
    if (nearest[row].is_clear() && nearest_source[static_cast<std::size_t>(j)].row == i) matches.push_back({i, j});
  }
  return matches;
}

std::optional<KeypointMotion> keypoint_motion(const Keypoints& source, const Keypoints& target, std::uint64_t seed,
                                              int num_threads) {
  const std::vector<KeypointMatch> matches = match_keypoints(source, target, num_threads);
  if (matches.size() < least_matches) return std::nullopt;
  const MatchedPoints pairs = matched_points(source, target, matches);
  std::vector<Eigen::Index> best;
  for (int trial = 0; trial < num_trials; ++trial) {
    std::vector<Eigen::Index> three;
    for (int k = 0; k < 3; ++k) {
      const std::uint64_t random = random_bits(seed, static_cast<std::uint64_t>(3 * trial + k));
      three.push_back(static_cast<Eigen::Index>(random % matches.size()));
    }
    if (!pairs.is_rigid(three)) continue;
    std::vector<Eigen::Index> explained = pairs.explained_by(pairs.motion(three));
    if (explained.size() > best.size()) best = std::move(explained);
  }
  // From all that it explains, until those do not grow.
  Pose motion = Pose::Identity();
  for (std::size_t before = 0; best.size() > before && best.size() >= least_matches;) {
    before = best.size();
    motion = pairs.motion(best);
    best = pairs.explained_by(motion);
  }
  if (best.size() < least_matches) return std::nullopt;
  return KeypointMotion{motion, static_cast<std::int64_t>(best.size())};
}

}  // namespace nacre
