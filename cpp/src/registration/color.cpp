#include "registration/color.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "base/limits.hpp"
#include "base/parallel.hpp"
#include "base/se3.hpp"
#include "base/statistics.hpp"
#include "base/step_length.hpp"
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

}  // namespace

class ColorRegistration::Search : public OpenDirectionSearch {
 public:
  Search(const IcpTarget& target, IcpSource source, BrightCloud target_colors, BrightCloud source_colors,
         const AlignOptions& options)
      : target_(target),
        source_(std::move(source)),
        few_(source_.few()),
        nearest_(static_cast<std::size_t>(source_.cloud.points.rows()), no_slot),
        target_colors_(std::move(target_colors)),
        source_colors_(std::move(source_colors)),
        options_(options) {
    held_ = options;
    held_.max_distance = gate().distance;
    held_.max_iterations = 6;
  }

  std::int64_t num_samples() const { return source_.cloud.points.rows(); }

  OpenFit fit(const IcpResult& geometric, const TwistBasis* only) override {
    OpenFit fit;
    fit.result = run(geometric, only);
    fit.rows = match(level(fine_, 1), source_, fit.result.target_from_source, fit.result.center);
    fit.extent = extent_of(fit.rows);
    fit.noise = noise_;
    distance_noise_ = distance_noise(geometric);
    fit.agrees = fit.rows.size() >= base_limits::least_points;
    return fit;
  }

  // Information as if it were of distances, per pair.
  Directions determined(const OpenFit& fit, const TwistBasis& open) const override {
    return split_directions(information_per_pair(fit.rows, open, fit.extent, distance_noise_), options_.weak_threshold);
  }

  Pose one_step(const IcpResult& geometric) {
    IcpResult moved = geometric;
    if (moved.weak_directions.cols() == 0) return moved.target_from_source;
    const std::vector<MotionRow> rows = match(level(coarse_, registration_limits::coarse_color_step), few_,
                                              geometric.target_from_source, geometric.center);
    if (rows.size() >= base_limits::least_points) {
      const double extent = extent_of(rows);
      take(gauss_newton_step(rows, geometric.weak_directions, extent, base_limits::damping), extent, moved);
    }
    return moved.target_from_source;
  }

  // For a twist, its rotation in radians. Per pair of the registration's, as far as either side's are independent.
  Matrix6 information(const IcpResult& geometric) {
    const std::vector<MotionRow> rows = match(level(fine_, 1), source_, geometric.target_from_source, geometric.center);
    if (rows.size() < base_limits::least_points) return Matrix6::Zero();
    std::vector<double> whitened;
    for (const MotionRow& row : rows) whitened.push_back(row.residual * std::sqrt(row.weight));
    const double num_independent = static_cast<double>(rows.size()) / design_effect(whitened);
    const double extent = extent_of(rows);
    Vector6 scale;
    scale << extent, extent, extent, 1.0, 1.0, 1.0;
    return num_independent / geometric.num_independent * scale.asDiagonal() *
           information_per_pair(rows, TwistBasis::Identity(6, 6), extent, distance_noise(geometric)) *
           scale.asDiagonal();
  }

 private:
  double distance_noise(const IcpResult& geometric) const {
    return std::max(geometric.rmse, registration_limits::least_distance_noise * target_.spacing());
  }

  Eigen::MatrixXd information_per_pair(const std::vector<MotionRow>& rows, const TwistBasis& basis, double extent,
                                       double distance_noise) const {
    double weight = 0.0;
    for (const MotionRow& row : rows) weight += row.weight;
    return agreed_information(rows, basis, extent, distance_noise / noise_) / std::max(weight, 1e-12);
  }

  // One of so many points of the model's density, when it is first asked for.
  ColorLevel& level(std::optional<ColorLevel>& kept, std::int64_t thinning) {
    if (kept) return *kept;
    // As dense as the target: a gradient is that of the surroundings of a point.
    const std::int64_t denser = source_colors_.points.rows() / std::max<std::int64_t>(1, target_colors_.points.rows());
    const auto field = [&](const BrightCloud& cloud, std::int64_t step, const IcpCloud& at) {
      const double reach =
          registration_limits::color_reach * std::sqrt(static_cast<double>(thinning)) * target_.spacing();
      return ColorField(cloud.thinned(step, options_.seed), at.points, at.normals, reach, options_.num_threads);
    };
    return kept.emplace(ColorLevel{field(target_colors_, thinning, target_.cloud()),
                                   field(source_colors_, thinning * std::max<std::int64_t>(1, denser), source_.cloud)});
  }

