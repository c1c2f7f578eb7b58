/// Systematic errors of depth cameras, found from overlapping views.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "nacre/camera.hpp"
#include "nacre/types.hpp"

namespace nacre {

/// How the inverse depth of a camera is off from one side of the image to the other, its focal length, and along what
/// its depth is measured.
///
/// Structured light and stereo measure a disparity along the image's rows, which is fx * baseline times the inverse
/// depth. Where pattern and camera, or the two cameras, do not fit each other quite in direction or focal length, it is
/// off in proportion to the column, and so is the inverse depth.
struct DepthCalibration {
  double tilt = 0.0;  ///< measured less true inverse depth, for each unit of x / z [1/m]
  double sigma = std::numeric_limits<double>::infinity();  ///< standard deviation, from how much pairs of views differ
  int num_pairs = 0;                                       ///< of views that it is from
  double focal_scale = 1.0;  ///< the focal length that makes the views agree best, by the camera's
  double focal_sigma = std::numeric_limits<double>::infinity();  ///< its standard deviation, likewise
  double radial = 0.0;  ///< 0 where depth is along the axis, as was said, 1 where it is along the rays
  double radial_sigma = std::numeric_limits<double>::infinity();  ///< its standard deviation, likewise

  bool is_significant() const;          ///< whether the tilt matters, and is beyond doubt
  bool has_wrong_focal_length() const;  ///< whether the focal length is off by more than 4 %, beyond doubt
  bool has_radial_depth() const;        ///< whether depth is along the rays rather than the axis, beyond doubt
};

/// Whether the depth of a camera can be calibrated: pinhole, with depth along its axis.
bool can_calibrate_depth(const Camera& camera);

/// A depth image without a tilt of its inverse depth; NaN where the correction would be more than a half, which no
/// calibration reaches, and where a pixel has no ray. Throws std::invalid_argument unless can_calibrate_depth, or when
/// depth and camera differ in size.
DepthImage correct_depth(const DepthRef& depth, const Camera& camera, double tilt, int num_threads = 0);

/// Finds the systematic error of depth and the focal length that make overlapping views agree best, and whether depth
/// is the distance along the rays.
///
/// Two views of one surface from different directions see it in different columns, stretched along different axes; what
/// the tilt of the inverse depth, a focal length and their relative pose together explain is fitted to all pairs of
/// successive views that are 0.1 to 0.6 rad apart (point to plane, Gauss and Newton, robust). Poses need to be about
/// right only. The idea, to calibrate depth by what overlaps in a recording, is that of Teichman, Miller and Thrun
/// 2013.
class DepthCalibrator {
 public:
  /// Throws std::invalid_argument unless can_calibrate_depth.
  explicit DepthCalibrator(const Camera& camera);

  /// A cleaned depth image, and where it was taken; in the order of the recording. Says whether it is used: not where
  /// it turned by less than 0.1 rad from the last one that is, nor when there are enough.
  bool add(const DepthRef& depth, const Pose& world_from_camera);
  bool is_new_direction(const Pose& world_from_camera) const;
  bool has_enough() const;
  int num_views() const { return static_cast<int>(views_.size()); }
  std::int64_t num_blocks() const;  ///< of pixels, that a view is averaged to

  /// What the views say, num_pairs 0 or 1 and no error where that is nothing, or a tilt that would turn what lies
  /// across the axis by more than the 0.1 rad by which the views are turned at least.
  DepthCalibration fit(int num_threads = 0) const;
  /// The same in parts, for a loop that must not wait: begins anew with the views that are there; each step is one
  /// iteration, the last of which returns what they say, and which comes early where the tilt will not be significant.
  void begin_fit();
  bool is_fitting() const { return fit_.has_value(); }
  std::optional<DepthCalibration> step(int num_threads = 0);

  /// Where the views were taken, as far as is known since.
  void set_poses(const std::vector<Pose>& world_from_camera);
  /// Takes a tilt away from the views, and returns where they were taken then, by one step of registration of each to
  /// the one before; the first stays. For a loop whose later images come without it.
  std::vector<Pose> correct(double tilt, int num_threads = 0);

 private:
  friend struct PrivateState;
  struct View {
    Values depths;  // of each block of pixels, NaN where there is none [m]
    Pose world_from_camera;
  };
  struct Pair {
    std::int32_t first, second;  // views
    Pose motion;                 // first_from_second
  };
  struct Fit {
    std::int32_t iteration = 0;
    double tilt = 0.0, stretch = 1.0, radial = 0.0;
    Eigen::Vector3d last_step = Eigen::Vector3d::Zero();  // [sigma] of Gauss and Newton
    double length = 1.0;                                  // of the step that was taken, of theirs
    bool asks_radial = false, is_done = false;
    std::vector<Pair> pairs;
  };
  Fit begun() const;
  DepthCalibration settled(Fit fit, int num_threads) const;
  DepthCalibration iterate(Fit& fit, int num_threads) const;
  double typical_depth() const;

  Camera camera_;
  Eigen::Matrix<float, Eigen::Dynamic, 2, Eigen::RowMajor> rays_;  // of each block of pixels: x / z and y / z
  std::vector<View> views_;
  std::optional<Fit> fit_;
};

}  // namespace nacre
