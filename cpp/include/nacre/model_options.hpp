/// The options of a model.
#pragma once

#include <cstdint>
#include <limits>
#include <string>

#include "nacre/consolidation.hpp"
#include "nacre/depth.hpp"
#include "nacre/fusion.hpp"
#include "nacre/region.hpp"
#include "nacre/tracking_options.hpp"

namespace nacre {

/// How a registered frame becomes part of the model.
enum class FusionMethod {
  fuse,      ///< confidence-weighted fusion (fusion.hpp)
  wlop,      ///< the 2010 paper: WLOP of model and new points
  wlop_plus  ///< WLOP repaired for incremental use
};

/// How WLOP fuses frames, where fusion_method is not fuse; see consolidation.hpp and normals.hpp.
struct WlopOptions {
  double radius = 0.008;  ///< support radius [m]
  int iterations = 10;
  double mu = 0.4;  ///< weight of the repulsion, 0 to 0.5
  Theta theta = Theta::huang;
  double first_fraction = 0.5;  ///< wlop: part of the first frame that becomes the model
  double kept_fraction = 0.9;   ///< wlop: part of the model that is kept at each frame
  double new_fraction = 0.2;    ///< wlop: new points, as a part of the model
  int normal_neighbors = 16;    ///< from which the normal of a point of the model is estimated, itself included
  double normal_radius = std::numeric_limits<double>::infinity();  ///< and how far away they may be [m]
  std::uint64_t seed = 0;                                          ///< of the choice of points

  void check() const;  ///< throws std::invalid_argument naming the field, what was expected and the value
};

/// All options of a model.
struct ModelOptions : TrackingOptions {
  DepthOptions depth;
  RegionOptions region;
  FusionMethod fusion_method = FusionMethod::fuse;
  FusionOptions fusion;
  WlopOptions wlop;
  /// Of a pinhole camera, each so many by so many pixels are averaged to one before all else. 1: none; 0: as few as
  /// leave 100 000 measured pixels of the first image, and hardly any gaps between them; none where its unit of depth
  /// is coarser or a region is asked for.
  int binning = 0;
  bool calibrate_depth = true;  ///< of a pinhole camera that looks at one scene, depth along its axis: find and correct
                                ///< its systematic error (depth_calibration.hpp)
  /// Distance between model points [m]. 0: twice the camera's pixel on the first frame's nearer surfaces; new points
  /// are also at least 1.5 pixels apart in their frame, and an averaged one.
  double spacing = 0.0;
  bool deform = false;      ///< the object bends: grow its canonical shape, and follow how it is at each frame
  int max_points = 500000;  ///< that the model keeps in memory; beyond them its spacing is widened, or points leave
  /// Where points go, beyond max_points, that are far from the camera: they come back when it does; and what older key
  /// frames saw. Used with loop_closure, where fusion_method is fuse and the object does not bend. Empty: none leave.
  std::string points_folder;

  /// "default" (what measures best) or "paper" (the 2010 paper's algorithm and numbers, alone);
  /// std::invalid_argument otherwise.
  static ModelOptions preset(const std::string& name);
  void check() const;
};

}  // namespace nacre
