/// Depth images: cleaning (edge noise above all), back-projection, normals of organised points.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "nacre/camera.hpp"
#include "nacre/types.hpp"

namespace nacre {

/// The standard deviation of a depth value: sigma(z) = constant + quadratic * (z - offset)^2 [m].
///
/// It is the noise of a surface seen from the front. On a slanted one the depth is noisier, since a pixel also errs to
/// the side, by half a pixel or more (Nguyen et al. 2012, figure 7); across the surface the two effects of the slant
/// cancel, so that for a distance along the normal sigma(z) holds at any slant.
struct NoiseModel {
  double constant = 0.0;   ///< [m]
  double quadratic = 0.0;  ///< [1/m]
  double offset = 0.0;     ///< [m]
  double shared = 0.0;     ///< part of the variance that pixels near each other have in common, from 0 to below 1:
                           ///< structured light and stereo match windows; a simulated camera ignores it

  double sigma(double z) const { return constant + quadratic * (z - offset) * (z - offset); }
  /// The noise of pixels about a smooth surface fitted to 7 x 7 of them, which takes up most of what they share.
  NoiseModel local() const;

  /// Structured light, Nguyen et al. 2012: 1.2 mm + 1.9 mm (z - 0.4 m)^2.
  static NoiseModel kinect() { return {0.0012, 0.0019, 0.4, 0.0}; }
  /// Two cameras: disparity_sigma z^2 / (fx baseline), with the focal length in pixels. The defaults are those of a
  /// RealSense D435 on good texture (Grunnet-Jepsen et al., tuning D400 cameras).
  static NoiseModel stereo(double fx, double baseline = 0.05, double disparity_sigma = 0.08);
  /// Time of flight, Fankhauser et al. 2015 (Kinect v2): 1.5 mm - 0.5 mm z + 0.3 mm z^2.
  static NoiseModel time_of_flight() { return {0.0015 - 0.0003 * 25.0 / 36.0, 0.0003, 5.0 / 6.0, 0.0}; }

  void check() const;  ///< throws std::invalid_argument naming the field, what was expected and the value
};

/// Which pixels at depth edges are noise.
enum class EdgeTest {
  none,
  /// The paper's: strong gradients of depth (3 x 3 Sobel), dilated. A missing neighbour is a strong gradient.
  gradient,
  /// Second difference of inverse depth, zero on any plane, against its noise, which grows with the slant; a pixel
  /// beside a missing one is held against its two inner neighbours. And a slope cap. Keeps slanted surfaces.
  inverse_depth
};

/// What preprocess_depth removes. Every pixel that is removed becomes NaN.
struct DepthOptions {
  EdgeTest edge_test = EdgeTest::inverse_depth;
  double min_depth = 0.0;                                      ///< nearer values are removed [m]
  double max_depth = std::numeric_limits<double>::infinity();  ///< farther values are removed [m]
  double gradient_threshold = 0.005;                           ///< gradient test: depth step across one pixel [m]
  int edge_dilation = 1;            ///< both tests: an edge grows by so many pixels to its 4 neighbours
  double edge_sigmas = 4.0;         ///< inverse-depth test: threshold in standard deviations of the second difference
  double planar_keep_sigmas = 3.0;  ///< inverse-depth test: a pixel at an edge stays after all where it is no farther
                                    ///< from the plane through the surface on one side of it, in standard deviations
  double max_slant = 1.3962634;     ///< inverse-depth test: steeper surfaces are removed [rad]; 80 degrees
  double max_missing = 0.6;         ///< a pixel goes where more than this part of its 5 x 5 neighbours is missing
  int min_component = 20;           ///< connected speckles of fewer pixels go
  double tilt = 0.0;  ///< measured less true inverse depth, for each unit of x / z, which is taken away first [1/m]; a
                      ///< Model finds it where it can (depth_calibration.hpp)
  std::optional<NoiseModel> noise;  ///< unset: measured from the image itself (estimate_noise); a Model measures it
                                    ///< from all images so far (NoiseCalibration)

