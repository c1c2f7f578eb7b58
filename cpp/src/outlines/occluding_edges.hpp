// Where surfaces end: points of an outline that lie on the object itself, whatever the camera looks from.
#pragma once

#include <vector>

#include "depth/depth_view.hpp"
#include "nacre/camera.hpp"

namespace nacre {

struct OutlinePoint {
  Eigen::Vector3d point;
  Eigen::Vector3d normal;   // of the surface, towards the camera
  Eigen::Vector3d outward;  // in the surface, across the outline
  double pixel;             // size of a pixel on the surface, across the outline [m]
};

// Of what a camera saw, in the camera frame: pixels beside which a flat surface that faces the camera ends, with
// nothing or something farther behind. Not where the image ends, not where something nearer begins, and not where a
// surface bends away, since there the outline moves with the camera (Choi, Trevor and Christensen 2013 call the first
// kind occluding edges). At most `most` of them.
std::vector<OutlinePoint> find_outline(const DepthView& sight, const Camera& camera, std::size_t most, int num_threads);

// Whether the image ends before the surfaces do: on more than a tenth of its border.
bool is_cut_off(const Values& depth, const Camera& camera);

// The point of the camera frame that a pixel sees at z [m].
Eigen::Vector3d unproject(const Camera& camera, int u, int v, double z);

}  // namespace nacre
