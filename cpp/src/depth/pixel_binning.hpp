// Images of fewer, larger pixels: each the mean of a block of the camera's.
#pragma once

#include <vector>

#include "nacre/camera.hpp"
#include "nacre/depth.hpp"

namespace nacre {

// The least factor with which a recording that begins with an image has so few measured pixels as are worked on, and
// hardly any gaps between them; 1 where depth comes in units coarser than such pixels: the mean would hide them.
int binning_for(const DepthRef& depth, const MaskRef& mask, const Camera& camera);

// What is seen in blocks of pixels.
class PixelBinning {
 public:
  // The mean inverse depth of those of a block that are of its median's surface; none where they are less than half of
  // the measured pixels that blocks have where they have any.
  PixelBinning(const DepthRef& depth, const Camera& camera, int factor, int num_threads);

  const DepthImage& depth() const { return binned_; }
  // The mean over the pixels whose depth was taken, one row a block; not finite values do not count.
  Colors mean(const Colors& colors) const;
  Attributes mean(const Attributes& values) const;
  // The commonest level of those pixels.
  MaskImage commonest(const MaskImage& levels) const;
  // Where at least half of a block is in the mask.
  MaskImage majority(const MaskImage& mask) const;

 private:
  int usual_count() const;
  // `values` is room for those of a block.
  float mean_depth(Eigen::Index row, Eigen::Index col, std::vector<float>& values) const;
  // visit(depth) for each pixel of a block, row by row.
  template <class Visit>
  void for_each_pixel(Eigen::Index row, Eigen::Index col, Visit&& visit) const;
  // visit(v, u) for each pixel of a block whose depth was taken.
  template <class Visit>
  void for_each_taken(Eigen::Index row, Eigen::Index col, Visit&& visit) const;

  DepthRef depth_;
  float gate_slope_;
  int factor_, num_threads_;
  DepthImage binned_;
  int usual_count_;
};

}  // namespace nacre
