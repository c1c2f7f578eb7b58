// The cloud that others are registered to: prepared once, matched many times.
#pragma once

#include <array>
#include <limits>
#include <vector>

#include "icp_step.hpp"
#include "nacre/registration.hpp"
#include "nearest_points.hpp"

namespace nacre {

// What is used of a cloud: finite points, at most options.max_points of them where the gate is automatic, with the
// normals that the method needs; estimated ones are NaN where no plane fits.
struct IcpCloud {
  Points points, normals;
  Values sigma;
  bool has_estimated_normals;

  IcpCloud(const AlignCloud& cloud, const AlignOptions& options, bool is_target);
  void keep(const std::vector<std::int32_t>& rows);  // in this order
  bool has_normals() const { return normals.rows() == points.rows(); }
};

// A source cloud ready for matching: samples of it, of which the first levels[i] are a fair sample, too.
struct IcpSource {
  IcpCloud cloud;
  std::array<std::int64_t, 3> levels;  // few, more, all

  IcpSource(const AlignCloud& cloud, const AlignOptions& options);
};

struct Gate {
  double distance;                                            // [m]
  double cos_angle;                                           // of the largest angle between matched normals
  double residual = std::numeric_limits<double>::infinity();  // along the normals [m]
};

class IcpTarget {
 public:
  IcpTarget(const AlignCloud& cloud, const AlignOptions& options);

  double diameter() const { return diameter_; }  // of the bounding box [m]
  double spacing() const { return spacing_; }    // median distance of nearest neighbours [m]

  // The first `count` source samples moved by a pose, each with its nearest target point if that lies within the gate.
  // `nearest` holds each sample's last match, no_slot for none: a first bound for the search.
  std::vector<Pair> match(const IcpSource& source, std::int64_t count, const Pose& pose, const Gate& gate,
                          std::vector<std::uint32_t>& nearest) const;

 private:
  AlignOptions options_;
  IcpCloud cloud_;  // in the tree's order
  BlockTree<float> tree_;
  double diameter_ = 0.0, spacing_ = 0.0;
};

// align with a prepared target. With the last gate, pairs with larger residuals than `last_residual` are rejected: for
// a target that is sparser than its surface is known, where near points may lie far along the surface, but not across.
AlignResult align_to(const IcpTarget& target, const IcpSource& source, const Pose& initial, const AlignOptions& options,
                     double last_residual = std::numeric_limits<double>::infinity());

}  // namespace nacre
