#include "registration/color.hpp"

#include <algorithm>
#include <cmath>

#include "base/parallel.hpp"
#include "base/se3.hpp"
#include "base/statistics.hpp"
#include "registration/limits.hpp"
#include "registration/weak_directions.hpp"

namespace nacre {
namespace {

using Basis = Eigen::Matrix<double, 6, Eigen::Dynamic>;

// A matched pair: how the brightness changes when the source moves, after the target and after the source.
struct ColorPair {
  Eigen::Vector3d lever;  // of the source point about the centre [m]
  Eigen::Vector3d target_gradient, source_gradient;
  double target_value, source_value;  // at the source point
  double residual = 0.0, weight = 0.0;
};

struct ColorLevel {
  ColorField target, source;
};

class ColorSearch {
 public:
  ColorSearch(const IcpTarget& target, const IcpSource& source, const AlignOptions& options)
      : target_(target), source_(source), options_(options) {
    held_ = options;
    held_.max_distance = gate().distance;
    held_.max_iterations = 6;
  }

  Gate gate() const {
    const double reach = options_.final_distance > 0.0 ? options_.final_distance : 2.5 * target_.spacing();
    return {reach, std::cos(std::min(options_.max_angle, 3.14)), true};
  }

  // Pairs about a centre, their residuals after the best gain and offset, and robust weights.
  std::vector<ColorPair> match(const ColorLevel& level, const Pose& pose, const Eigen::Vector3d& center) {
    std::vector<std::uint32_t> nearest(static_cast<std::size_t>(source_.cloud.points.rows()), no_slot);
    const std::int64_t count = source_.levels.back();
    target_.match(source_, count, pose, gate(), nearest);
    std::vector<ColorPair> pairs;
    for (Eigen::Index i = 0; i < count; ++i) {
      const std::uint32_t slot = nearest[static_cast<std::size_t>(i)];
      if (slot == no_slot) continue;
      const auto k = static_cast<Eigen::Index>(slot);
      ColorPair pair;
      pair.target_gradient = level.target.gradient.row(k).transpose().cast<double>();
      pair.source_gradient = pose.linear() * level.source.gradient.row(i).transpose().cast<double>();
      const Eigen::Vector3d p = pose * source_.cloud.points.row(i).transpose().cast<double>();
      const Eigen::Vector3d q = target_.cloud().points.row(k).transpose().cast<double>();
      pair.lever = p - center;
      // Park, Zhou and Koltun 2017, eq. 11: the target's brightness where the source point falls on its tangent plane.
      pair.target_value = level.target.brightness[k] + pair.target_gradient.dot(p - q);
      pair.source_value = level.source.brightness[i];
      if (std::isfinite(pair.target_value + pair.source_value) && pair.source_gradient.allFinite()) {
        pairs.push_back(pair);
      }
    }
    if (pairs.size() >= registration_limits::least_color_pairs) weigh(pairs);
    return pairs;
  }

  double noise() const { return noise_; }
  double correlation() const { return correlation_; }

  // From a pose at rest on the surface, along the given directions or, without any, all that geometry leaves open.
  IcpResult run(const std::vector<ColorLevel>& levels, const IcpResult& start, const Basis* only) {
    IcpResult result = start;
    for (const ColorLevel& level : levels) {
      for (int i = 0; i < registration_limits::most_color_steps; ++i) {
        const Basis open = only != nullptr ? *only : Basis(result.weak_directions);
        if (open.cols() == 0) break;
        const std::vector<ColorPair> pairs = match(level, result.target_from_source, result.center);
        if (pairs.size() < registration_limits::least_color_pairs) break;
        const double size = step(pairs, open, result);
        const IcpResult back = align_held(target_, source_, result.target_from_source, held_);
        if (back.status == AlignStatus::too_few_pairs) return start;
        const int iterations = result.iterations + back.iterations;
        result = back;
        result.status = start.status;
        result.iterations = iterations;
        if (size < registration_limits::small_color_step * target_.spacing()) break;
      }
    }
    return result;
  }

  static double extent_of(const std::vector<ColorPair>& pairs) {
    double squares = 0.0;
    for (const ColorPair& pair : pairs) squares += pair.lever.squaredNorm();
    return std::sqrt(std::max(squares / static_cast<double>(pairs.size()), 1e-24));
  }

  static Vector6 row_of(const Eigen::Vector3d& lever, const Eigen::Vector3d& gradient, double extent) {
    Vector6 row;
    row << lever.cross(gradient) / extent, gradient;
    return row;
  }

  // Information on the directions that source and target agree on, as if it were of distances: noise cancels, as it
  // does among normals (registration/normal_equations.hpp).
  Eigen::MatrixXd agreed_information(const std::vector<ColorPair>& pairs, const Basis& open,
                                     double distance_noise) const {
    const double extent = extent_of(pairs), scale = distance_noise / noise_;
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(open.cols(), open.cols());
    double weight = 0.0;
    for (const ColorPair& pair : pairs) {
      const Eigen::VectorXd a = open.transpose() * row_of(pair.lever, pair.target_gradient, extent);
      const Eigen::VectorXd b = open.transpose() * row_of(pair.lever, gain_ * pair.source_gradient, extent);
      sum += 0.5 * pair.weight * scale * scale * (a * b.transpose() + b * a.transpose());
      weight += pair.weight;
    }
    return sum / std::max(weight, 1e-12);
  }

