// How bright a frame's colours are beside the model's.
#pragma once

#include <vector>

#include "fusion/block_index.hpp"
#include "fusion/registered_frame.hpp"
#include "nacre/fusion.hpp"

namespace nacre {

// A colour in another exposure; white stays white.
inline Eigen::Vector3f exposed(const Eigen::Vector3f& color, const Eigen::Vector3f& gain) {
  return color.cwiseProduct(gain).cwiseMin(255.0F);
}

// By what a frame's colours are to be multiplied, channel by channel, to be as the model's: the median over points that
// both show (of those in view), as exposure and white balance change the whole image alike. 1 where chance explains it.
Eigen::Vector3f color_gain(const PointModel& model, const BlockIndex& blocks, const std::vector<PointRange>& in_view,
                           const RegisteredFrame& now, double spacing);

// Multiplies the model's colours.
void expose_points(PointModel& model, const Eigen::Vector3f& gain);

// What the colours of a frame and of the model are to be multiplied by to have one exposure, the mean of all frames'.
struct SharedExposure {
  Eigen::Vector3f frame = Eigen::Vector3f::Ones(), model = Eigen::Vector3f::Ones();
};
SharedExposure share_exposure(const PointModel& model, const BlockIndex& blocks, const std::vector<PointRange>& in_view,
                              const RegisteredFrame& now, double spacing);

}  // namespace nacre
