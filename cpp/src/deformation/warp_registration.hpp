// How has the shape bent? Registration of a deformable model to a frame.
#pragma once

#include <cstdint>
#include <vector>

#include "deformation/shown_surface.hpp"
#include "deformation/warp_field.hpp"

namespace nacre {

struct WarpFit {
  double explained = 0.0;      // part of the points in view that the frame shows where they are
  bool is_bent = false;        // most of it; or the shape as it was explains as much as noise lets it, and stays
  bool is_whole = false;       // all of it is bent
  std::vector<WarpNode> bent;  // the nodes as the frame would have them, in any case
};

// Bends the field until the model's points in view (their rows; canonical) lie on what the frame shows: Gauss and
// Newton's method on point-to-plane residuals, and as rigid as possible between nodes (Sorkine and Alexa 2007):
//   sum of w (n . (q - phi(x)))^2 / sigma^2 + sum over edges, both ways, h(|e| / strain) + |e - e_before|^2 / change^2
//   with n the mean normal of both sides (Rusinkiewicz 2019), h Huber's, e = R_l (g_m - g_l) + p_l - p_m, e_before: at
//   the frame before,
// with the nearest points q of what is shown, within a gate that narrows from half the distance between nodes.
// colors: of the model's points; where both sides have brightness, rows (b - B(phi(x)) - exposure)^2 / sigma_b^2 join,
// linear in the frame's brightness B along its surface (Park, Zhou and Koltun 2017), weighed as Geman and McClure do.
// Each part of the field (see parts_of) that a bend explains by chance alone stays as it was.
// was_bending: the first nodes, at the frame before: then their parts most likely go on.
WarpFit register_warp(WarpField& field, const OrientedPoints& canonical, const std::vector<std::int32_t>& in_view,
                      const ShownSurface& shown, int num_threads, const std::vector<std::uint8_t>& was_bending = {},
                      const std::vector<Eigen::Vector3f>& colors = {});

}  // namespace nacre
