#include "registration/icp.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/limits.hpp"
#include "base/numbers.hpp"
#include "base/statistics.hpp"
#include "camera/limits.hpp"
#include "registration/dominant_planes.hpp"
#include "registration/limits.hpp"
#include "registration/scale_check.hpp"

namespace nacre {
namespace {

template <class Value>
double median_over(const std::vector<Pair>& pairs, Value&& value) {
  const std::size_t step = (pairs.size() + registration_limits::scale_probes - 1) / registration_limits::scale_probes;
  std::vector<double> values;
  values.reserve(registration_limits::scale_probes);
  for (std::size_t i = 0; i < pairs.size(); i += step) values.push_back(value(pairs[i]));
  return median_of(std::move(values));
}

// How many points and which gate an iteration uses. The gate starts wide and shrinks to the accuracy of the data, with
// few points; then it stays, and the points become more until the pose is at rest.
class Schedule {
 public:
  Schedule(const IcpTarget& target, const IcpSource& source, const AlignOptions& options)
      : options_(options), source_(source) {
    first_ = options.max_distance > 0.0 ? options.max_distance : registration_limits::first_gate * target.diameter();
    smallest_ =
        options.final_distance > 0.0 ? options.final_distance : camera_limits::surface_spacings * target.spacing();
    set_level(0);
    update_gate(0.0);
  }

  const Gate& gate() const { return gate_; }
  std::int64_t num_samples() const { return source_.levels[level_]; }
  // Whether steps tell more than which points are matched: with the last gate, and more than the fewest points.
  bool is_settled() const { return gate_.is_smallest && num_samples() > source_.levels.front(); }

  // After a step that was small, or not: returns false when the pose is at rest with the last gate and all points.
  bool advance(bool at_rest, double residual_scale) {
    ++iteration_;
    ++iterations_at_level_;
    const bool shrinking = !at_smallest_;
    update_gate(residual_scale);
    if (shrinking) return true;
    const bool is_last = level_ + 1 == source_.levels.size();
    if (at_rest && is_last) return false;
    if (!is_last && (at_rest || iterations_at_level_ >= registration_limits::most_level_steps)) set_level(level_ + 1);
    return true;
  }

  // The last gate with all points, to judge the final pose.
  void finish() { set_level(source_.levels.size() - 1); }

 private:
  void set_level(std::size_t level) {
    while (level + 1 < source_.levels.size() && source_.levels[level + 1] == source_.levels[level]) ++level;
    level_ = level;
    iterations_at_level_ = 0;
  }

  void update_gate(double residual_scale) {
    const double smallest = std::min(first_, options_.final_distance > 0.0
                                                 ? options_.final_distance
                                                 : std::max(smallest_, base_limits::noise_sigmas * residual_scale));
    const double decayed = first_ * std::pow(options_.gate_decay, iteration_);
    gate_.distance = std::max(smallest, decayed);
    at_smallest_ = options_.gate_decay >= 1.0 || decayed <= smallest;
    gate_.is_smallest = at_smallest_;
    const double widening =
        options_.gate_decay < 1.0 ? gate_.distance / first_ / registration_limits::angle_narrowing : 0.0;
    const double angle = options_.max_angle * (1.0 + widening);
    gate_.cos_angle = angle < registration_limits::any_angle ? std::cos(angle) : -2.0;
  }