 private:
  void weigh(std::vector<ColorPair>& pairs) {
    std::vector<double> target_values, source_values, values;
    for (const ColorPair& pair : pairs) {
      target_values.push_back(pair.target_value);
      source_values.push_back(pair.source_value);
    }
    const double target_middle = median_of(target_values), source_middle = median_of(source_values);
    for (double& value : target_values) value = std::abs(value - target_middle);
    for (double& value : source_values) value = std::abs(value - source_middle);
    // By the spreads: a regression would flatten what does not yet agree.
    const double source_spread = median_of(source_values);
    gain_ = source_spread > 0.0 ? std::clamp(median_of(target_values) / source_spread, 0.25, 4.0) : 1.0;
    for (ColorPair& pair : pairs) {
      pair.residual = pair.target_value - target_middle - gain_ * (pair.source_value - source_middle);
      values.push_back(std::abs(pair.residual));
    }
    noise_ = std::max(registration_limits::least_brightness_noise, mad_to_sigma * median_of(values));
    double products = 0.0, target_squares = 0.0, source_squares = 0.0;
    for (ColorPair& pair : pairs) {
      pair.weight = robust_weight(pair.residual, noise_);
      const double a = pair.target_value - target_middle, b = pair.source_value - source_middle;
      products += pair.weight * a * b;
      target_squares += pair.weight * a * a;
      source_squares += pair.weight * b * b;
    }
    correlation_ = products / std::sqrt(std::max(target_squares * source_squares, 1e-12));
  }

  // Moves the pose along the open directions; returns how far, root mean square over the pairs [m].
  double step(const std::vector<ColorPair>& pairs, const Basis& open, IcpResult& result) const {
    const double extent = extent_of(pairs);
    Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(open.cols(), open.cols());
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(open.cols());
    double weight = 0.0;
    for (const ColorPair& pair : pairs) {
      // The mean of both gradients: efficient second-order minimisation (Malis 2004).
      const Eigen::Vector3d slope = 0.5 * (pair.target_gradient + gain_ * pair.source_gradient);
      const Eigen::VectorXd row = open.transpose() * row_of(pair.lever, slope, extent);
      hessian += pair.weight * row * row.transpose();
      gradient -= pair.weight * pair.residual * row;
      weight += pair.weight;
    }
    hessian.diagonal().array() += 1e-6 * hessian.trace() + 1e-9 * weight;
    Vector6 twist = open * solve_normal_equations(hessian, gradient);
    const double longest = 4.0 * target_.spacing(), length = twist.norm();
    if (length > longest) twist *= longest / length;
    const double size = twist.norm();
    twist.head<3>() /= extent;
    result.target_from_source = motion_about(result.center, twist) * result.target_from_source;
    return size;
  }

  const IcpTarget& target_;
  const IcpSource& source_;
  const AlignOptions& options_;
  AlignOptions held_;  // few steps within the last gate, weak directions held
  double noise_ = 1.0, gain_ = 1.0, correlation_ = 0.0;
};

}  // namespace

IcpResult determine_by_color(const IcpTarget& target, const IcpSource& source, const BrightCloud& target_colors,
                             const BrightCloud& source_colors, const IcpResult& geometric,
                             const AlignOptions& options) {
  if (!target.cloud().has_normals() || !source.cloud.has_normals()) return geometric;
  std::vector<ColorLevel> levels;
  for (const std::int64_t step : {std::int64_t{9}, std::int64_t{1}}) {
    const auto field = [&](const BrightCloud& cloud, const IcpCloud& at) {
      const double reach = 4.0 * std::sqrt(static_cast<double>(step)) * target.spacing();
      return step == 1 ? fit_color_field(cloud, at.points, at.normals, reach, options.num_threads)
                       : fit_color_field(cloud.thinned(step, options.seed), at.points, at.normals, reach,
                                         options.num_threads);
    };
    levels.push_back({field(target_colors, target.cloud()), field(source_colors, source.cloud)});
  }

  ColorSearch search(target, source, options);
  const double distance_noise = std::max(geometric.rmse, 0.1 * target.spacing());
  Basis known;
  IcpResult result = geometric;
  for (const bool restricted : {false, true}) {
    IcpResult found = search.run(levels, geometric, restricted ? &known : nullptr);
    const std::vector<ColorPair> pairs = search.match(levels.back(), found.target_from_source, found.center);
    const bool still_fits = found.num_inliers > 0.8 * geometric.num_inliers;
    if (pairs.size() < registration_limits::least_color_pairs || !still_fits ||
        search.correlation() < registration_limits::least_correlation)
      return geometric;
    const Basis open = found.weak_directions;
    if (open.cols() == 0) return found;
    const Directions directions =
        split_directions(search.agreed_information(pairs, open, distance_noise), options.weak_threshold);
    if (directions.sure.cols() == 0) return geometric;
    known = open * directions.sure;
    result = found;
    result.weak_directions = open * directions.weak;
    const double extent = ColorSearch::extent_of(pairs);
    for (const ColorPair& pair : pairs) {
      Vector6 row = known * (known.transpose() * ColorSearch::row_of(pair.lever, pair.target_gradient, extent));
      row.head<3>() *= extent;
      result.information += pair.weight / (search.noise() * search.noise()) * row * row.transpose();
    }
    if (directions.weak.cols() == 0) break;
  }
  return result;
}

}  // namespace nacre
