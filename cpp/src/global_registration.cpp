#include "nacre/global_registration.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "check.hpp"
#include "free_space.hpp"
#include "icp_target.hpp"
#include "nacre/normals.hpp"
#include "parallel.hpp"
#include "random_choice.hpp"
#include "rotation_grid.hpp"

namespace nacre {
namespace {

constexpr std::int64_t least_points = 30;
constexpr double same_turn = 0.26, same_shift = 0.1;  // [rad], of the smaller diameter: not a different motion

AlignOptions icp_options(const GlobalAlignOptions& options) {
  AlignOptions icp;
  icp.max_points = 0;
  icp.max_samples = options.max_samples;
  icp.coarse_samples = options.coarse_samples;
  icp.seed = options.seed;
  icp.num_threads = 1;  // many registrations run side by side
  return icp;
}

// Some of a cloud's points, denoised: each moved along its normal to the mean of its neighbours.
struct SmoothCloud {
  Points points, normals;  // no normals where nobody knows their sides

  SmoothCloud(const GlobalCloud& cloud, const GlobalAlignOptions& options) {
    Points all_normals = cloud.normals;
    if (cloud.normals.rows() == 0) {
      NormalOptions normal_options;
      normal_options.num_threads = options.num_threads;
      all_normals = estimate_normals(cloud.points, normal_options, cloud.viewpoint.value_or(Eigen::Vector3d::Zero()));
    }
    const std::int64_t most = options.max_points > 0 ? options.max_points : cloud.points.rows();
    const std::vector<std::int64_t> rows = choose_rows(PointsRef(cloud.points), most, options.seed, options.num_threads);
    points.resize(static_cast<Eigen::Index>(rows.size()), 3);
    normals.resize(points.rows(), 3);
    for (Eigen::Index i = 0; i < points.rows(); ++i) {
      points.row(i) = cloud.points.row(rows[static_cast<std::size_t>(i)]);
      normals.row(i) = all_normals.row(rows[static_cast<std::size_t>(i)]);
    }
    if (points.rows() == 0) return;
    const KdTree tree(cloud.points, options.num_threads);
    const Neighbors near = tree.query(PointsRef(points), 24, KdTree::infinity, options.num_threads);
    parallel_for(points.rows(), 256, options.num_threads, [&](std::int64_t i) {
      const Eigen::Vector3f normal = normals.row(i).transpose(), point = points.row(i).transpose();
      float sum = 0.0F, count = 0.0F;
      for (Eigen::Index k = 0; k < near.indices.cols(); ++k) {
        const std::int64_t row = near.indices(i, k);
        if (row >= cloud.points.rows()) break;
        const float cosine = all_normals.row(row).dot(normal.transpose());
        if (!(std::abs(cosine) > 0.8F)) continue;
        sum += (cloud.points.row(row).transpose() - point).dot(normal);
        count += 1.0F;
      }
      if (count > 0.0F) points.row(i) += (sum / count) * normal.transpose();
    });
    if (cloud.normals.rows() == 0 && !cloud.viewpoint) normals.resize(0, 3);
  }
};

// Median distance of near points from each point's tangent plane, as a standard deviation [m].
double noise_of(const IcpCloud& cloud) {
  const KdTree tree(cloud.points, 1);
  constexpr std::int64_t num_probes = 500;
  const Eigen::Index step = std::max<Eigen::Index>(1, cloud.points.rows() / num_probes);
  std::vector<double> offsets;
  for (Eigen::Index i = 0; i < cloud.points.rows(); i += step) {
    std::int64_t rows[4];
    double squares[4];
    const Eigen::Vector3d point = cloud.points.row(i).transpose().cast<double>();
    const Eigen::Vector3d normal = cloud.normals.row(i).transpose().cast<double>();
    const int count = tree.nearest(point, 4, KdTree::infinity, rows, squares);
    for (int k = 0; k < count; ++k) {
      if (rows[k] == i) continue;
      const double offset = (cloud.points.row(rows[k]).transpose().cast<double>() - point).dot(normal);
      if (std::isfinite(offset)) offsets.push_back(std::abs(offset));
    }
  }
  if (offsets.empty()) return 0.0;
  const auto middle = offsets.begin() + static_cast<std::ptrdiff_t>(offsets.size() / 2);
  std::nth_element(offsets.begin(), middle, offsets.end());
  return 1.4826 * *middle / std::sqrt(2.0);
}

// A cloud in both roles: what moves and what others are matched with.
struct Side {
  SmoothCloud smooth;
  IcpSource source, few;
  IcpTarget target;
  std::optional<FreeSpace> seen;
  Eigen::Vector3d middle;  // about that of the whole body
  double noise;

