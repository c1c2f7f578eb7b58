#include "outlines/registration.hpp"

#include <algorithm>
#include <cmath>

#include "base/se3.hpp"
#include "base/statistics.hpp"
#include "outlines/limits.hpp"
#include "outlines/match.hpp"
#include "registration/gauss_newton.hpp"
#include "registration/weak_directions.hpp"

namespace nacre {
namespace {

struct Fit {
  IcpResult result;
  std::vector<MotionRow> pairs;
  double agreement = 0.0;  // see EdgeSearch
};

class EdgeSearch {
 public:
  EdgeSearch(const IcpTarget& target, const IcpSource& source, const OutlinePair& outlines, const IcpResult& geometric,
             const AlignOptions& options)
      : target_(target),
        source_(source),
        outlines_(outlines),
        options_(options),
        held_(options),
        edges_(moved(outlines.target, outlines.before.world_from_camera)) {
    const double reach = options.final_distance > 0.0 ? options.final_distance : 2.5 * target.spacing();
    held_.max_distance = reach;
    held_.max_iterations = 6;
    Eigen::AlignedBox3d box;
    for (const OutlinePoint& edge : edges_) box.extend(edge.point);
    pixel_ = median_pixel(edges_);
    // Outlines that the image cuts off slide along themselves.
    const bool is_cut =
        is_cut_off(outlines.depth, outlines.camera) || is_cut_off(outlines.before.depth, outlines.camera);
    widest_ = std::max(is_cut ? outlines_limits::first_gate * pixel_ : box.diagonal().norm() / 3.0, smallest_gate());
    extent_ = extent_of(geometric, reach);
  }

  double narrow_gate() const { return std::min(outlines_limits::first_gate * pixel_, widest_); }
  double widest_gate() const { return widest_; }
  double smallest_gate() const { return outlines_limits::last_gate * pixel_; }
  double noise() const { return noise_; }
  double extent() const { return extent_; }
  // The information that leaves a direction no more uncertain than a pixel.
  double least_known() const { return std::pow(noise_ / (outlines_limits::least_noise * pixel_), 2); }

  // Each source edge with the nearest target edge of its kind, if that lies within the gate; robust weights.
  std::vector<MotionRow> match(const Pose& pose, const Eigen::Vector3d& center, double gate) {
    const std::vector<OutlinePoint> edges = moved(outlines_.source, pose);
    const std::vector<int> nearest = nearest_edges(edges, edges_, gate, options_.num_threads);
    std::vector<MotionRow> pairs;
    std::vector<double> sizes;
    for (std::size_t i = 0; i < nearest.size(); ++i) {
      if (nearest[i] < 0) continue;
      const OutlinePoint &edge = edges[i], &other = edges_[static_cast<std::size_t>(nearest[i])];
      const Eigen::Vector3d across = (edge.outward + other.outward).normalized();
      pairs.push_back(
          {edge.point - center, other.outward, edge.outward, across, (edge.point - other.point).dot(across)});
      sizes.push_back(std::abs(pairs.back().residual));
    }
    if (pairs.size() < outlines_limits::least_matches) return {};
    noise_ = std::max(outlines_limits::least_noise * pixel_, mad_to_sigma * median_of(sizes));
    for (MotionRow& pair : pairs) pair.weight = robust_weight(pair.residual, noise_);
    return pairs;
  }

  // From a pose at rest on the surface, along the given directions or, without any, all that geometry leaves open.
  IcpResult run(const IcpResult& start, double gate, const TwistBasis* only) {
    IcpResult result = start;
    for (int round = 0; round < outlines_limits::num_rounds; ++round) {
      const TwistBasis open = only != nullptr ? *only : TwistBasis(result.weak_directions);
      if (open.cols() == 0) break;
      for (int i = 0; i < outlines_limits::least_steps || gate > smallest_gate(); ++i) {
        const std::vector<MotionRow> pairs = match(result.target_from_source, result.center, gate);
        if (pairs.empty()) return start;
        step(pairs, open, result);
        gate = std::max(smallest_gate(), gate * outlines_limits::gate_decay);
      }
      if (!return_to_surface(target_, source_, held_, result)) return start;
    }
    return result;
  }

  // The same with its pairs within the last gate, and their agreement; 0 where the surfaces no longer fit.
  Fit fit(const IcpResult& start, double gate, const TwistBasis* only) {
    Fit fit;
    fit.result = run(start, gate, only);
    fit.pairs = match(fit.result.target_from_source, fit.result.center, smallest_gate());
    const bool still_fits = fit.result.num_inliers > 0.8 * start.num_inliers;
    if (still_fits && !fit.pairs.empty()) fit.agreement = agreement(fit.result.target_from_source, fit.pairs);
    return fit;
  }

