// The cloud that others are registered to: prepared once, matched many times.
#pragma once

#include <array>
#include <vector>

#include "nacre/registration.hpp"
#include "registration/icp_step.hpp"
#include "spatial/nearest_batch.hpp"

namespace nacre {

// What is used of a cloud: finite points, at most options.max_points of them where the gate is automatic, with the
// normals that the method needs; estimated ones are NaN where no plane fits.
struct IcpCloud {
  Points points, normals;
  Values sigma;
  std::vector<std::int32_t> rows;  // of the given cloud
  bool has_estimated_normals;

  IcpCloud(const AlignCloud& cloud, const AlignOptions& options, bool is_target);
  void keep(const std::vector<std::int32_t>& rows);  // in this order
  bool has_normals() const { return normals.rows() == points.rows(); }
};

// A source cloud ready for matching: samples of it, of which the first levels[i] are a fair sample, too.
struct IcpSource {
  IcpCloud cloud;
  std::array<std::int64_t, 3> levels;  // few, more, all
  // For each sample, or empty: how far a match may be along the surface, and across it, when the gate is at its
  // smallest [m]. What is near along the surface of a sparse target, but beyond its rim, matches nothing.
  Values reach, largest_residual;
  Values noise;  // standard deviation of each sample along its residual [m], or empty

  IcpSource(const AlignCloud& cloud, const AlignOptions& options);
  IcpSource few(std::size_t level = 0) const;                    // those of the first level alone
  IcpSource part(const std::vector<std::uint8_t>& is_in) const;  // a flag for each sample
};

struct Gate {
  double distance;   // [m]
  double cos_angle;  // of the largest angle between matched normals
  bool is_smallest;  // then each sample's own reach and largest residual count, if it has them
};

class IcpTarget {
 public:
  IcpTarget(const AlignCloud& cloud, const AlignOptions& options);

  const IcpCloud& cloud() const { return cloud_; }
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

}  // namespace nacre
