// How well two views of a surface agree at a pose.
#pragma once

#include "registration/limits.hpp"

namespace nacre {

// What a view says about points of another, as parts of all that were asked.
struct ViewAgreement {
  double agree = 0.0;         // it has such a surface there; less for one that is less close
  double seen_through = 0.0;  // it measured a surface behind them
  double occluded = 0.0;      // they face it, but it measured another surface before them
  double beyond = 0.0;        // they lie beyond the outline of what it measured

  double score(bool outlines = false) const {
    using namespace registration_limits;
    return agree - seen_through_weight * seen_through - occluded_weight * occluded -
           (outlines ? beyond_weight * beyond : 0.0);
  }
  double against(bool outlines) const { return seen_through + occluded + (outlines ? beyond : 0.0); }
};

}  // namespace nacre
