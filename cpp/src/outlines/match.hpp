// Two outlines beside each other: which points match, and what one camera says against the other's outline.
#pragma once

#include <vector>

#include "outlines/occluding_edges.hpp"

namespace nacre {

std::vector<OutlinePoint> moved(std::vector<OutlinePoint> outline, const Pose& pose);

double median_pixel(const std::vector<OutlinePoint>& outline);  // of one that is not empty [m]

// Of each point the nearest of another outline, closer than the gate [m], that ends a like surface towards a like side;
// -1 where there is none.
std::vector<int> nearest_edges(const std::vector<OutlinePoint>& outline, const std::vector<OutlinePoint>& others,
                               double gate, int num_threads);

// The part of an outline (world frame) with a match, without the points of which a sight does not say that the surface
// ends elsewhere: there it saw something farther, or nothing, before the outline, or that the surface goes on beyond. A
// surface that bends away, or is hidden, contradicts nothing. `pixel` and `noise` are those of the sight [m].
double agreement_of(const std::vector<OutlinePoint>& outline, const std::vector<int>& matches, const DepthView& sight,
                    const Camera& camera, double pixel, double noise);

}  // namespace nacre