  const AlignOptions& options_;
  const IcpSource& source_;
  std::size_t level_ = 0;
  int iteration_ = 0, iterations_at_level_ = 0;
  double first_ = 0.0, smallest_ = 0.0;
  bool at_smallest_ = false;
  Gate gate_{};
};

double rmse_of(const std::vector<Pair>& pairs, Metric metric) {
  double squares = 0.0;
  for (const Pair& pair : pairs) squares += residual(pair, metric) * residual(pair, metric);
  return std::sqrt(squares / static_cast<double>(pairs.size()));
}

double residual_ratio_of(const std::vector<Pair>& pairs, Metric metric) {
  double squares = 0.0;
  for (const Pair& pair : pairs) {
    const double ratio = residual(pair, metric) / pair.largest_residual;
    squares += ratio * ratio;
  }
  return std::sqrt(squares / static_cast<double>(pairs.size()));
}

// NaN where the source has no noise.
double residual_sigmas_of(const std::vector<Pair>& pairs, Metric metric) {
  return mad_to_sigma *
         median_over(pairs, [&](const Pair& pair) { return std::abs(residual(pair, metric)) / pair.noise; });
}

// Of pairs in the order of space. Noise is independent from one to the next; the error of a surface that is bent
// another way is not: what neighbours lie off by on average, in units of what noise and the
// model's resolution explain.
double misfit_of(const std::vector<Pair>& pairs, Metric metric) {
  double sum = 0.0, count = 0.0;
  for (std::size_t first = 0; first + registration_limits::cell_pairs <= pairs.size();
       first += registration_limits::cell_pairs) {
    double offset = 0.0, variance = 0.0;
    for (std::size_t i = first; i < first + registration_limits::cell_pairs; ++i) {
      const double coarse = registration_limits::cell_resolution * pairs[i].largest_residual;
      offset += residual(pairs[i], metric);
      variance += pairs[i].agreement / pairs[i].weight + coarse * coarse;
    }
    sum += offset * offset / (static_cast<double>(registration_limits::cell_pairs) * variance);
    count += 1.0;
  }
  return count > 0.0 ? std::sqrt(sum / count) : 0.0;
}

// How many pairs there would be, were their residuals independent.
double num_independent(const std::vector<Pair>& pairs, Metric metric) {
  std::vector<double> whitened;
  for (const Pair& pair : pairs) whitened.push_back(residual(pair, metric) * std::sqrt(pair.weight));
  return static_cast<double>(pairs.size()) / design_effect(whitened);
}

std::size_t least_pairs(std::int64_t num_samples) {
  return static_cast<std::size_t>(std::max<std::int64_t>(6, num_samples / 100));
}

// hold_weak: whether weak directions stay as they are in each step.
IcpResult iterate(const IcpTarget& target, const IcpSource& source, const Pose& initial, const AlignOptions& options,
                  bool hold_weak, const WeakTest& test, const TwistBasis& along = {}) {
  IcpResult result;
  result.weak_test = test;
  result.target_from_source = initial;
  result.rmse = std::numeric_limits<double>::quiet_NaN();

  Schedule schedule(target, source, options);
  std::vector<std::uint32_t> nearest(static_cast<std::size_t>(source.cloud.points.rows()), no_slot);
  const double resolution =
      std::max(registration_limits::still_spacings * target.spacing(), registration_limits::least_resolution);
  Pose pose = initial, best_pose = initial;
  double best_rmse = infinity<double>;
  bool at_rest = false;
  StepBefore before;  // with the same gate and points

  for (int iteration = 0; iteration < options.max_iterations && !at_rest; ++iteration) {
    std::vector<Pair> pairs = target.match(source, schedule.num_samples(), pose, schedule.gate(), nearest);
    if (pairs.size() < least_pairs(schedule.num_samples())) return result;
    const double scale = weight_pairs(pairs, options.method, options.robust, resolution);
    const IcpStep step = solve_step(pairs, options.method, hold_weak ? test : WeakTest(), along, options.num_threads,
                                    schedule.is_settled() ? &before : nullptr);
    if (step.rmse < best_rmse) {
      best_rmse = step.rmse;
      best_pose = pose;
    }
    pose = step.motion * pose;
    result.iterations = iteration + 1;
    // Of six unknowns.
    const bool is_small =
        step.size < resolution || step.reduction < 6.0 * registration_limits::still_uncertainty * scale * scale;
    const std::int64_t num_samples = schedule.num_samples();
    at_rest = !schedule.advance(is_small, scale);
    if (schedule.num_samples() != num_samples) before = {};
  }

  schedule.finish();
  std::vector<Pair> pairs = target.match(source, schedule.num_samples(), pose, schedule.gate(), nearest);
  if (options.keep_best && !(rmse_of(pairs, options.method) <= best_rmse)) {
    pose = best_pose;
    pairs = target.match(source, schedule.num_samples(), pose, schedule.gate(), nearest);
  }
  if (pairs.size() < least_pairs(schedule.num_samples())) return result;
  result.misfit = misfit_of(pairs, options.method);
  result.num_independent = num_independent(pairs, options.method);
  result.residual_sigmas = residual_sigmas_of(pairs, options.method);
  weight_pairs(pairs, options.method, options.robust, resolution);
  const IcpStep last = solve_step(pairs, options.method, test, along, options.num_threads);
  result.size_difference = size_difference(pairs, options.method);
  result.target_from_source = pose;
  result.status = at_rest ? AlignStatus::converged : AlignStatus::max_iterations;
  result.num_inliers = static_cast<int>(pairs.size());
  result.overlap = static_cast<double>(pairs.size()) / static_cast<double>(schedule.num_samples());
  result.rmse = last.rmse;
  result.residual_ratio = residual_ratio_of(pairs, options.method);
  result.normal_information = normal_information(pairs, options.method);
  result.off_planes = share_off_planes(pairs, result.residual_ratio);
  result.center = last.center;
  result.extent = last.extent;
  const double variance = std::max(last.variance, resolution * resolution);
  result.information = last.hessian * (result.num_independent / static_cast<double>(pairs.size())) / variance;
  result.shape_information = last.shape / variance;
  result.weak_directions = last.weak_directions;
  result.signal = last.signal;
  result.weakest = last.weakest;
  result.weakest_part = last.weakest_part;
  return result;
}

}  // namespace

double design_effect(const std::vector<double>& residuals) {
  double of_sums = 0.0, of_all = 0.0;
  for (std::size_t first = 0; first + registration_limits::cell_pairs <= residuals.size();
       first += registration_limits::cell_pairs) {
    double sum = 0.0;
    for (std::size_t i = first; i < first + registration_limits::cell_pairs; ++i) {
      sum += residuals[i];
      of_all += residuals[i] * residuals[i];
    }
    of_sums += sum * sum;
  }
  return of_all > 0.0 ? std::max(1.0, of_sums / of_all) : 1.0;
}

double weight_pairs(std::vector<Pair>& pairs, Metric metric, bool robust, double floor) {
  const double median_weight = median_over(pairs, [](const Pair& pair) { return pair.weight; });
  for (Pair& pair : pairs) pair.weight /= median_weight;
  const auto whitened = [&](const Pair& pair) { return std::abs(residual(pair, metric)) * std::sqrt(pair.weight); };
  const double scale = std::max(floor, mad_to_sigma * median_over(pairs, whitened));
  if (robust) {
    for (Pair& pair : pairs) {
      const double agreement = robust_weight(whitened(pair), scale);
      pair.agreement *= agreement;
      pair.weight *= agreement;
    }
  }
  return scale;
}

IcpResult align_to(const IcpTarget& target, const IcpSource& source, const Pose& initial, const AlignOptions& options) {
  // What pairs know of a direction shows at the end only: while source and target are apart their normals disagree.
  const WeakTest test{options.weak_threshold};
  IcpResult free = iterate(target, source, initial, options, false, test);
  if (free.status != AlignStatus::too_few_pairs && free.weak_directions.cols() == 0) return free;
  return iterate(target, source, initial, options, true, test);
}

IcpResult align_held(const IcpTarget& target, const IcpSource& source, const Pose& initial, const AlignOptions& options,
                     const WeakTest& weak_test) {
  return iterate(target, source, initial, options, true, weak_test);
}

IcpResult align_along(const TwistBasis& directions, const IcpTarget& target, const IcpSource& source,
                      const Pose& initial, const AlignOptions& options) {
  return iterate(target, source, initial, options, false, {options.weak_threshold}, directions);
}

TwistBasis motions_on_plane(const Eigen::Vector3d& normal) {
  TwistBasis twists = TwistBasis::Zero(6, 3);
  const Eigen::Vector3d x = normal.unitOrthogonal();
  twists.col(0).head<3>() = normal;
  twists.col(1).tail<3>() = x;
  twists.col(2).tail<3>() = normal.cross(x);
  return twists;
}

}  // namespace nacre
