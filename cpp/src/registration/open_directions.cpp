#include "registration/open_directions.hpp"

namespace nacre {

IcpResult determine_open_directions(const IcpResult& geometric, OpenDirectionSearch& search) {
  TwistBasis known;
  IcpResult result = geometric;
  for (const bool restricted : {false, true}) {
    const OpenFit fit = search.fit(geometric, restricted ? &known : nullptr);
    if (!fit.agrees) return geometric;
    // What shape says only where the search took it must be said by the rows, too.
    const bool is_shaped = fit.result.weak_directions.cols() == 0;
    const TwistBasis open = is_shaped ? geometric.weak_directions : fit.result.weak_directions;
    const Directions directions = search.determined(fit, open);
    if (is_shaped) return directions.weak.cols() == 0 ? fit.result : geometric;
    if (directions.sure.cols() == 0) return geometric;
    known = open * directions.sure;
    result = fit.result;
    result.weak_directions = open * directions.weak;
    add_information(fit.rows, known, fit.extent, fit.noise, result.information);
    if (directions.weak.cols() == 0) break;
  }
  return result;
}

}  // namespace nacre
