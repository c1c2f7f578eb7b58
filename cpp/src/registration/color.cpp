#include "registration/color.hpp"

#include <algorithm>
#include <cmath>

#include "base/limits.hpp"
#include "base/parallel.hpp"
#include "base/se3.hpp"
#include "base/statistics.hpp"
#include "camera/limits.hpp"
#include "registration/limits.hpp"
#include "registration/open_directions.hpp"

namespace nacre {
namespace {

// The brightness of both sides at a source point.
struct Brightness {
  double target, source;
};

struct ColorLevel {
  ColorField target, source;
};

class ColorSearch : public OpenDirectionSearch {
 public:
  ColorSearch(const IcpTarget& target, const IcpSource& source, std::vector<ColorLevel> levels,
              const AlignOptions& options)
      : target_(target), source_(source), few_(source.few()), levels_(std::move(levels)), options_(options) {
    held_ = options;
    held_.max_distance = gate().distance;
    held_.max_iterations = 6;
  }

  OpenFit fit(const IcpResult& geometric, const TwistBasis* only) override {
    OpenFit fit;
    fit.result = run(geometric, only);
    fit.rows = match(levels_.back(), fit.result.target_from_source, fit.result.center);
    fit.extent = extent_of(fit.rows);
    fit.noise = noise_;
    distance_noise_ = std::max(geometric.rmse, 0.1 * target_.spacing());
    fit.agrees = fit.rows.size() >= base_limits::least_points;
    return fit;
  }

  // Information as if it were of distances, per pair.
  Directions determined(const OpenFit& fit, const TwistBasis& open) const override {
    double weight = 0.0;
    for (const MotionRow& row : fit.rows) weight += row.weight;
    const Eigen::MatrixXd information = agreed_information(fit.rows, open, fit.extent, distance_noise_ / noise_);
    return split_directions(information / std::max(weight, 1e-12), options_.weak_threshold);
  }

 private:
  Gate gate() const {
    const double reach =
        options_.final_distance > 0.0 ? options_.final_distance : camera_limits::surface_spacings * target_.spacing();
    return {reach, std::cos(std::min(options_.max_angle, 3.14)), true};
  }

  // Pairs about a centre, their residuals after the best gain and offset, and robust weights.
  std::vector<MotionRow> match(ColorLevel& level, const Pose& pose, const Eigen::Vector3d& center) {
    std::vector<std::uint32_t> nearest(static_cast<std::size_t>(source_.cloud.points.rows()), no_slot);
    const std::int64_t count = source_.levels.back();
    target_.match(source_, count, pose, gate(), nearest);
    std::vector<std::uint32_t> matched_targets, matched_sources;
    for (Eigen::Index i = 0; i < count; ++i) {
      const std::uint32_t slot = nearest[static_cast<std::size_t>(i)];
      if (slot == no_slot) continue;
      matched_targets.push_back(slot);
      matched_sources.push_back(static_cast<std::uint32_t>(i));
    }
    level.target.fit(matched_targets);
    level.source.fit(matched_sources);
    std::vector<MotionRow> rows;
    std::vector<Brightness> values;
    for (std::size_t match = 0; match < matched_sources.size(); ++match) {
      const auto i = static_cast<Eigen::Index>(matched_sources[match]);
      const auto k = static_cast<Eigen::Index>(matched_targets[match]);
      MotionRow pair;
      pair.target_gradient = level.target.gradient(k);
      pair.source_gradient = pose.linear() * level.source.gradient(i);
      const Eigen::Vector3d p = pose * source_.cloud.points.row(i).transpose().cast<double>();
      const Eigen::Vector3d q = target_.cloud().points.row(k).transpose().cast<double>();
      pair.lever = p - center;
      // Park, Zhou and Koltun 2017, eq. 11: the target's brightness where the source point falls on its tangent plane.
      const Brightness value{level.target.brightness(k) + pair.target_gradient.dot(p - q), level.source.brightness(i)};
      if (!std::isfinite(value.target + value.source)) continue;
      rows.push_back(pair);
      values.push_back(value);
    }
    if (rows.size() >= base_limits::least_points) weigh(values, rows);
    return rows;
  }

