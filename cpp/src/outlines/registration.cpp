#include "outlines/registration.hpp"

#include <algorithm>
#include <cmath>

#include "base/se3.hpp"
#include "base/statistics.hpp"
#include "camera/limits.hpp"
#include "outlines/limits.hpp"
#include "outlines/match.hpp"
#include "registration/limits.hpp"
#include "registration/open_directions.hpp"

namespace nacre {
namespace {

class EdgeSearch : public OpenDirectionSearch {
 public:
  EdgeSearch(const IcpTarget& target, const IcpSource& source, const OutlinePair& outlines, const IcpResult& geometric,
             const AlignOptions& options)
      : target_(target),
        source_(source),
        few_(source.few()),
        outlines_(outlines),
        options_(options),
        held_(options),
        start_(geometric.target_from_source),
        edges_(moved(outlines.target, outlines.before.world_from_camera)) {
    const double reach =
        options.final_distance > 0.0 ? options.final_distance : camera_limits::surface_spacings * target.spacing();
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

  // The nearer solution first: structures repeat. Returns whether either explains the outlines.
  bool choose_gate(const IcpResult& geometric) {
    double best = 0.0;
    const double narrow = std::min(outlines_limits::first_gate * pixel_, widest_);
    for (const double first : {narrow, widest_}) {
      if (first == gate_) break;
      auto [fit, agreement] = agreement_from(geometric, first, nullptr);
      if (!(agreement > best)) continue;
      best = agreement;
      gate_ = first;
      free_ = std::move(fit);
    }
    free_.agrees = best >= outlines_limits::least_agreement;
    return free_.agrees;
  }

  OpenFit fit(const IcpResult& geometric, const TwistBasis* only) override {
    if (only == nullptr) return free_;
    auto [fit, agreement] = agreement_from(geometric, gate_, only);
    fit.agrees = agreement >= outlines_limits::least_agreement;
    return fit;
  }

  // Down to what leaves a direction no more uncertain than a pixel. To lead elsewhere than the camera was going it must
  // tell as much as one point does: of a straight edge pixels make steps, which look the same to neighbors.
  Directions determined(const OpenFit& fit, const TwistBasis& open) const override {
    const double of_a_pixel = std::pow(fit.noise / (outlines_limits::least_noise * pixel_), 2);
    const double of_a_point =
        shift_from_start(fit.result.target_from_source) > pixel_ ? outlines_limits::points_for_one : 0.0;
    return split_directions(agreed_information(fit.rows, open, fit.extent, 1.0), std::max(of_a_pixel, of_a_point));
  }

 private:
  // Of the outline, root mean square [m].
  double shift_from_start(const Pose& pose) const {
    double squares = 0.0;
    for (const OutlinePoint& edge : outlines_.source)
      squares += (pose * edge.point - start_ * edge.point).squaredNorm();
    return std::sqrt(squares / static_cast<double>(outlines_.source.size()));
  }

  double smallest_gate() const { return outlines_limits::last_gate * pixel_; }

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
        gate = std::max(smallest_gate(), gate * registration_limits::gate_decay);
      }
      const bool is_last = round + 1 == outlines_limits::num_rounds;
      if (!return_to_surface(target_, is_last ? source_ : few_, held_, result)) return start;
    }
    return result;
  }

  // The same with its rows within the last gate, and their agreement; 0 where the surfaces no longer fit.
  std::pair<OpenFit, double> agreement_from(const IcpResult& start, double gate, const TwistBasis* only) {
    OpenFit fit;
    fit.result = run(start, gate, only);
    fit.rows = match(fit.result.target_from_source, fit.result.center, smallest_gate());
    fit.extent = extent_;
    fit.noise = noise_;
    const double agrees = fit.rows.empty() ? 0.0 : agreement(fit.result.target_from_source, fit.rows);
    return {std::move(fit), agrees};
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

  double extent_of(const IcpResult& geometric, double reach) const {
    std::vector<std::uint32_t> nearest(static_cast<std::size_t>(source_.cloud.points.rows()), no_slot);
    const Gate gate{reach, std::cos(std::min(options_.max_angle, 3.14)), true};
    const auto pairs = target_.match(source_, source_.levels.back(), geometric.target_from_source, gate, nearest);
    double squares = 0.0;
    for (const Pair& pair : pairs) squares += (pair.p - geometric.center).squaredNorm();
    return std::sqrt(std::max(squares / std::max<double>(1.0, static_cast<double>(pairs.size())), 1e-24));
  }

  void step(const std::vector<MotionRow>& pairs, const TwistBasis& open, IcpResult& result) const {
    Vector6 twist = gauss_newton_step(pairs, open, extent_, outlines_limits::step_damping);
    twist.head<3>() /= extent_;
    result.target_from_source = motion_about(result.center, twist) * result.target_from_source;
  }

  const IcpTarget& target_;
  const IcpSource& source_;
  const IcpSource few_;
  const OutlinePair& outlines_;
  const AlignOptions& options_;
  AlignOptions held_;                // few steps within the last gate, weak directions held
  Pose start_;                       // where the camera was going, along open directions
  std::vector<OutlinePoint> edges_;  // of the target
  OpenFit free_;                     // along all that geometry leaves open
  double pixel_ = 0.0, widest_ = 0.0, gate_ = 0.0, extent_ = 1.0, noise_ = 1.0;
};

}  // namespace

IcpResult determine_by_outline(const IcpTarget& target, const IcpSource& source, const OutlinePair& outlines,
                               const IcpResult& geometric, const AlignOptions& options) {
  if (outlines.target.size() < outlines_limits::least_matches ||
      outlines.source.size() < outlines_limits::least_matches)
    return geometric;
  EdgeSearch search(target, source, outlines, geometric, options);
  return search.choose_gate(geometric) ? determine_open_directions(geometric, search) : geometric;
}

}  // namespace nacre
