#include "registration/paper_icp.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "base/numbers.hpp"
#include "base/random.hpp"
#include "nacre/kdtree.hpp"
#include "nacre/normals.hpp"
#include "registration/dominant_planes.hpp"
#include "registration/limits.hpp"

namespace nacre {
namespace {

Points known_or_estimated(const AlignCloud& cloud, int num_threads) {
  if (cloud.normals.rows() == cloud.points.rows()) return cloud.normals;
  NormalOptions options;
  options.num_threads = num_threads;
  return estimate_normals(cloud.points, options);
}

double diameter(const PointsRef& points) {
  Eigen::Array3f low = Eigen::Array3f::Constant(infinity<float>), high = -low;
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    if (!points.row(i).allFinite()) continue;
    low = low.min(points.row(i).transpose().array());
    high = high.max(points.row(i).transpose().array());
  }
  return high.x() >= low.x() ? static_cast<double>((high - low).matrix().norm()) : 0.0;
}

class PaperIcp {
 public:
  PaperIcp(const AlignCloud& source, const AlignCloud& target, const AlignOptions& options)
      : options_(options),
        source_(source.points),
        target_(target.points),
        source_normals_(known_or_estimated(source, options.num_threads)),
        target_normals_(known_or_estimated(target, options.num_threads)),
        are_oriented_(source.normals.rows() > 0 && target.normals.rows() > 0),
        tree_(target.points, options.num_threads),
        reach_(diameter(target.points)),
        gate_(options.max_distance > 0.0 ? options.max_distance : registration_limits::first_gate * reach_),
        least_cosine_(options.max_angle < 3.14159 ? std::cos(options.max_angle) : -2.0) {
    for (Eigen::Index i = 0; i < source_.rows(); ++i) {
      if (source_.row(i).allFinite() && source_normals_.row(i).allFinite()) usable_.push_back(i);
    }
    num_drawn_ = static_cast<std::size_t>(std::lround(options.sample_fraction * static_cast<double>(usable_.size())));
    if (options.max_samples > 0) num_drawn_ = std::min(num_drawn_, static_cast<std::size_t>(options.max_samples));
    num_drawn_ = std::min(std::max(num_drawn_, registration_limits::least_pairs_of_paper_icp), usable_.size());
  }

  IcpResult from(const Pose& initial) const {
    Iterate best, now;
    now.pose = initial;
    for (; now.iteration <= options_.max_iterations; ++now.iteration) {
      now.pairs = match(draw(now.iteration), now.pose);
      if (now.pairs.size() < registration_limits::least_pairs_of_paper_icp) break;
      now.rmse = rmse_of(now.pairs);
      if (!options_.keep_best || now.rmse < best.rmse) best = now;
      const IcpStep next = step(now.pairs);
      best.is_at_rest = next.size < registration_limits::rest_of_paper_icp * gate_;
      if (best.is_at_rest) break;
      now.pose = next.motion * now.pose;
    }
    return result_of(best, initial);
  }

 private:
  struct Iterate {
    Pose pose = Pose::Identity();
    std::vector<Pair> pairs;
    double rmse = infinity<double>;
    int iteration = 0;
    bool is_at_rest = false;
  };

  std::vector<Eigen::Index> draw(int iteration) const {
    const std::uint64_t seed = random_bits(options_.seed, static_cast<std::uint64_t>(iteration));
    std::vector<Eigen::Index> rows = usable_;
    for (std::size_t i = 0; i < num_drawn_; ++i) {
      std::swap(rows[i], rows[i + random_bits(seed, i) % (rows.size() - i)]);
    }
    rows.resize(num_drawn_);
    return rows;
  }

  std::vector<Pair> match(const std::vector<Eigen::Index>& rows, const Pose& pose) const {
    Points moved(static_cast<Eigen::Index>(rows.size()), 3);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const Eigen::Vector3d p = pose * source_.row(rows[i]).transpose().cast<double>();
      moved.row(static_cast<Eigen::Index>(i)) = p.transpose().cast<float>();
    }
    const Neighbors nearest = tree_.query(moved, 1, reach_, options_.num_threads);
    std::vector<Pair> pairs;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const Eigen::Index match = nearest.indices(static_cast<Eigen::Index>(i), 0);
      if (match >= target_.rows()) continue;
      const Eigen::Vector3d normal = target_normals_.row(match).transpose().cast<double>();
      if (!normal.allFinite()) continue;
      Eigen::Vector3d facing = pose.linear() * source_normals_.row(rows[i]).transpose().cast<double>();
      if (!are_oriented_ && facing.dot(normal) < 0.0) facing = -facing;
      if (!(facing.dot(normal) >= least_cosine_)) continue;
      Pair pair;
      pair.p = pose * source_.row(rows[i]).transpose().cast<double>();
      pair.q = target_.row(match).transpose().cast<double>();
      pair.normal = normal;
      pair.half_difference = 0.5 * (facing - normal);
      pair.weight = 1.0;
      pair.largest_residual = gate_;
      if (std::abs(residual(pair, Metric::point_to_plane)) < gate_) pairs.push_back(pair);
    }
    return pairs;
  }

  static double rmse_of(const std::vector<Pair>& pairs) {
    double sum = 0.0;
    for (const Pair& pair : pairs) sum += std::pow(residual(pair, Metric::point_to_plane), 2);
    return std::sqrt(sum / static_cast<double>(pairs.size()));
  }

  IcpStep step(const std::vector<Pair>& pairs) const {
    return solve_step(pairs, Metric::point_to_plane, {options_.weak_threshold}, {}, options_.num_threads);
  }

  IcpResult result_of(const Iterate& best, const Pose& initial) const {
    IcpResult result;
    result.target_from_source = initial;
    result.rmse = std::numeric_limits<double>::quiet_NaN();
    if (best.pairs.empty()) return result;
    const IcpStep last = step(best.pairs);
    result.target_from_source = best.pose;
    result.status = best.is_at_rest ? AlignStatus::converged : AlignStatus::max_iterations;
    result.iterations = std::min(best.iteration, options_.max_iterations);
    result.num_inliers = static_cast<int>(best.pairs.size());
    result.overlap = static_cast<double>(best.pairs.size()) / static_cast<double>(num_drawn_);
    result.rmse = last.rmse;
    result.residual_ratio = last.rmse / gate_;
    result.normal_information = normal_information(best.pairs, Metric::point_to_plane);
    result.off_planes = share_off_planes(best.pairs, result.residual_ratio);
    result.size_difference = size_difference(best.pairs, Metric::point_to_plane);
    result.center = last.center;
    const double variance = std::max(last.variance, 1e-18);
    result.information = last.hessian / variance;
    result.shape_information = last.shape / variance;
    result.weak_directions = last.weak_directions;
    return result;
  }

  const AlignOptions& options_;
  const PointsRef &source_, &target_;
  Points source_normals_, target_normals_;
  bool are_oriented_;
  KdTree tree_;
  double reach_;  // what is farther from a target than it is wide [m] is none of it
  double gate_, least_cosine_;
  std::vector<Eigen::Index> usable_;  // source points with a normal
  std::size_t num_drawn_ = 0;
};

}  // namespace

IcpResult align_as_in_paper(const AlignCloud& source, const AlignCloud& target, const Pose& initial,
                            const AlignOptions& options) {
  return PaperIcp(source, target, options).from(initial);
}

}  // namespace nacre