  void check() const;  ///< throws std::invalid_argument naming the field, what was expected and the value
};

/// How many pixels each step of preprocess_depth removed; the counts add up to num_pixels.
struct DepthReport {
  std::int64_t num_pixels = 0;
  std::int64_t num_invalid = 0;       ///< no measurement came in: 0, negative, NaN, inf, 65535 of integer images
  std::int64_t num_out_of_range = 0;  ///< nearer than min_depth, farther than max_depth
  std::int64_t num_masked = 0;
  std::int64_t num_edge = 0;
  std::int64_t num_slanted = 0;
  std::int64_t num_isolated = 0;
  std::int64_t num_kept = 0;
};

/// Metres from raw integers: value / depth_scale, NaN for 0 and 65535. depth_scale is in stored units a metre.
DepthImage depth_from_raw(
    const Eigen::Ref<const Eigen::Array<std::uint16_t, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>& raw,
    double depth_scale);

/// The noise of a depth image, from the residuals of local surface fits (robust) and, where the image is quantised to
/// plateaus, from their steps: for a pinhole camera the Kinect's curve scaled to them, for an orthographic camera a
/// constant. Where neighbouring pixels are too alike for independent noise, what they share is added. A clean image
/// gives a small positive floor, one without smooth patches the Kinect's curve (orthographic: a tenth of a pixel).
NoiseModel estimate_noise(const DepthRef& depth, const Camera& camera, int num_threads = 0);

class PlanarImage;
struct WindowFits;

/// The steps that depth comes in: of depth [m], or of its inverse [1/m], as whole pixels of disparity give.
struct DepthUnit {
  float step = 0.0F;  ///< 0 where noise hides it
  bool is_of_inverse = false;

  /// [m]
  double at(double depth) const { return static_cast<double>(step) * (is_of_inverse ? depth * depth : 1.0); }
};

/// The noise of a sensor, measured from the images of a recording: what estimate_noise finds in each, pooled, and for a
/// pinhole camera the curve over depth, where the images show several depths. The order of the images matters little,
/// the number of threads not at all.
class NoiseCalibration {
 public:
  explicit NoiseCalibration(const Camera& camera);

  /// Throws std::invalid_argument when the depth has not the camera's size. An image without smooth patches adds
  /// nothing.
  void add(const DepthRef& depth, int num_threads = 0);
  /// Of an image that is prepared already; for the library itself.
  void add(const PlanarImage& image, const WindowFits& fits, int num_threads);

  /// Before anything was added, what estimate_noise says of an empty image.
  NoiseModel model() const;
  /// The step that depth comes in, at the middle of what the images show [m]; 0 where noise hides it.
  double unit() const;

 private:
  friend struct PrivateState;
  struct Mean {
    double value = 0.0, count = 0.0;
  };
  static constexpr std::size_t num_bins = 36;  // of depth, a third of an octave each: from 1/64 m to 64 m

  Camera camera_;
  DepthUnit unit_;                        // that depth was rounded to
  Mean local_, total_, fitted_;           // logarithms of factors of the sensor's prior
  std::array<Mean, num_bins> bins_{};     // likewise, of what surface fits leave over
  std::array<Mean, num_bins> windows_{};  // of an image, that tell it
};

/// A copy of a depth image in which noise is NaN. Throws std::invalid_argument when depth and camera or mask differ in
/// size, and when the median depth lies outside 0.05-50 m (the message names depth_scale).
DepthImage preprocess_depth(const DepthRef& depth, const Camera& camera, const DepthOptions& options = {},
                            const MaskRef& mask = MaskImage(), DepthReport* report = nullptr, int num_threads = 0);

/// What became of a pixel, the first reason that applies.
enum class PixelLabel : std::uint8_t { kept, invalid, out_of_range, masked, edge, slanted, isolated };

/// Why preprocess_depth removes each pixel: height x width values of PixelLabel, which count up to its DepthReport.
MaskImage label_pixels(const DepthRef& depth, const Camera& camera, const DepthOptions& options = {},
                       const MaskRef& mask = MaskImage(), int num_threads = 0);

/// The valid pixels as points of the camera frame, row by row.
Points back_project(const DepthRef& depth, const Camera& camera, int num_threads = 0);

/// A depth image as organised points: row v * width + u of each array belongs to pixel (u, v); NaN where invalid.
struct Frame {
  int width = 0, height = 0;
  Points points;                    ///< camera frame [m]
  Points normals;                   ///< unit length, towards the camera; NaN where no plane fits
  Values sigma;                     ///< standard deviation of the depth [m]
  std::vector<std::int32_t> valid;  ///< the rows that have a point and a normal, ascending
};

/// Points and normals of a cleaned depth image. A plane is affine in inverse depth over the image of a pinhole camera
/// and affine in depth for an orthographic one, so a normal is one linear fit over a window; the window (5 x 5 to
/// 11 x 11) grows with the noise, and pixels across a depth edge are left out of it. Unset noise is measured from the
/// image itself (estimate_noise). The second form reuses the memory of a frame of the same size.
Frame make_frame(const DepthRef& depth, const Camera& camera, const std::optional<NoiseModel>& noise = std::nullopt,
                 int num_threads = 0);
void make_frame(const DepthRef& depth, const Camera& camera, const std::optional<NoiseModel>& noise, int num_threads,
                Frame& frame);

/// The normals of make_frame alone.
Points depth_normals(const DepthRef& depth, const Camera& camera, const std::optional<NoiseModel>& noise = std::nullopt,
                     int num_threads = 0);

}  // namespace nacre
