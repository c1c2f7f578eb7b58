/// Region of interest: which part of a depth frame is modelled.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "nacre/camera.hpp"
#include "nacre/depth.hpp"
#include "nacre/types.hpp"

namespace nacre {

/// A box in the camera's frame, and the thing on the table. Both together: the thing within the box.
struct RegionOptions {
  double min_x = -std::numeric_limits<double>::infinity();  ///< box, camera frame [m]: x right, y down, z forward
  double max_x = std::numeric_limits<double>::infinity();
  double min_y = -std::numeric_limits<double>::infinity();
  double max_y = std::numeric_limits<double>::infinity();
  double min_z = -std::numeric_limits<double>::infinity();
  double max_z = std::numeric_limits<double>::infinity();

  bool object = false;        ///< only the largest thing that stands on a plane
  double min_object = 0.003;  ///< things of a smaller part of the image's pixels are none
  double plane_margin = 0.0;  ///< so near to a plane a point belongs to it [m]; 0: from the noise and the pixels

  bool has_box() const;     ///< whether any side of the box is finite
  bool is_limited() const;  ///< whether anything is left out at all
  void check() const;       ///< throws std::invalid_argument naming the field, what was expected and the value
};

/// normal . point = offset in the camera's frame; the normal points to the camera's side.
struct SupportPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  double offset = 0.0;  ///< [m]
};

/// What was left out of a frame.
struct RegionReport {
  std::int64_t num_inside = 0;       ///< pixels with a point
  std::int64_t num_outside = 0;      ///< likewise
  std::vector<SupportPlane> planes;  ///< that were put aside, largest first
  int support = -1;                  ///< of the planes, the one that the thing stands on; -1: none
  std::string reason;                ///< why nothing is inside; empty otherwise
};

/// The pixels of a frame that belong to the region. For options.object, planes on which things stand are found and put
/// aside with all that lies behind them: large planes that meet other surfaces at concave creases, as tables, floors
/// and walls do, and the faces of a box do not. Of the connected things that remain and touch a plane the largest is
/// taken, or the one that `previous`, the mask of the last frame, shows already. Where there is no such plane, the
/// largest thing is taken. Throws std::invalid_argument when sizes do not fit.
MaskImage select_region(const Frame& frame, const Camera& camera, const RegionOptions& options = {},
                        const MaskRef& previous = MaskImage(), RegionReport* report = nullptr, int num_threads = 0);

/// Takes the pixels outside of a mask out of a frame's surface: their normals become NaN and they are no longer valid.
/// Their points stay, for they tell what the camera sees through.
void keep_region(const MaskRef& region, Frame& frame);

}  // namespace nacre