  Gate gate() const {
    const double reach =
        options_.final_distance > 0.0 ? options_.final_distance : camera_limits::surface_spacings * target_.spacing();
    return {reach, std::cos(std::min(options_.max_angle, 3.14)), true};
  }

  // Pairs about a centre, their residuals after the best gain and offset, and robust weights. The samples are the
  // source's, or its first.
  std::vector<MotionRow> match(ColorLevel& level, const IcpSource& samples, const Pose& pose,
                               const Eigen::Vector3d& center) {
    const std::int64_t count = samples.levels.back();
    target_.match(samples, count, pose, gate(), nearest_);
    std::vector<std::uint32_t> matched_targets, matched_sources;
    for (Eigen::Index i = 0; i < count; ++i) {
      const std::uint32_t slot = nearest_[static_cast<std::size_t>(i)];
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
    for (const bool is_coarse : {true, false}) {
      ColorLevel& colors = is_coarse ? level(coarse_, registration_limits::coarse_color_step) : level(fine_, 1);
      Vector6 before = Vector6::Zero();
      double length = 0.0;
      for (int i = 0; i < registration_limits::most_steps; ++i) {
        const TwistBasis open = only != nullptr ? *only : TwistBasis(result.weak_directions);
        if (open.cols() == 0) break;
        const std::vector<MotionRow> rows = match(colors, source_, result.target_from_source, result.center);
        if (rows.size() < base_limits::least_points) break;
        const double extent = extent_of(rows);
        const Vector6 step = gauss_newton_step(rows, open, extent, base_limits::damping);
        length = step_length(before, length, step, Matrix6::Identity());
        take(length * step, extent, result);
        has_moved = true;
        if (!return_to_surface(target_, few_, held_, result)) return start;
        // Where a step turns back, which points are matched decides more than their colours.
        if (step.dot(std::exchange(before, step)) < 0.0) break;
        if (step.norm() < registration_limits::small_color_step * target_.spacing()) break;
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
    const double ratio = source_spread > 0.0 ? median_of(target_values) / source_spread : 1.0;
    const double gain = std::clamp(ratio, 1.0 / registration_limits::largest_gain, registration_limits::largest_gain);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      rows[i].residual = brightness[i].target - target_middle - gain * (brightness[i].source - source_middle);
      rows[i].source_gradient = gain * rows[i].source_gradient;
      rows[i].gradient = 0.5 * (rows[i].target_gradient + rows[i].source_gradient);
      values.push_back(std::abs(rows[i].residual));
    }
    noise_ = std::max(registration_limits::least_brightness_noise, mad_to_sigma * median_of(values));
    for (MotionRow& row : rows) row.weight = robust_weight(row.residual, noise_);
  }

  // Moves the pose by a step of lengths, root mean square over the pairs [m].
  static void take(Vector6 step, double extent, IcpResult& result) {
    step.head<3>() /= extent;
    result.target_from_source = motion_about(result.center, step) * result.target_from_source;
  }

  const IcpTarget& target_;
  const IcpSource source_, few_;
  std::vector<std::uint32_t> nearest_;  // of the source's points, where they were last: the next are not far from them
  const BrightCloud target_colors_, source_colors_;
  std::optional<ColorLevel> coarse_, fine_;
  const AlignOptions& options_;
  AlignOptions held_;  // few steps within the last gate, weak directions held
  double noise_ = 1.0, distance_noise_ = 1.0;
};

ColorRegistration::ColorRegistration(const IcpTarget& target, IcpSource source, BrightCloud target_colors,
                                     BrightCloud source_colors, const AlignOptions& options) {
  if (!target.cloud().has_normals() || !source.cloud.has_normals()) return;
  search_ =
      std::make_unique<Search>(target, std::move(source), std::move(target_colors), std::move(source_colors), options);
}

ColorRegistration::~ColorRegistration() = default;
ColorRegistration::ColorRegistration(ColorRegistration&&) noexcept = default;
ColorRegistration& ColorRegistration::operator=(ColorRegistration&&) noexcept = default;

std::int64_t ColorRegistration::num_samples() const { return search_ ? search_->num_samples() : 0; }

Matrix6 ColorRegistration::information(const IcpResult& geometric) const {
  return search_ ? search_->information(geometric) : Matrix6::Zero();
}

Pose ColorRegistration::one_step(const IcpResult& geometric) const {
  return search_ ? search_->one_step(geometric) : geometric.target_from_source;
}

IcpResult ColorRegistration::determine(const IcpResult& geometric) const {
  return search_ ? determine_open_directions(geometric, *search_) : geometric;
}

}  // namespace nacre