  Side(const GlobalCloud& cloud, const GlobalAlignOptions& options)
      : smooth(cloud, options),
        source(AlignCloud(smooth.points, smooth.normals), icp_options(options)),
        few(source),
        target(AlignCloud(smooth.points, smooth.normals), icp_options(options)),
        middle(Eigen::Vector3d::Zero()),
        noise(source.cloud.points.rows() > 0 ? noise_of(source.cloud) : 0.0) {
    std::vector<std::int32_t> rows(static_cast<std::size_t>(few.levels.front()));
    std::iota(rows.begin(), rows.end(), 0);
    few.cloud.keep(rows);
    few.levels.fill(few.levels.front());
    if (source.cloud.points.rows() > 0) middle = source.cloud.points.colwise().mean().transpose().cast<double>();
    if (!cloud.viewpoint) return;
    seen.emplace(cloud.points, *cloud.viewpoint);
    // What was seen is the front of the body.
    middle += 0.7 * seen->radius() * seen->axis();
  }
};

// What the points of one cloud say about a motion.
struct Counts {
  double all = 0.0, agree = 0.0, free = 0.0, hidden = 0.0, outside = 0.0;

  double consistency() const { return agree > 0.0 ? agree / (agree + free + hidden) : 0.0; }
  double score() const { return all > 0.0 ? (agree - free - 0.5 * hidden) / all : 0.0; }
};

Counts count(const IcpSource& source, const Side& onto, const Pose& pose, const Gate& gate, double margin) {
  const Eigen::Index size = source.cloud.points.rows();
  std::vector<std::uint32_t> nearest(static_cast<std::size_t>(size), no_slot);
  Counts counts;
  counts.all = static_cast<double>(size);
  for (const Pair& pair : onto.target.match(source, size, pose, gate, nearest)) {
    const double ratio = residual(pair, Metric::symmetric) / gate.residual;
    counts.agree += 1.0 - ratio * ratio;
  }
  if (!onto.seen) return counts;
  for (Eigen::Index i = 0; i < size; ++i) {
    const Eigen::Vector3d point = pose * source.cloud.points.row(i).transpose().cast<double>();
    const Eigen::Vector3d normal = pose.linear() * source.cloud.normals.row(i).transpose().cast<double>();
    const FreeSpace::Seen seen = onto.seen->look(point, margin);
    const double facing = normal.dot((onto.seen->viewpoint() - point).normalized());
    if (seen == FreeSpace::Seen::free) counts.free += 1.0;
    if (seen == FreeSpace::Seen::hidden && facing > 0.3) counts.hidden += 1.0;
    if (seen == FreeSpace::Seen::unknown) counts.outside += 1.0;
  }
  return counts;
}

struct Candidate {
  AlignResult alignment;
  double score = -10.0;
  Counts forward, backward;
};

struct Search {
  const Side& source;
  const Side& target;
  const GlobalAlignOptions& options;
  double size;       // the smaller diameter [m]
  double tolerance;  // [m]

  Search(const Side& source_in, const Side& target_in, const GlobalAlignOptions& options_in)
      : source(source_in),
        target(target_in),
        options(options_in),
        size(std::min(source.target.diameter(), target.target.diameter())),
        tolerance(options.tolerance > 0.0
                      ? options.tolerance
                      : std::max(0.003 * size, 3.0 * std::hypot(source.noise, target.noise))) {}

  void judge(Candidate& candidate, bool with_few, double residual) const {
    const double spacing = std::max(source.target.spacing(), target.target.spacing());
    const Gate gate{residual + 2.0 * spacing, std::cos(options.max_angle), residual};
    const double margin = std::max(2.0 * residual, 0.01 * size);
    const Pose& pose = candidate.alignment.target_from_source;
    candidate.forward = count(with_few ? source.few : source.source, target, pose, gate, margin);
    candidate.backward = count(with_few ? target.few : target.source, source, pose.inverse(), gate, margin);
    candidate.score = candidate.forward.score() + candidate.backward.score();
  }

  Candidate start_from(int number) const {
    AlignOptions icp = icp_options(options);
    icp.max_distance = 0.25 * size;
    icp.final_distance = 0.04 * size;
    icp.max_iterations = 12;
    icp.weak_threshold = 0.0;
    Pose guess = Pose::Identity();
    guess.linear() = spread_rotation(number, options.num_rotations).toRotationMatrix();
    guess.translation() = target.middle - guess.linear() * source.middle;
    Candidate candidate;
    candidate.alignment = align_to(target.target, source.few, guess, icp);
    if (candidate.alignment.status != AlignStatus::too_few_pairs) judge(candidate, true, std::max(tolerance, 0.02 * size));
    return candidate;
  }

  void refine(Candidate& candidate) const {
    AlignOptions icp = icp_options(options);
    icp.max_distance = 0.06 * size;
    candidate.alignment = align_to(target.target, source.source, candidate.alignment.target_from_source, icp);
    candidate.score = -10.0;
    if (candidate.alignment.status != AlignStatus::too_few_pairs) judge(candidate, false, tolerance);
  }

