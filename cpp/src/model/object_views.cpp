#include "model/object_views.hpp"

#include <algorithm>

#include "base/se3.hpp"
#include "camera/limits.hpp"
#include "model/limits.hpp"
#include "registration/multiview.hpp"

namespace nacre {

bool is_new_direction(const std::vector<ObjectView>& views, const Pose& world_from_camera) {
  return views.size() < model_limits::most_object_views &&
         std::all_of(views.begin(), views.end(), [&](const ObjectView& view) {
           return angle_between(view.world_from_camera, world_from_camera) > camera_limits::new_direction;
         });
}

std::vector<Pose> adjust(std::vector<ObjectView>& views, const std::vector<Pose>& cameras, int num_threads) {
  std::vector<AdjustableView> adjustable;
  double tolerance = 0.0;
  for (const ObjectView& view : views) {
    adjustable.push_back({view.world_from_camera, view.points, view.normals});
    tolerance = std::max(tolerance, view.tolerance);
  }
  const ObjectView& first = views.front();
  const MotionBasis motions = MotionBasis::on_plane(first.world_from_camera.linear() * first.support.normal,
                                                    first.world_from_camera * first.center());
  const std::vector<Pose> adjusted = adjust_views(adjustable, motions, tolerance, 0.0, num_threads);
  std::vector<Pose> corrections;
  for (const Pose& camera : cameras) {
    const auto nearest = std::min_element(views.begin(), views.end(), [&](const ObjectView& a, const ObjectView& b) {
      return angle_between(a.world_from_camera, camera) < angle_between(b.world_from_camera, camera);
    });
    const Pose& pose = adjusted[static_cast<std::size_t>(nearest - views.begin())];
    corrections.push_back(orthonormal(pose * nearest->world_from_camera.inverse()));
  }
  for (std::size_t k = 0; k < views.size(); ++k) views[k].world_from_camera = adjusted[k];
  return corrections;
}

}  // namespace nacre
