/// Pictures of point models: what reports and notebooks show.
#pragma once

#include <cstdint>
#include <limits>

#include "nacre/types.hpp"

namespace nacre {

/// A projection of a model onto a picture: parallel, or as seen from a point.
struct PictureView {
  Eigen::Matrix<double, 3, 3, Eigen::DontAlign> view_from_model;  ///< rows: right, down, away from the viewer
  Eigen::Vector3d center = Eigen::Vector3d::Zero();               ///< the point in the middle of the picture [m]
  double metres_per_pixel = 1.0;                                  ///< at the center
  double distance = std::numeric_limits<double>::infinity();      ///< of the viewer from the center [m]; else parallel
  int width = 0;
  int height = 0;
};

/// height * width rows, row after row: red, green, blue, opacity.
using Picture = Eigen::Matrix<std::uint8_t, Eigen::Dynamic, 4, Eigen::RowMajor>;

/// Draws points as a closed, shaded surface. Each point is a disk in the plane of its normal with the given radius [m];
/// disks that overlap at one depth are blended. The light comes from the viewer, and places that lie behind their
/// surroundings are a little darker. Without colors (no row) fronts are light grey and reverse sides brown;
/// hide_reverse leaves reverse sides out. Points that are not finite are left out; normals that are zero or not finite
/// face the viewer. The same bits for any number of threads. Throws std::invalid_argument where rows are missing, or
/// for a view without pixels.
Picture render_points(const PointsDoubleRef& points, const PointsRef& normals, const ColorsRef& colors,
                      const ValuesRef& radii, const PictureView& view, bool hide_reverse = false, int num_threads = 0);

}  // namespace nacre