  bool is_same(const Pose& a, const Pose& b) const {
    return Eigen::AngleAxisd(a.linear().transpose() * b.linear()).angle() < same_turn &&
           (a * source.middle - b * source.middle).norm() < same_shift * size;
  }

  // The best of each kind, best first.
  std::vector<Candidate> different(std::vector<Candidate> candidates, std::size_t most) const {
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& a, const Candidate& b) { return a.score > b.score; });
    std::vector<Candidate> kept;
    for (const Candidate& candidate : candidates) {
      if (kept.size() == most) break;
      const auto is_known = [&](const Candidate& other) {
        return is_same(candidate.alignment.target_from_source, other.alignment.target_from_source);
      };
      if (std::none_of(kept.begin(), kept.end(), is_known)) kept.push_back(candidate);
    }
    return kept;
  }

  std::vector<Candidate> run() const {
    std::vector<Candidate> candidates(static_cast<std::size_t>(options.num_rotations));
    parallel_for(options.num_rotations, 4, options.num_threads, [&](std::int64_t i) {
      candidates[static_cast<std::size_t>(i)] = start_from(static_cast<int>(i));
    });
    candidates = different(candidates, static_cast<std::size_t>(options.num_candidates));
    parallel_for(static_cast<std::int64_t>(candidates.size()), 1, options.num_threads,
                 [&](std::int64_t i) { refine(candidates[static_cast<std::size_t>(i)]); });
    return different(candidates, 2);
  }
};

}  // namespace

const char* to_string(GlobalAlignStatus status) {
  switch (status) {
    case GlobalAlignStatus::found:
      return "found";
    case GlobalAlignStatus::ambiguous:
      return "ambiguous";
    case GlobalAlignStatus::not_found:
      return "not_found";
    default:
      return "too_few_points";
  }
}

void GlobalAlignOptions::check() const {
  require(num_rotations >= 1, "num_rotations", "at least 1", num_rotations);
  require(num_candidates >= 2, "num_candidates", "at least 2", num_candidates);
  require(tolerance >= 0.0 && std::isfinite(tolerance), "tolerance", "0 (automatic) or a positive distance in metres",
          tolerance);
  require(max_angle > 0.0, "max_angle", "a positive angle in radians", max_angle);
  require(min_overlap >= 0.0 && min_overlap <= 1.0, "min_overlap", "in [0, 1]", min_overlap);
  require(min_consistency >= 0.0 && min_consistency <= 1.0, "min_consistency", "in [0, 1]", min_consistency);
  require(max_rivalry >= 0.0 && max_rivalry <= 1.0, "max_rivalry", "in [0, 1]", max_rivalry);
  require(max_points >= 0, "max_points", "0 (no limit) or more", max_points);
  require(max_samples >= 1, "max_samples", "at least 1", max_samples);
  require(coarse_samples >= 1, "coarse_samples", "at least 1", coarse_samples);
  require(num_threads >= 0, "num_threads", "0 (all) or more", num_threads);
}

GlobalCloud::GlobalCloud(const PointsRef& points_in, const PointsRef& normals_in, const ValuesRef& sigma_in,
                         const std::optional<Eigen::Vector3d>& viewpoint_in)
    : AlignCloud(points_in, normals_in, sigma_in), viewpoint(viewpoint_in) {
  require(!viewpoint || viewpoint->allFinite(), "viewpoint", "finite", "a value that is not");
}

GlobalAlignResult align_global(const GlobalCloud& source_cloud, const GlobalCloud& target_cloud,
                               const GlobalAlignOptions& options) {
  options.check();
  const Side source(source_cloud, options), target(target_cloud, options);
  GlobalAlignResult result;
  result.alignment.rmse = std::numeric_limits<double>::quiet_NaN();
  if (source.source.cloud.points.rows() < least_points || target.source.cloud.points.rows() < least_points) {
    return result;
  }
  const Search search(source, target, options);
  const std::vector<Candidate> best = search.run();
  const Candidate& winner = best.front();
  result.tolerance = search.tolerance;
  result.alignment = winner.alignment;
  result.status = GlobalAlignStatus::not_found;
  const Counts &forward = winner.forward, &backward = winner.backward;
  result.overlap = std::max(forward.agree / std::max(forward.all, 1.0), backward.agree / std::max(backward.all, 1.0));
  result.consistency = std::min(forward.consistency(), backward.consistency());
  result.rivalry = best.size() > 1 && winner.score > 0.0 ? std::max(0.0, best[1].score / winner.score) : 0.0;
  result.debug << forward.agree / forward.all, backward.agree / backward.all, forward.consistency(),
      backward.consistency(), forward.outside / forward.all, backward.outside / backward.all;
  if (result.overlap < options.min_overlap || result.consistency < options.min_consistency) return result;
  const bool is_ambiguous = result.rivalry > options.max_rivalry || winner.alignment.weak_directions.cols() > 0;
  result.status = is_ambiguous ? GlobalAlignStatus::ambiguous : GlobalAlignStatus::found;
  return result;
}

}  // namespace nacre
