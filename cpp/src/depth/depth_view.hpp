// Does a depth image confirm points that should be seen there?
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "camera/limits.hpp"
#include "camera/point_projection.hpp"
#include "nacre/camera.hpp"
#include "nacre/types.hpp"

namespace nacre {

// What a camera saw from one place.
struct DepthView {
  Values depth, sigma;  // of each pixel [m], NaN where nothing was measured
  Pose world_from_camera = Pose::Identity();
  Values measured = {};                       // the depth before it was cleaned, 0 or NaN for none; empty: the same
  std::vector<std::uint8_t> brightness = {};  // empty: unknown
};

// What a pixel shows, in its camera's frame; NaN where that is nothing.
Eigen::RowVector3f point_at(const DepthView& view, const Camera& camera, int u, int v);

// What a view shows, in its camera's frame: a row for each pixel, or each `step`-th across and down; NaN where it shows
// nothing.
struct SeenPoints {
  Points points;
  Values sigma;  // [m]

  SeenPoints(const DepthView& view, const Camera& camera, int step = 1);
};

// What a camera says of a point that it looks at.
enum class Visibility {
  agrees,
  seen_through,  // it measured something behind the point
  occluded,      // or something before it, which says nothing about the point
  unknown,       // or nothing
};

// `behind`: how far behind the point the camera measured something; differences up to the margin agree.
template <class T>
Visibility visibility(T behind, T margin) {
  if (!std::isfinite(behind)) return Visibility::unknown;
  return behind > margin ? Visibility::seen_through : behind < -margin ? Visibility::occluded : Visibility::agrees;
}

struct VisibilityCounts {
  std::int64_t agreeing = 0, seen_through = 0, occluded = 0;

  void add(Visibility visibility);
  VisibilityCounts& operator+=(const VisibilityCounts& other);
  // The part of the points that agrees, among those that agree and those that the camera sees through; NaN where fewer
  // than `least` are either.
  double consistency(std::int64_t least) const;
};

// How far along its normal a point may be from what the camera measures: a distance, and no less than so much as the
// measurement errs by. Surfaces seen at a smaller cosine are not asked.
struct VisibilityMargin {
  double distance = 0.0;              // [m]
  double part_of_depth = 0.0;         // beside it
  bool with_systematic_error = true;  // see systematic_error.hpp
  float least_facing = camera_limits::least_facing;
};

// What a view says of one of a block of oriented points that are in its image; sigma: of the point [m].
Visibility visibility_in(const DepthView& view, const PointProjection::Block& block, int i,
                         const VisibilityMargin& margin, float sigma = 0.0F);

// Of oriented points, as a camera at a pose in their frame sees them: what it measured there says of each. sigma: of
// the points [m], or none.
VisibilityCounts compare(const PointsRef& points, const PointsRef& normals, const DepthView& view,
                         const Pose& points_from_camera, const Camera& camera, const VisibilityMargin& margin,
                         int num_threads, const Values& sigma = Values());

// Calls visit(i, block, k) for each of `count` points i, from the first on, that is in the image of a camera at a pose
// in their frame: the k-th of a block.
template <class Visit>
void visit_points_in_view(const PointsRef& points, const PointsRef& normals, Eigen::Index first, Eigen::Index count,
                          const PointProjection& projection, Visit&& visit) {
  PointProjection::Block block;
  for (Eigen::Index begin = first; begin < first + count; begin += PointProjection::capacity) {
    const auto size = static_cast<int>(std::min<Eigen::Index>(PointProjection::capacity, first + count - begin));
    projection.project(points.data() + 3 * begin, normals.data() + 3 * begin, size, block);
    for (int k = 0; k < size; ++k) {
      if (block.inside[k]) visit(begin + k, block, k);
    }
  }
}

}  // namespace nacre
