// What became of every frame, in as few bytes as tell it: the reports of a long run would outgrow its model.
#pragma once

#include <string>
#include <vector>

#include "nacre/frame_report.hpp"

namespace nacre {

// Moves what a report says of its pose's uncertainty.
void move_uncertainty(FrameReport& report, const Pose& motion);

class FrameHistory {
 public:
  std::size_t size() const {
    return chunks_.empty() ? 0 : per_chunk * (chunks_.size() - 1) + chunks_.back().ends.size();
  }
  void add(const FrameReport& report);  // the next
  FrameReport operator[](std::size_t index) const;
  FrameReport back() const { return (*this)[size() - 1]; }
  Pose pose(std::size_t index) const;  // world_from_camera

  // Of the frames that are not lost; of age 0 is the newest.
  std::size_t num_registered() const { return registered_.size(); }
  Pose registered_pose(std::size_t age) const {
    return pose(static_cast<std::size_t>(registered_[num_registered() - 1 - age]));
  }

  // The frames have moved, each by its motion.
  void move(const std::vector<Pose>& motions);

 private:
  friend struct PrivateState;
  static constexpr std::size_t per_chunk = 64;
  // Frames in a row. Later frames correct poses alone: what a report says of its pose's uncertainty is kept as the
  // camera sees it.
  struct Chunk {
    std::vector<Eigen::Matrix<double, 3, 4, Eigen::DontAlign>> poses;
    std::vector<std::uint32_t> ends;  // in the bytes, of each report
    std::string bytes;                // the rest of the reports
  };

  std::vector<Chunk> chunks_;
  std::vector<std::int32_t> registered_;
};

}  // namespace nacre
