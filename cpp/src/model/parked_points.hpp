// The part of a model that is far from the camera, on disk.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/parked_files.hpp"
#include "fusion/block_index.hpp"

namespace nacre {

// Points that leave a model, each parcel a file, and come back to their place among the others when a camera looks at
// them: the model goes on as if they had stayed. What happens to the model meanwhile happens to them when they come
// back.
class ParkedPoints {
 public:
  explicit ParkedPoints(ParkedFiles& files) : files_(files) {}

  std::int64_t size() const { return size_; }  // points

  // Points beyond so many leave that no later frame than oldest_frame has seen, and that are out of view: those first
  // that have not been seen for longest.
  void park(PointModel& model, BlockIndex& blocks, std::int64_t most_points, std::int32_t oldest_frame,
            const ViewVolume& view);
  // Those come back that may have points in one of some volumes, or boxes.
  void recall(PointModel& model, BlockIndex& blocks, const std::vector<ViewVolume>& volumes);
  void recall(PointModel& model, BlockIndex& blocks, const std::vector<Box>& near);
  void recall_all(PointModel& model, BlockIndex& blocks) {
    recall(model, blocks, std::vector<std::uint8_t>(parcels_.size(), 1));
  }

  // Some of those to which something has yet to be done are written anew: what it is need not be kept for long. Says
  // whether they were the last.
  bool settle_some();

  // What has happened to the model; see move_points, straighten_points, expose_points, merge_layers.
  void move(const std::vector<Pose>& corrections);
  void straighten(const std::vector<Pose>& poses, double tilt);
  void expose(const Eigen::Vector3f& gain);
  void forget_violations();

  // Calls visit with parts of all that there is, in the model's order.
  template <class Visit>
  void for_each_part(const PointModel& model, const BlockIndex& blocks, Visit&& visit) const;

 private:
  friend struct PrivateState;
  struct Parcel {
    std::string file;
    std::int64_t count = 0;
    Eigen::Vector3f lowest, highest;   // bounds of the points
    std::vector<std::int32_t> frames;  // that last observed them, in order
    std::int64_t first_motion = 0;     // of those since it left
    std::int64_t first_gain = 0;       // likewise
    bool forgets_violations = false;
  };

  // Points of the model and parcels, one after the other in its order, that are to be one parcel.
  struct Leaving {
    std::size_t first, end;                // points
    std::size_t first_parcel, end_parcel;  // from between and beside them
  };

  static std::vector<Leaving> divided(const std::vector<BlockIndex::Summary>& blocks,
                                      const std::vector<BlockIndex::Gap>& gaps);
  PointModel gathered(const PointModel& model, const BlockIndex& blocks, const Leaving& leaving) const;
  void take_out(PointModel& model, BlockIndex& blocks, const std::vector<Leaving>& leaving,
                std::vector<Parcel> written);
  PointModel read(const Parcel& parcel) const;
  Parcel write(PointModel points);
  void replace_all(std::vector<Parcel> parcels);
  void recall(PointModel& model, BlockIndex& blocks, const std::vector<std::uint8_t>& is_wanted);

  ParkedFiles& files_;
  std::int64_t size_ = 0;
  std::vector<Parcel> parcels_;             // in the model's order; their places are the index's gaps
  std::vector<std::vector<Pose>> motions_;  // corrections, by frame
  std::vector<Eigen::Vector3f> gains_;
};

// Some of a model's points, behind another's. Colours and attributes that either lacks are not known.
void append_range(PointModel& model, const PointModel& more, std::size_t first, std::size_t count);

template <class Visit>
void ParkedPoints::for_each_part(const PointModel& model, const BlockIndex& blocks, Visit&& visit) const {
  std::size_t done = 0;
  const auto visit_until = [&](std::size_t end) {
    if (end == done) return;
    PointModel part;
    append_range(part, model, done, end - done);
    visit(part);
    done = end;
  };
  for (std::size_t k = 0; k < parcels_.size(); ++k) {
    visit_until(blocks.gaps()[k].place);
    PointModel part;
    const PointModel parked = read(parcels_[k]);
    append_range(part, model, 0, 0);  // its colours and attributes
    append_range(part, parked, 0, parked.points.size());
    visit(part);
  }
  visit_until(model.points.size());
}

}  // namespace nacre
