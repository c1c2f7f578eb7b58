// An object that stands on a plane, as one camera saw it, and what two such views say about each other.
#pragma once

#include <optional>

#include "nacre/region.hpp"
#include "registration/view_agreement.hpp"
#include "tracking/frame_samples.hpp"

namespace nacre {

struct ObjectView {
  std::int32_t frame = 0;  // its number
  Pose world_from_camera = Pose::Identity();
  Points points, normals;  // samples of the object in random order, camera frame
  Values depth;            // of each pixel, beside the object too [m]
  MaskImage region;        // the object's pixels
  SupportPlane support;    // camera frame
  double tolerance = 0.0;  // [m]; to which two views of a surface agree
  double size = 0.0;       // of the bounding box of what is seen [m]

  // The camera from a frame in the plane: z is its normal, the origin below the middle of what is seen.
  Pose ground_frame() const;
  Eigen::Vector3d center() const;  // about the middle of the object, of which the view shows the front, camera frame
};

// None where the object is too small. The samples are some of the frame's.
std::optional<ObjectView> object_view(const Frame& frame, const MaskImage& region, const SupportPlane& support,
                                      const FrameSamples& samples, std::uint64_t seed);

// What `seen` says about the first `count` samples of `moved`.
ViewAgreement look_at(const ObjectView& moved, const ObjectView& seen, const Pose& seen_from_moved,
                      const Camera& camera, Eigen::Index count);

}  // namespace nacre
