/// What may come with a frame, and what became of it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "nacre/depth.hpp"
#include "nacre/fusion.hpp"
#include "nacre/region.hpp"
#include "nacre/tracking_report.hpp"
#include "nacre/types.hpp"

namespace nacre {

class FrameHistory;

/// What may come with a depth image.
struct FrameExtras {
  Colors colors;                           ///< height * width rows, row by row; empty: none
  std::vector<FrameAttribute> attributes;  ///< fused along with the points where fusion_method is fuse
  MaskImage mask;                          ///< pixels of the object, see MaskImage
  MaskImage confidence;                    ///< how sure the camera is of each pixel: levels of its own, whose worth
                                           ///< registered frames tell; empty: all alike
  std::optional<double> timestamp;         ///< [s]
  std::optional<Pose> guess;               ///< world_from_camera to start the registration from
  bool keep_guess = false;                 ///< take the guess for the pose; registration only learns the noise from it
  bool movable = false;                    ///< whether loops that close later may move a guess that is kept
  bool search = true;                      ///< look elsewhere, too, for a frame lost near its guess (relocalise)
};

/// Wall time of each step of the loop [ms].
struct StepTimes {
  double preprocess = 0, back_project = 0, region = 0, registration = 0, loop_closure = 0, fuse = 0, normals = 0,
         total = 0;
};

/// How a model that deforms is at a frame.
struct DeformationReport {
  std::int64_t num_nodes = 0;  ///< of the warp field
  double explained = 0.0;      ///< part of the model's points in view that the frame shows where they were bent to
  double strain = 0.0;         ///< root mean square of how much the distances of neighbouring nodes changed, as a part
};

/// What became of one frame.
struct FrameReport : TrackingReport {
  std::int64_t index = 0;
  std::optional<double> timestamp;         ///< [s], as given
  std::optional<std::int64_t> loop_frame;  ///< the earlier frame that this one closed a loop with
  double loop_distance = 0.0;              ///< between the surfaces that the two saw, before [m]
  bool corrects_earlier = false;           ///< whether it changed reports of earlier frames
  DepthReport depth;
  RegionReport region;
  std::int64_t num_moving = 0;  ///< pixels left out: what moved before the scene, or with the camera
  FusionReport fusion;
  DeformationReport deformation;
  std::int64_t num_points = 0;  ///< of the model, after the frame
  double spacing = 0.0;         ///< of the model [m]
  StepTimes milliseconds;
};

/// The reports of a model's frames, oldest first; each is made when it is asked for. Valid until the next frame is
/// added.
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
