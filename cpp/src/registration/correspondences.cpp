#include "registration/correspondences.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/numbers.hpp"
#include "base/parallel.hpp"
#include "base/point_rows.hpp"
#include "base/random.hpp"
#include "base/statistics.hpp"
#include "nacre/normals.hpp"
#include "registration/limits.hpp"
#include "spatial/hilbert_order.hpp"

namespace nacre {
namespace {

bool needs_normals(const AlignOptions& options, bool is_target) {
  return options.method == Metric::symmetric || (options.method != Metric::point_to_point && is_target);
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
  for (std::size_t i = rows.size(); i > 1; --i) std::swap(rows[i - 1], rows[random_bits(seed, i) % i]);
}

double median_spacing(const BlockTree<float>& tree) {
  const std::int64_t step = std::max<std::int64_t>(1, tree.num_points() / registration_limits::spacing_probes);
  std::vector<double> distances;
  for (std::int64_t slot = 0; slot < tree.num_points(); slot += step) {
    Found found[2];
    FewNearest nearest(2, infinity<double>, found);
    tree.search(tree.position(static_cast<std::uint32_t>(slot)), nearest);
    if (nearest.finish() == 2) distances.push_back(std::sqrt(found[1].d2));
  }
  return distances.empty() ? 0.0 : median_of(std::move(distances));
}

double bounding_diameter(const PointsRef& points) {
  Eigen::Vector3f low = Eigen::Vector3f::Constant(infinity<float>), high = -low;
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const Eigen::Vector3f p = points.row(i).transpose();
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return high.x() >= low.x() ? static_cast<double>((high - low).norm()) : 0.0;
}

// In an order in which each point is near the one before.
void sort_in_space(const Points& points, std::vector<std::int32_t>::iterator begin,
                   std::vector<std::int32_t>::iterator end) {
  const std::vector<std::int32_t> rows(begin, end);
  const Points chosen = take_rows<Points>(points, rows);
  for (const std::uint32_t row : spatial_order(chosen.data(), chosen.rows(), 1)) *begin++ = rows[row];
}

}  // namespace

IcpCloud::IcpCloud(const AlignCloud& cloud, const AlignOptions& options, bool is_target)
    : has_estimated_normals(needs_normals(options, is_target) && cloud.normals.rows() == 0) {
  rows = finite_rows(cloud.points, cloud.normals);
  // A gate that somebody has set is meant for the cloud as it is.
  const bool may_thin_out = options.max_points > 0 && !(options.final_distance > 0.0);
  if (may_thin_out) rows = choose(rows, static_cast<std::size_t>(options.max_points), options.seed);
  points = take_rows<Points>(cloud.points, rows);
  normals = take_rows<Points>(cloud.normals, rows);
  sigma = take_rows<Values>(cloud.sigma, rows);
  if (!has_estimated_normals) return;

  NormalOptions normal_options;
  normal_options.num_threads = options.num_threads;
  normals = estimate_normals(points, normal_options);
}

void IcpCloud::keep(const std::vector<std::int32_t>& kept) {
  points = take_rows<Points>(points, kept);
  normals = take_rows<Points>(normals, kept);
  sigma = take_rows<Values>(sigma, kept);
  std::vector<std::int32_t> kept_rows(kept.size());
  for (std::size_t i = 0; i < kept.size(); ++i) kept_rows[i] = rows[static_cast<std::size_t>(kept[i])];
  rows = std::move(kept_rows);
}

IcpSource::IcpSource(const AlignCloud& cloud_in, const AlignOptions& options) : cloud(cloud_in, options, false) {
  std::vector<std::int32_t> rows = finite_rows(cloud.points, cloud.normals);
  auto all = static_cast<std::int64_t>(std::ceil(options.sample_fraction * static_cast<double>(rows.size())));
  if (options.max_samples > 0) all = std::min<std::int64_t>(all, options.max_samples);
  const std::int64_t few = options.coarse_samples > 0 ? options.coarse_samples : all;
  levels = {std::min(few, all), std::min(5 * few, all), all};
  rows = choose(rows, static_cast<std::size_t>(all), options.seed);
  shuffle(rows, options.seed);
  auto begin = rows.begin();
  for (const std::int64_t level : levels) {
    const auto end = rows.begin() + level;
    sort_in_space(cloud.points, begin, end);
    begin = end;
  }
  cloud.keep(rows);
}

IcpSource IcpSource::few(std::size_t level) const {
  IcpSource source = *this;
  std::vector<std::int32_t> rows(static_cast<std::size_t>(levels[level]));
  std::iota(rows.begin(), rows.end(), 0);
  source.cloud.keep(rows);
  std::fill(source.levels.begin() + static_cast<std::ptrdiff_t>(level), source.levels.end(), levels[level]);
  return source;
}

IcpSource IcpSource::part(const std::vector<std::uint8_t>& is_in) const {
  IcpSource source = *this;
  std::vector<std::int32_t> kept;
  std::int64_t i = 0;
  for (std::size_t level = 0; level < levels.size(); ++level) {
    for (; i < levels[level]; ++i) {
      if (is_in[static_cast<std::size_t>(i)] != 0) kept.push_back(static_cast<std::int32_t>(i));
    }
    source.levels[level] = static_cast<std::int64_t>(kept.size());
  }
  source.cloud.keep(kept);
  return source;
}

IcpTarget::IcpTarget(const AlignCloud& cloud, const AlignOptions& options)
    : options_(options),
      cloud_(cloud, options, true),
      tree_(cloud_.points.data(), cloud_.points.rows(), options.num_threads),
      diameter_(bounding_diameter(cloud_.points)),
      spacing_(median_spacing(tree_)) {
  std::vector<std::int32_t> rows(static_cast<std::size_t>(tree_.num_points()));
  for (std::size_t slot = 0; slot < rows.size(); ++slot) {
    rows[slot] = static_cast<std::int32_t>(tree_.id(static_cast<std::uint32_t>(slot)));
  }
  cloud_.keep(rows);
}

std::vector<Pair> IcpTarget::match(const IcpSource& source, std::int64_t count, const Pose& pose, const Gate& gate,
                                   std::vector<std::uint32_t>& nearest) const {
  constexpr std::int64_t block_size = 256;
  const IcpCloud& from = source.cloud;
  const bool compare_normals = cloud_.has_normals() && from.has_normals();
  // Normals that were estimated point to an arbitrary side.
  const bool oriented = !cloud_.has_estimated_normals && !from.has_estimated_normals;
  const bool has_sigma = from.sigma.size() > 0 || cloud_.sigma.size() > 0;
  const bool has_reach = source.reach.size() > 0;
  double widest = gate.distance;
  if (has_reach) {
    const double largest_reach = std::hypot(static_cast<double>(source.reach.head(count).maxCoeff()),
                                            static_cast<double>(source.largest_residual.head(count).maxCoeff()));
    widest = gate.is_smallest ? largest_reach : std::max(widest, largest_reach);
  }

  std::vector<std::vector<Pair>> found(static_cast<std::size_t>((count + block_size - 1) / block_size));
  parallel_blocks(
      count, block_size, options_.num_threads, [&](std::int64_t block, std::int64_t begin, std::int64_t end) {
        float x[block_size], y[block_size], z[block_size], squared_distances[block_size];
        Eigen::Vector3d moved[block_size];
        for (std::int64_t i = begin; i < end; ++i) {
          const std::int64_t k = i - begin;
          moved[k] = pose * from.points.row(i).transpose().cast<double>();
          x[k] = static_cast<float>(moved[k].x());
          y[k] = static_cast<float>(moved[k].y());
          z[k] = static_cast<float>(moved[k].z());
        }
        find_nearest_points(tree_, {x, y, z, nearest.data() + begin, squared_distances, nullptr}, 0, end - begin,
                            widest);

        std::vector<Pair>& pairs = found[static_cast<std::size_t>(block)];
        pairs.reserve(static_cast<std::size_t>(end - begin));
        for (std::int64_t i = begin; i < end; ++i) {
          const std::uint32_t match = nearest[static_cast<std::size_t>(i)];
          if (match == no_slot) continue;
          Pair pair;
          pair.largest_residual = gate.distance;
          pair.p = moved[i - begin];
          pair.q = cloud_.points.row(match).transpose().cast<double>();
          pair.half_difference.setConstant(std::numeric_limits<double>::quiet_NaN());
          if (cloud_.has_normals()) {
            const Eigen::Vector3d target_normal = cloud_.normals.row(match).transpose().cast<double>();
            if (!target_normal.allFinite()) continue;
            pair.normal = target_normal;
            if (compare_normals) {
              Eigen::Vector3d source_normal = pose.linear() * from.normals.row(i).transpose().cast<double>();
              double cosine = source_normal.dot(target_normal);
              if (!oriented && cosine < 0.0) {
                cosine = -cosine;
                source_normal = -source_normal;
              }
              if (cosine < gate.cos_angle) continue;
              pair.half_difference = 0.5 * (source_normal - target_normal);
              if (options_.method == Metric::symmetric) pair.normal = 0.5 * (source_normal + target_normal);
            }
          }
          if (has_reach) {
            pair.largest_residual = static_cast<double>(source.largest_residual[i]);
            const auto reach = static_cast<double>(source.reach[i]), d2 = (pair.p - pair.q).squaredNorm();
            const double across = residual(pair, options_.method);
            const bool is_within = std::abs(across) <= pair.largest_residual && d2 - across * across <= reach * reach;
            if (!is_within && (gate.is_smallest || d2 > gate.distance * gate.distance)) continue;
            // Beyond the model's rim, matches only continue it: the farther along the surface, the less they count.
            if (gate.is_smallest) {
              const double part = (d2 - across * across) / (reach * reach);
              pair.agreement = (1.0 - part) * (1.0 - part);
            }
          }
          if (source.noise.size() > 0) pair.noise = static_cast<double>(source.noise[i]);
          double variance = 0.0;
          if (from.sigma.size() > 0) variance += static_cast<double>(from.sigma[i]) * from.sigma[i];
          if (cloud_.sigma.size() > 0) variance += static_cast<double>(cloud_.sigma[match]) * cloud_.sigma[match];
          pair.weight = pair.agreement * (has_sigma ? 1.0 / variance : 1.0);
          if (pair.weight > 0.0 && std::isfinite(pair.weight)) pairs.push_back(pair);
        }
      });
  std::vector<Pair> pairs;
  pairs.reserve(static_cast<std::size_t>(count));
  for (const std::vector<Pair>& part : found) pairs.insert(pairs.end(), part.begin(), part.end());
  return pairs;
}

}  // namespace nacre
