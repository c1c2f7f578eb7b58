// What key frames saw: the newest in memory, older ones there or on disk.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/parked_files.hpp"
#include "keypoints/keypoints.hpp"
#include "nacre/types.hpp"
#include "outlines/occluding_edges.hpp"

namespace nacre {

// In its camera's frame.
struct KeyFrameView {
  Points points, normals;  // of the surface, at random
  std::vector<OutlinePoint> outline;
  Keypoints keypoints = {};
};

template <class Archive>
void exchange(Archive& archive, OutlinePoint& point) {
  archive(point.point, point.normal, point.outward, point.pixel);
  const bool is_finite = point.point.allFinite() && point.normal.allFinite() && point.outward.allFinite();
  archive.require(is_finite, "an outline is not finite");
}

template <class Archive>
void exchange(Archive& archive, KeyFrameView& view) {
  archive(view.points, view.normals, view.outline, view.keypoints.points, view.keypoints.descriptors);
  archive.require(view.points.rows() == view.normals.rows(), "not every point of a key frame has a normal");
  archive.require(view.keypoints.points.rows() == static_cast<Eigen::Index>(view.keypoints.descriptors.size()),
                  "not every keypoint of a key frame has a descriptor");
  archive.require(view.keypoints.points.allFinite(), "a keypoint is not finite");
}

// By the number of the key frame. One that is on disk is read when it is asked for; those that were asked for last stay
// in memory.
class KeyFrameViews {
 public:
  explicit KeyFrameViews(ParkedFiles& files) : files_(files) {}

  int size() const { return static_cast<int>(places_.size()); }
  std::shared_ptr<const KeyFrameView> operator[](int key_frame) const;
  void add(KeyFrameView view) { places_.push_back({std::make_shared<KeyFrameView>(std::move(view)), {}, 0}); }
  void replace(int key_frame, KeyFrameView view);

  // Writes those that are not among the newest, where something may leave memory. Says whether there was one.
  bool park();

 private:
  friend struct PrivateState;
  struct Place {
    std::shared_ptr<KeyFrameView> view;  // none: on disk alone
    std::string file;                    // empty: in memory alone
    std::int64_t last_use;
  };

  void forget_longest_unused() const;

  ParkedFiles& files_;
  mutable std::vector<Place> places_;  // the first are those that have files
  std::size_t num_written_ = 0;
  mutable std::size_t num_read_ = 0;  // that are in memory, and on disk
  mutable std::int64_t num_uses_ = 0;
};

}  // namespace nacre
