/// Consolidation: few, evenly spread, denoised points in place of many noisy ones (WLOP).
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "nacre/types.hpp"

namespace nacre {

/// The form of WLOP.
enum class ConsolidationMethod {
  wlop,       ///< Huang et al. 2009, density weights for both sets: the paper's form
  wlop_plus,  ///< repaired for incremental use: tangential, bounded repulsion that fades where there are no neighbours
  cgal        ///< what CGAL's wlop_simplify_and_regularize_point_set computes, for comparison: means, not medians,
              ///< theta exp(-4 r^2 / h^2), repulsion theta / r^2, no density weights of the points
};

/// The weight of a point at distance r within the support radius h.
enum class Theta {
  huang,   ///< exp(-16 r^2 / h^2)
  printed  ///< exp(-4 r^2 / h), as printed in the 2010 paper; cut at h
};

/// How consolidate and project_samples work.
struct ConsolidateOptions {
  ConsolidationMethod method = ConsolidationMethod::wlop;
  double radius = 0.008;  ///< support radius h [m], of which the samples' spacing should be at most half
  int num_points = 2000;  ///< size of the result, at most the size of the input
  int iterations = 10;
  double mu = 0.4;  ///< weight of the repulsion, 0 to 0.5
  Theta theta = Theta::huang;
  std::uint64_t seed = 0;  ///< of the choice of the first samples
  int num_threads = 0;     ///< 0: all
  /// Told how many of the iterations are done; false ends it there.
  std::function<bool(int done, int total)> progress;

  void check() const;  ///< throws std::invalid_argument naming the field, what was expected and the value
};

/// A consolidated point set.
template <class PointMatrix>
struct BasicConsolidated {
  PointMatrix points;
  Attributes attributes;              ///< one row a point: means of the input's, with the last attraction's weights
  std::vector<std::int64_t> sources;  ///< the input point that each point started from
  int iterations = 0;                 ///< that were done; where progress ended it, attributes are the sources' own
};

/// Of float coordinates.
using Consolidated = BasicConsolidated<Points>;
/// Of double coordinates.
using ConsolidatedDouble = BasicConsolidated<PointsDouble>;

/// num_points of the input, chosen at random, moved as project_samples does; in the order of their sources. Input rows
/// that are not finite are ignored, attribute values that are not finite are left out of the means.
Consolidated consolidate(const PointsRef& points, const ConsolidateOptions& options = {},
                         const AttributesRef& attributes = Attributes());
ConsolidatedDouble consolidate(const PointsDoubleRef& points, const ConsolidateOptions& options = {},
                               const AttributesRef& attributes = Attributes());

/// What project_samples of method wlop_plus may know besides positions; empty means "not known".
struct ProjectionHints {
  Values point_weights;              ///< how many observations each point stands for: one of weight 2 counts as two
  Points sample_normals;             ///< of the surface, any sign; estimated where not finite or zero
  std::vector<std::uint8_t> frozen;  ///< not 0: the sample stays where it is, and still repels the others
};

/// The iteration itself: samples are drawn to the weighted medians of the points around them (cgal: means) and repel
/// each other. Samples with no points within the radius, and rows that are not finite, stay as they are.
/// options.num_points and options.seed are not used.
Points project_samples(const PointsRef& samples, const PointsRef& points, const ConsolidateOptions& options = {},
                       const ProjectionHints& hints = {});
PointsDouble project_samples(const PointsDoubleRef& samples, const PointsDoubleRef& points,
                             const ConsolidateOptions& options = {}, const ProjectionHints& hints = {});

}  // namespace nacre
