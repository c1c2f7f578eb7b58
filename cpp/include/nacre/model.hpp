/// The loop: depth frames in, a growing point model and a camera trajectory out.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "nacre/camera.hpp"
#include "nacre/checkpoint.hpp"
#include "nacre/consolidation.hpp"
#include "nacre/depth.hpp"
#include "nacre/fusion.hpp"
#include "nacre/normals.hpp"
#include "nacre/region.hpp"
#include "nacre/registration.hpp"
#include "nacre/types.hpp"

namespace nacre {

class FrameHistory;

/// What became of a frame.
enum class FrameStatus {
  tracked,      ///< registered and folded in
  weak,         ///< registered, but the data leaves a direction of the pose open: not folded in
  lost,         ///< not registered: the model is as it was before
  relocalised,  ///< registered again after being lost, and folded in
};
const char* to_string(FrameStatus status);  ///< TRACKED, WEAK, LOST, RELOCALISED

/// How a registered frame becomes part of the model.
enum class FoldIn {
  fuse,      ///< confidence-weighted fusion (fusion.hpp)
  wlop,      ///< the 2010 paper: WLOP of model and new points
  wlop_plus  ///< WLOP repaired for incremental use
};

/// All options of a model.
struct ModelOptions {
  DepthOptions depth;
  RegionOptions region;
  AlignOptions registration;
  FoldIn fold_in = FoldIn::fuse;
  FusionOptions fusion;
  ConsolidateOptions consolidation;  ///< its num_points is not used: see max_points
  NormalOptions normals;             ///< of the model, where fold_in is not fuse
  double spacing = 0.0;  ///< distance between model points [m]; 0: twice a pixel on the first frame's nearer surfaces;
                         ///< new points are also at least a pixel and a half of their frame apart
  int max_points = 500000;      ///< the model never grows beyond: its spacing is widened instead
  bool predict_motion = true;   ///< start also from the pose that continues the last motion
  bool relocalise = true;       ///< search where the guesses fail: for an object that turned on its supporting plane,
                                ///< around earlier poses, everywhere
  bool loop_closure = true;     ///< fuse: correct model and poses where the camera comes back to what it saw before
  bool denoise_samples = true;  ///< register surface points averaged over their pixels, not single pixels
  bool verify = true;           ///< judge registrations by their evidence
  double min_evidence = 0.3;    ///< a frame with less is lost; see FrameReport
  double first_fraction = 0.5;  ///< wlop: part of the first frame that becomes the model
  double kept_fraction = 0.9;   ///< wlop: part of the model that is kept at each frame
  double new_fraction = 0.2;    ///< wlop: new points, as a part of the model
  int num_threads = 0;          ///< 0: all

  /// "default" (what measures best) or "paper" (every number of the 2010 paper); std::invalid_argument otherwise.
  static ModelOptions preset(const std::string& name);
  void check() const;
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

/// What may come with a depth image.
struct FrameExtras {
  Colors colors;                           ///< height * width rows, row by row; empty: none
  std::vector<FrameAttribute> attributes;  ///< fused along with the points where fold_in is fuse
  MaskImage mask;                          ///< pixels of the object, see MaskImage
  std::optional<double> timestamp;         ///< [s]
  std::optional<Pose> guess;               ///< world_from_camera to start the registration from
  bool keep_guess = false;                 ///< take the guess for the pose, without registration
};

/// A 3D model that grows with every depth frame. The world is the first camera's frame unless the first frame comes
/// with a guess. Frames that cannot be registered change nothing.
class Model {
 public:
  explicit Model(const Camera& camera, const ModelOptions& options = {});
  ~Model();
  Model(Model&&) noexcept;
  Model& operator=(Model&&) noexcept;

  /// Depth [m], NaN or values that are not positive mean "no measurement". Throws std::invalid_argument when sizes do
  /// not fit or the depth scale cannot be right, before anything is changed.
  FrameReport add_frame(const DepthRef& depth, const FrameExtras& extras = {});

  const Camera& camera() const;
  const ModelOptions& options() const;        ///< with what the first frame decided
  const ModelOptions& given_options() const;  ///< as given
  const PointModel& cloud() const;            ///< in the world frame
  PointModel cloud_in_camera() const;         ///< in the newest registered camera's frame
  /// One report per frame that was added. Where a later frame closed a loop, the poses are the corrected ones.
  FrameReports frames() const;
  NoiseModel noise() const;  ///< given, or measured from the frames so far
  double spacing() const;    ///< [m]; 0 before the first frame

  /// All that the model knows, as bytes; a model that is loaded from them goes on to the same bits. `note`: bytes of
  /// the caller's to keep with it. Read by every nacre with the same checkpoint_format, on every machine. To replace a
  /// file safely, write another one, flush it to disk and rename it.
  std::string save(const std::string& note = {}) const;
  /// Throws CheckpointError where the bytes are damaged, not all there, or of another format. They may come from
  /// anybody: sizes are checked before memory is allocated, and no code is run.
  static Model load(std::string_view bytes, std::string* note = nullptr);

 private:
  struct Impl;
  explicit Model(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace nacre
