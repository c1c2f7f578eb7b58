#include "icp_target.hpp"

#include <algorithm>
#include <cmath>

#include "nacre/normals.hpp"
#include "parallel.hpp"
#include "random.hpp"

namespace nacre {
namespace {

bool needs_normals(const AlignOptions& options, bool is_target) {
  return options.method == Metric::symmetric || (options.method == Metric::point_to_plane && is_target);
}

std::vector<std::int32_t> finite_rows(const PointsRef& points, const PointsRef& normals) {
  std::vector<std::int32_t> rows;
  rows.reserve(static_cast<std::size_t>(points.rows()));
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    // A sum is finite where its terms are (values near the largest float are no coordinates).
    const float sum = points(i, 0) + points(i, 1) + points(i, 2) +
                      (normals.rows() > 0 ? normals(i, 0) + normals(i, 1) + normals(i, 2) : 0.0F);
    if (std::isfinite(sum)) rows.push_back(static_cast<std::int32_t>(i));
  }
  return rows;
}

// One row at random of each of `count` equal parts.
std::vector<std::int32_t> choose(const std::vector<std::int32_t>& rows, std::size_t count, std::uint64_t seed) {
  if (count >= rows.size()) return rows;
  std::vector<std::int32_t> chosen(count);
  const double part = static_cast<double>(rows.size()) / static_cast<double>(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double place = (static_cast<double>(i) + random_uniform(seed, i)) * part;
    chosen[i] = rows[std::min(rows.size() - 1, static_cast<std::size_t>(place))];
  }
  return chosen;
}

// In an order that depends on the seed only.
void shuffle(std::vector<std::int32_t>& rows, std::uint64_t seed) {
  std::vector<std::pair<std::uint64_t, std::int32_t>> keyed(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) keyed[i] = {random_bits(seed, i), rows[i]};
  std::sort(keyed.begin(), keyed.end());
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = keyed[i].second;
}

template <class Matrix>
Matrix rows_of(const Eigen::Ref<const Matrix>& values, const std::vector<std::int32_t>& rows) {
  if (values.rows() == 0) return Matrix(0, values.cols());
  Matrix chosen(static_cast<Eigen::Index>(rows.size()), values.cols());
  for (std::size_t i = 0; i < rows.size(); ++i) chosen.row(static_cast<Eigen::Index>(i)) = values.row(rows[i]);
  return chosen;
}

double median_spacing(const KdTree& tree, const PointsRef& points) {
  constexpr Eigen::Index num_probes = 500;
  std::vector<double> distances;
  for (Eigen::Index i = 0; i < points.rows(); i += std::max<Eigen::Index>(1, points.rows() / num_probes)) {
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
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return high.x() >= low.x() ? static_cast<double>((high - low).norm()) : 0.0;
}

}  // namespace

IcpCloud::IcpCloud(const AlignCloud& cloud, const AlignOptions& options, bool is_target)
    : has_estimated_normals(needs_normals(options, is_target) && cloud.normals.rows() == 0) {
  std::vector<std::int32_t> rows = finite_rows(cloud.points, cloud.normals);
  // A gate that somebody has set is meant for the cloud as it is.
  const bool may_thin_out = options.max_points > 0 && !(options.final_distance > 0.0);
  if (may_thin_out) rows = choose(rows, static_cast<std::size_t>(options.max_points), options.seed);
  points = rows_of<Points>(cloud.points, rows);
  normals = rows_of<Points>(cloud.normals, rows);
  sigma = rows_of<Values>(cloud.sigma, rows);
  if (!has_estimated_normals) return;

  NormalOptions normal_options;
  normal_options.num_threads = options.num_threads;
  normals = estimate_normals(points, normal_options);
}

IcpSource::IcpSource(const AlignCloud& cloud_in, const AlignOptions& options) : cloud(cloud_in, options, false) {
  order = finite_rows(cloud.points, cloud.normals);
  auto count = static_cast<std::size_t>(std::ceil(options.sample_fraction * static_cast<double>(order.size())));
  if (options.max_samples > 0) count = std::min(count, static_cast<std::size_t>(options.max_samples));
  order = choose(order, count, options.seed);
  shuffle(order, options.seed);
}

IcpTarget::IcpTarget(const AlignCloud& cloud, const AlignOptions& options)
    : options_(options),
      cloud_(cloud, options, true),
      tree_(cloud_.points, options.num_threads),
      diameter_(bounding_diameter(cloud_.points)),
      spacing_(median_spacing(tree_, cloud_.points)) {}

std::vector<Pair> IcpTarget::match(const IcpSource& source, const std::vector<std::int32_t>& samples, const Pose& pose,
                                   const Gate& gate, std::vector<std::int32_t>& nearest) const {
  const IcpCloud& from = source.cloud;
  const bool compare_normals = cloud_.has_normals() && from.has_normals();
  // Normals that were estimated point to an arbitrary side.
  const bool oriented = !cloud_.has_estimated_normals && !from.has_estimated_normals;

  std::vector<Pair> pairs(samples.size());
  parallel_for(static_cast<std::int64_t>(samples.size()), 1024, options_.num_threads, [&](std::int64_t i) {
    Pair& pair = pairs[static_cast<std::size_t>(i)];
    pair.weight = 0.0;
    const std::int32_t row = samples[static_cast<std::size_t>(i)];
    pair.p = pose * from.points.row(row).transpose().cast<double>();

    std::int32_t& last = nearest[static_cast<std::size_t>(row)];
    double bound = gate.distance;
    if (last >= 0)
      bound = std::min(bound, (cloud_.points.row(last).transpose().cast<double>() - pair.p).norm() * (1 + 1e-12));
    std::int64_t match = -1;
    double squared_distance = 0.0;
    if (tree_.nearest(pair.p, 1, bound, &match, &squared_distance) == 0) return;
    last = static_cast<std::int32_t>(match);
    pair.q = cloud_.points.row(match).transpose().cast<double>();

    if (cloud_.has_normals()) {
      const Eigen::Vector3d target_normal = cloud_.normals.row(match).transpose().cast<double>();
      if (!target_normal.allFinite()) return;
      pair.normal = target_normal;
      if (compare_normals) {
        Eigen::Vector3d source_normal = pose.linear() * from.normals.row(row).transpose().cast<double>();
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
    if (from.sigma.size() > 0) variance += static_cast<double>(from.sigma[row]) * from.sigma[row];
    if (cloud_.sigma.size() > 0) variance += static_cast<double>(cloud_.sigma[match]) * cloud_.sigma[match];
    const bool has_sigma = from.sigma.size() > 0 || cloud_.sigma.size() > 0;
    pair.weight = has_sigma ? 1.0 / variance : 1.0;
  });
  pairs.erase(std::remove_if(pairs.begin(), pairs.end(),
                             [](const Pair& pair) { return !(pair.weight > 0.0 && std::isfinite(pair.weight)); }),
              pairs.end());
  return pairs;
}

}  // namespace nacre