  IcpResult run(const IcpResult& start, const TwistBasis* only) {
    IcpResult result = start;
    bool has_moved = false;
    for (ColorLevel& level : levels_) {
      for (int i = 0; i < registration_limits::most_steps; ++i) {
        const TwistBasis open = only != nullptr ? *only : TwistBasis(result.weak_directions);
        if (open.cols() == 0) break;
        const std::vector<MotionRow> rows = match(level, result.target_from_source, result.center);
        if (rows.size() < base_limits::least_points) break;
        const double size = step(rows, open, result);
        has_moved = true;
        if (!return_to_surface(target_, few_, held_, result)) return start;
        if (size < registration_limits::small_color_step * target_.spacing()) break;
      }
    }
    if (has_moved && !return_to_surface(target_, source_, held_, result)) return start;
    return result;
  }

  static double extent_of(const std::vector<MotionRow>& rows) {
    double squares = 0.0;
    for (const MotionRow& row : rows) squares += row.lever.squaredNorm();
    return std::sqrt(std::max(squares / std::max(1.0, static_cast<double>(rows.size())), 1e-24));
  }

  void weigh(const std::vector<Brightness>& brightness, std::vector<MotionRow>& rows) {
    std::vector<double> target_values, source_values, values;
    for (const Brightness& value : brightness) {
      target_values.push_back(value.target);
      source_values.push_back(value.source);
    }
    const double target_middle = median_of(target_values), source_middle = median_of(source_values);
    for (double& value : target_values) value = std::abs(value - target_middle);
    for (double& value : source_values) value = std::abs(value - source_middle);
    // By the spreads: a regression would flatten what does not yet agree.
    const double source_spread = median_of(source_values);
    const double gain = source_spread > 0.0 ? std::clamp(median_of(target_values) / source_spread, 0.25, 4.0) : 1.0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      rows[i].residual = brightness[i].target - target_middle - gain * (brightness[i].source - source_middle);
      rows[i].source_gradient = gain * rows[i].source_gradient;
      rows[i].gradient = 0.5 * (rows[i].target_gradient + rows[i].source_gradient);
      values.push_back(std::abs(rows[i].residual));
    }
    noise_ = std::max(registration_limits::least_brightness_noise, mad_to_sigma * median_of(values));
    for (MotionRow& row : rows) row.weight = robust_weight(row.residual, noise_);
  }

  // Moves the pose along the open directions; returns how far, root mean square over the pairs [m].
  double step(const std::vector<MotionRow>& rows, const TwistBasis& open, IcpResult& result) const {
    const double extent = extent_of(rows);
    Vector6 twist = gauss_newton_step(rows, open, extent, base_limits::damping);
    const double size = twist.norm();
    twist.head<3>() /= extent;
    result.target_from_source = motion_about(result.center, twist) * result.target_from_source;
    return size;
  }

  const IcpTarget& target_;
  const IcpSource& source_;
  const IcpSource few_;
  std::vector<ColorLevel> levels_;
  const AlignOptions& options_;
  AlignOptions held_;  // few steps within the last gate, weak directions held
  double noise_ = 1.0, distance_noise_ = 1.0;
};

}  // namespace

IcpResult determine_by_color(const IcpTarget& target, const IcpSource& source, const BrightCloud& target_colors,
                             const BrightCloud& source_colors, const IcpResult& geometric,
                             const AlignOptions& options) {
  if (!target.cloud().has_normals() || !source.cloud.has_normals()) return geometric;
  // As dense as the target: a gradient is that of the surroundings of a point.
  const std::int64_t denser = source_colors.points.rows() / std::max<std::int64_t>(1, target_colors.points.rows());
  std::vector<ColorLevel> levels;
  for (const std::int64_t step : {std::int64_t{9}, std::int64_t{1}}) {
    const auto field = [&](const BrightCloud& cloud, std::int64_t thinning, const IcpCloud& at) {
      const double reach = 4.0 * std::sqrt(static_cast<double>(step)) * target.spacing();
      return ColorField(cloud.thinned(thinning, options.seed), at.points, at.normals, reach, options.num_threads);
    };
    levels.push_back({field(target_colors, step, target.cloud()),
                      field(source_colors, step * std::max<std::int64_t>(1, denser), source.cloud)});
  }

  ColorSearch search(target, source, std::move(levels), options);
  return determine_open_directions(geometric, search);
}

}  // namespace nacre
