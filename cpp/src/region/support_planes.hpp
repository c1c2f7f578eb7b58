// The planes of a frame on which things stand.
#pragma once

#include <algorithm>
#include <vector>

#include "base/limits.hpp"
#include "nacre/region.hpp"
#include "region/coarse_frame.hpp"
#include "region/limits.hpp"

namespace nacre {

// Which side of a plane a point is on. Depth cameras region_limits::bend planes by more than their noise: up to a wide
// margin a point belongs to the plane if its normal does, up to a narrow one in any case.
class PlaneCut {
 public:
  PlaneCut(const SupportPlane& plane, double margin)
      : normal_(plane.normal.cast<float>()),
        offset_(static_cast<float>(plane.offset)),
        margin_(static_cast<float>(margin)) {}

  float height(const Eigen::Vector3f& point) const { return normal_.dot(point) - offset_; }
  bool has_normal(const Eigen::Vector3f& normal) const { return normal.dot(normal_) > region_limits::least_cosine; }
  // 4 standard deviations and 2 pixels [m].
  float margin(float sigma, float pixel) const {
    return margin_ > 0.0F ? margin_ : base_limits::noise_sigmas * sigma + region_limits::plane_pixels * pixel;
  }

  // 1: before the plane, 0: on it, -1: behind it.
  int side(const Eigen::Vector3f& point, const Eigen::Vector3f& normal, float sigma, float pixel) const {
    float reach = margin(sigma, pixel);
    if (!(margin_ > 0.0F) && has_normal(normal)) reach = std::max(reach, region_limits::bend * point.norm());
    const float distance = height(point);
    return distance > reach ? 1 : distance < -reach ? -1 : 0;
  }

 private:
  Eigen::Vector3f normal_;
  float offset_, margin_;
};

// Finds planes on which things stand, largest first, and takes them and what lies behind them out of `left`
// (1: not put aside, one value a cell). on_plane becomes 1 for the cells of the planes.
std::vector<SupportPlane> put_planes_aside(const CoarseFrame& frame, const RegionOptions& options, int num_threads,
                                           std::vector<std::uint8_t>& left, std::vector<std::uint8_t>& on_plane);

}  // namespace nacre
