/// The options of a model.
#pragma once

#include <string>

#include "nacre/consolidation.hpp"
#include "nacre/depth.hpp"
#include "nacre/fusion.hpp"
#include "nacre/normals.hpp"
#include "nacre/region.hpp"
#include "nacre/tracking_options.hpp"

namespace nacre {

/// How a registered frame becomes part of the model.
enum class FoldIn {
  fuse,      ///< confidence-weighted fusion (fusion.hpp)
  wlop,      ///< the 2010 paper: WLOP of model and new points
  wlop_plus  ///< WLOP repaired for incremental use
};

/// All options of a model.
struct ModelOptions : TrackingOptions {
  DepthOptions depth;
  RegionOptions region;
  FoldIn fold_in = FoldIn::fuse;
  FusionOptions fusion;
  ConsolidateOptions consolidation;  ///< its num_points is not used: see max_points
  NormalOptions normals;             ///< of the model, where fold_in is not fuse
  double spacing = 0.0;  ///< distance between model points [m]; 0: twice a pixel on the first frame's nearer surfaces;
                         ///< new points are also at least a pixel and a half of their frame apart
  int max_points = 500000;      ///< the model never grows beyond: its spacing is widened instead
  double first_fraction = 0.5;  ///< wlop: part of the first frame that becomes the model
  double kept_fraction = 0.9;   ///< wlop: part of the model that is kept at each frame
  double new_fraction = 0.2;    ///< wlop: new points, as a part of the model

  /// "default" (what measures best) or "paper" (every number of the 2010 paper); std::invalid_argument otherwise.
  static ModelOptions preset(const std::string& name);
  void check() const;
};

}  // namespace nacre
