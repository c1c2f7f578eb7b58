// Model points that a camera near a pose may see.
#pragma once

#include <vector>

#include "base/point_rows.hpp"
#include "camera/point_projection.hpp"
#include "fusion/block_index.hpp"
#include "nacre/fusion.hpp"

namespace nacre {

// The points, or the normals, of a model as rows.
inline PointsRef as_rows(const std::vector<Eigen::Vector3f>& vectors) {
  return Eigen::Map<const Points>(vectors.empty() ? nullptr : vectors.front().data(),
                                  static_cast<Eigen::Index>(vectors.size()), 3);
}

struct PointsInView {
  Points points, normals;  // world frame
  Values brightness;       // empty where the model has no colours
  double thinning = 1.0;   // how much farther apart the points are than the model's

  PointsInView part(const std::vector<std::int32_t>& rows) const {
    return {take_rows<Points>(points, rows), take_rows<Points>(normals, rows), take_rows<Values>(brightness, rows),
            thinning};
  }
};

// Points in the image widened by a third on each side, turned away from the camera by at most 120 degrees, and last
// seen by oldest_frame or later: one of every n of them, so that no more are left than a frame is registered to.
PointsInView points_in_view(const PointModel& model, const BlockIndex& blocks, const Camera& camera,
                            const Pose& world_from_camera, std::int32_t oldest_frame, int num_threads);

}  // namespace nacre