  // See agreement_of: of either outline, whichever is less; 0 where the matches are no closer than chance has it.
  double agreement(const Pose& pose, const std::vector<MotionRow>& pairs) const {
    double squares = 0.0;
    for (const MotionRow& pair : pairs) squares += pair.residual * pair.residual;
    const double ratio = std::sqrt(squares / static_cast<double>(pairs.size())) / smallest_gate();
    if (!(ratio < outlines_limits::largest_ratio)) return 0.0;
    const std::vector<OutlinePoint> edges = moved(outlines_.source, pose);
    const DepthView now{outlines_.depth, Values(), pose};
    const auto part = [&](const auto& outline, const auto& others, const DepthView& sight) {
      const std::vector<int> matches = nearest_edges(outline, others, smallest_gate(), options_.num_threads);
      return agreement_of(outline, matches, sight, outlines_.camera, pixel_, outlines_.noise);
    };
    return std::min(part(edges, edges_, outlines_.before), part(edges_, edges, now));
  }

 private:
  double extent_of(const IcpResult& geometric, double reach) const {
    std::vector<std::uint32_t> nearest(static_cast<std::size_t>(source_.cloud.points.rows()), no_slot);
    const Gate gate{reach, std::cos(std::min(options_.max_angle, 3.14)), true};
    const auto pairs = target_.match(source_, source_.levels.back(), geometric.target_from_source, gate, nearest);
    double squares = 0.0;
    for (const Pair& pair : pairs) squares += (pair.p - geometric.center).squaredNorm();
    return std::sqrt(std::max(squares / std::max<double>(1.0, static_cast<double>(pairs.size())), 1e-24));
  }

  void step(const std::vector<MotionRow>& pairs, const TwistBasis& open, IcpResult& result) const {
    Vector6 twist = gauss_newton_step(pairs, open, extent_, {1e-3, 0.0});
    twist.head<3>() /= extent_;
    result.target_from_source = motion_about(result.center, twist) * result.target_from_source;
  }

  const IcpTarget& target_;
  const IcpSource& source_;
  const OutlinePair& outlines_;
  const AlignOptions& options_;
  AlignOptions held_;                // few steps within the last gate, weak directions held
  std::vector<OutlinePoint> edges_;  // of the target
  double pixel_ = 0.0, widest_ = 0.0, extent_ = 1.0, noise_ = 1.0;
};

}  // namespace

IcpResult determine_by_outline(const IcpTarget& target, const IcpSource& source, const OutlinePair& outlines,
                               const IcpResult& geometric, const AlignOptions& options) {
  if (outlines.target.size() < outlines_limits::least_matches ||
      outlines.source.size() < outlines_limits::least_matches)
    return geometric;
  EdgeSearch search(target, source, outlines, geometric, options);
  // The nearer solution first: structures repeat.
  double best = 0.0, gate = 0.0;
  for (const double first : {search.narrow_gate(), search.widest_gate()}) {
    if (first == gate) break;
    const Fit fit = search.fit(geometric, first, nullptr);
    if (fit.agreement > best) gate = first;
    best = std::max(best, fit.agreement);
    if (best > outlines_limits::clear_agreement) break;
  }
  if (best < outlines_limits::least_agreement) return geometric;

  TwistBasis known;
  IcpResult result = geometric;
  for (const bool restricted : {false, true}) {
    const auto [found, pairs, agreement] = search.fit(geometric, gate, restricted ? &known : nullptr);
    if (agreement < outlines_limits::least_agreement) return geometric;
    // What shape says only where outlines took it must be said by the outlines, too.
    const bool is_shaped = found.weak_directions.cols() == 0;
    const TwistBasis open = is_shaped ? geometric.weak_directions : found.weak_directions;
    double weight = 0.0;
    for (const MotionRow& pair : pairs) weight += pair.weight;
    const double least = std::max(search.least_known(), outlines_limits::least_information * weight);
    const Directions directions = split_directions(agreed_information(pairs, open, search.extent(), 1.0), least);
    if (is_shaped) return directions.weak.cols() == 0 ? found : geometric;
    if (directions.sure.cols() == 0) return geometric;
    known = open * directions.sure;
    result = found;
    result.weak_directions = open * directions.weak;
    add_information(pairs, known, search.extent(), search.noise(), result.information);
    if (directions.weak.cols() == 0) break;
  }
  return result;
}

}  // namespace nacre
