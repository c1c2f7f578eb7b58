#include "icp_target.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "nacre/normals.hpp"
#include "parallel.hpp"
#include "random.hpp"

namespace nacre {
namespace {

bool needs_normals(const AlignOptions& options, bool is_target) {
  return options.method == Metric::symmetric || (options.method == Metric::point_to_plane && is_target);
}

Points normals_if_needed(const AlignCloud& cloud, const AlignOptions& options, bool is_target) {
  if (cloud.normals.rows() == cloud.points.rows() || !needs_normals(options, is_target)) return Points();
  NormalOptions normal_options;
  normal_options.num_threads = options.num_threads;
  return estimate_normals(cloud.points, normal_options);
}

// `count` of the rows, chosen and ordered by random numbers that depend on the seed and the row only.
std::vector<std::int32_t> choose(const std::vector<std::int32_t>& rows, std::size_t count, std::uint64_t seed) {
  std::vector<std::pair<std::uint64_t, std::int32_t>> keyed;
  keyed.reserve(rows.size());
  for (const std::int32_t row : rows) keyed.emplace_back(random_bits(seed, static_cast<std::uint64_t>(row)), row);
  count = std::min(count, keyed.size());
  const auto end = keyed.begin() + static_cast<std::ptrdiff_t>(count);
  std::nth_element(keyed.begin(), end, keyed.end());
  std::sort(keyed.begin(), end);
  std::vector<std::int32_t> chosen(count);
  for (std::size_t i = 0; i < count; ++i) chosen[i] = keyed[i].second;
  return chosen;
}

double median_spacing(const KdTree& tree, const PointsRef& points) {
  constexpr std::size_t num_probes = 500;
  std::vector<Eigen::Index> finite;
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    if (points.row(i).allFinite()) finite.push_back(i);
  }
  std::vector<double> distances;
  for (std::size_t probe = 0; probe < finite.size(); probe += std::max<std::size_t>(1, finite.size() / num_probes)) {
    const Eigen::Index i = finite[probe];
    std::int64_t indices[2];
    double squared[2];
    if (tree.nearest(points.row(i).transpose().cast<double>(), 2, KdTree::infinity, indices, squared) == 2) {
      distances.push_back(std::sqrt(squared[1]));
    }
  }
  if (distances.empty()) return 0.0;
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  return *middle;
}

double bounding_diameter(const PointsRef& points) {
  Eigen::Vector3f low = Eigen::Vector3f::Constant(std::numeric_limits<float>::infinity()), high = -low;
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const Eigen::Vector3f p = points.row(i).transpose();
    if (!p.allFinite()) continue;
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return high.x() >= low.x() ? static_cast<double>((high - low).norm()) : 0.0;
}

}  // namespace

IcpSource::IcpSource(const AlignCloud& cloud, const AlignOptions& options)
    : points(cloud.points),
      estimated_normals(normals_if_needed(cloud, options, false)),
      normals(estimated_normals.rows() > 0 ? PointsRef(estimated_normals) : cloud.normals),
      sigma(cloud.sigma) {
  std::vector<std::int32_t> usable;
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    if (points.row(i).allFinite() && (!has_normals() || normals.row(i).allFinite())) {
      usable.push_back(static_cast<std::int32_t>(i));
    }
  }
  auto count = static_cast<std::size_t>(std::ceil(options.sample_fraction * static_cast<double>(usable.size())));
  if (options.max_samples > 0) count = std::min(count, static_cast<std::size_t>(options.max_samples));
  order = choose(usable, count, options.seed);
}

IcpTarget::IcpTarget(const AlignCloud& cloud, const AlignOptions& options)
    : options_(options),
      points_(cloud.points),
      estimated_normals_(normals_if_needed(cloud, options, true)),
      normals_(estimated_normals_.rows() > 0 ? PointsRef(estimated_normals_) : cloud.normals),
      sigma_(cloud.sigma),
      tree_(points_, options.num_threads),
      diameter_(bounding_diameter(points_)),
      spacing_(median_spacing(tree_, points_)) {}

std::vector<Pair> IcpTarget::match(const IcpSource& source, const std::vector<std::int32_t>& samples, const Pose& pose,
                                   const Gate& gate, std::vector<std::int32_t>& nearest) const {
  const bool target_has_normals = normals_.rows() == points_.rows();
  const bool compare_normals = target_has_normals && source.has_normals();
  // Normals that were estimated here point to an arbitrary side.
  const bool oriented = estimated_normals_.rows() == 0 && source.estimated_normals.rows() == 0;

  std::vector<Pair> pairs(samples.size());
  parallel_for(static_cast<std::int64_t>(samples.size()), 1024, options_.num_threads, [&](std::int64_t i) {
    Pair& pair = pairs[static_cast<std::size_t>(i)];
    pair.weight = 0.0;
    const std::int32_t row = samples[static_cast<std::size_t>(i)];
    pair.p = pose * source.points.row(row).transpose().cast<double>();

    std::int32_t& last = nearest[static_cast<std::size_t>(row)];
    double bound = gate.distance;
    if (last >= 0)
      bound = std::min(bound, (points_.row(last).transpose().cast<double>() - pair.p).norm() * (1 + 1e-12));
    std::int64_t match = -1;
    double squared_distance = 0.0;
    if (tree_.nearest(pair.p, 1, bound, &match, &squared_distance) == 0) return;
    last = static_cast<std::int32_t>(match);
    pair.q = points_.row(match).transpose().cast<double>();

    if (target_has_normals) {
      const Eigen::Vector3d target_normal = normals_.row(match).transpose().cast<double>();
      if (!target_normal.allFinite()) return;
      pair.normal = target_normal;
      if (compare_normals) {
        Eigen::Vector3d source_normal = pose.linear() * source.normals.row(row).transpose().cast<double>();
        double cosine = source_normal.dot(target_normal);
        if (!oriented && cosine < 0.0) {
          cosine = -cosine;
          source_normal = -source_normal;
        }
        if (cosine < gate.cos_angle) return;
        if (options_.method == Metric::symmetric) pair.normal = 0.5 * (source_normal + target_normal);
      }
    }
    if (std::abs(nacre::residual(pair, options_.method)) > gate.residual) return;
    double variance = 0.0;
    if (source.sigma.size() > 0) variance += static_cast<double>(source.sigma[row]) * source.sigma[row];
    if (sigma_.size() > 0) variance += static_cast<double>(sigma_[match]) * sigma_[match];
    const bool has_sigma = source.sigma.size() > 0 || sigma_.size() > 0;
    pair.weight = has_sigma ? 1.0 / variance : 1.0;
  });
  pairs.erase(std::remove_if(pairs.begin(), pairs.end(),
                             [](const Pair& pair) { return !(pair.weight > 0.0 && std::isfinite(pair.weight)); }),
              pairs.end());
  return pairs;
}

}  // namespace nacre
