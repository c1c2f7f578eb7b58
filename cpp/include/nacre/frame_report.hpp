/// What may come with a frame, and what became of it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "nacre/depth.hpp"
#include "nacre/frame_status.hpp"
#include "nacre/fusion.hpp"
#include "nacre/region.hpp"
#include "nacre/types.hpp"

namespace nacre {

class FrameHistory;

/// What may come with a depth image.
struct FrameExtras {
  Colors colors;                           ///< height * width rows, row by row; empty: none
  std::vector<FrameAttribute> attributes;  ///< fused along with the points where fold_in is fuse
  MaskImage mask;                          ///< pixels of the object, see MaskImage
  std::optional<double> timestamp;         ///< [s]
  std::optional<Pose> guess;               ///< world_from_camera to start the registration from
  bool keep_guess = false;                 ///< take the guess for the pose, without registration
};

/// Wall time of each step of the loop [ms].
struct StepTimes {
  double preprocess = 0, back_project = 0, region = 0, registration = 0, loop_closure = 0, fold_in = 0, normals = 0,
         total = 0;
};

/// What became of one frame. What comes of a registration is in single precision, but for the pose.
struct FrameReport {
  std::int64_t index = 0;
  std::optional<double> timestamp;  ///< [s], as given
  FrameStatus status = FrameStatus::lost;
  std::string reason;                         ///< why the frame is weak or lost; empty otherwise
  Pose world_from_camera = Pose::Identity();  ///< of a lost frame: the last known pose
  int num_inliers = 0;
  double overlap = 0.0;                   ///< part of the frame that matches the model
  double consistency = 0.0;               ///< part of the model's points in view that the frame does not see through,
                                          ///< and of the frame's that the camera did not see through before
  double evidence = 0.0;                  ///< that the registration is right, against chance: what the residuals tell a
                                          ///< match, times overlap^2 consistency^4 (^8 far from all guesses), less
                                          ///< where residuals of neighbours agree beyond noise; of an object that was
                                          ///< found turned on its supporting plane: what agrees less what contradicts
  double rmse = 0.0;                      ///< of the inliers, along the normals [m]
  Matrix6 information = Matrix6::Zero();  ///< see AlignResult
  Eigen::Matrix<double, 6, Eigen::Dynamic> weak_directions;  ///< see AlignResult
  std::optional<std::int64_t> loop_frame;                    ///< the earlier frame that this one closed a loop with
  double loop_distance = 0.0;                                ///< between the surfaces that the two saw, before [m]
  bool corrects_earlier = false;                             ///< whether it changed poses of earlier frames
  DepthReport depth;
  RegionReport region;
  FusionReport fusion;
  std::int64_t num_points = 0;  ///< of the model, after the frame
  double spacing = 0.0;         ///< of the model [m]
  StepTimes milliseconds;
};

/// The reports of a model's frames, oldest first; each is made when it is asked for. Valid as long as the model.
class FrameReports {
 public:
  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  FrameReport operator[](std::size_t index) const;  ///< index < size()
  FrameReport front() const { return (*this)[0]; }
  FrameReport back() const { return (*this)[size_ - 1]; }

  /// From one report to the next, each made where it is asked for.
  class Iterator {
   public:
    FrameReport operator*() const { return (*reports_)[index_]; }
    Iterator& operator++() {
      ++index_;
      return *this;
    }
    bool operator!=(const Iterator& other) const { return index_ != other.index_; }

   private:
    friend class FrameReports;
    Iterator(const FrameReports* reports, std::size_t index) : reports_(reports), index_(index) {}
    const FrameReports* reports_;
    std::size_t index_;
  };
  Iterator begin() const { return {this, 0}; }
  Iterator end() const { return {this, size_}; }

 private:
  friend class Model;
  explicit FrameReports(const FrameHistory& history);
  const FrameHistory* history_;
  std::size_t size_;
};

}  // namespace nacre
