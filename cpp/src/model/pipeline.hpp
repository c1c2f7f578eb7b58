// The loop, and all that it knows between frames.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "deformation/deforming_shape.hpp"
#include "fusion/observer.hpp"
#include "loops/loop_closure.hpp"
#include "model/frame_history.hpp"
#include "model/parked_points.hpp"
#include "nacre/depth_calibration.hpp"
#include "nacre/frame_report.hpp"
#include "nacre/model_options.hpp"
#include "tracking/carried_things.hpp"
#include "tracking/confidence_noise.hpp"
#include "tracking/object_view.hpp"
#include "tracking/relocalisation_filter.hpp"
#include "tracking/residual_noise.hpp"
#include "tracking/still_scene.hpp"
#include "tracking/tracking.hpp"
#include "tracking/usual_consistency.hpp"

namespace nacre {

// A frame as it came.
struct StartFrame {
  DepthImage depth;
  FrameExtras extras;
  std::int64_t index = 0;
};

struct Pipeline {
  Camera given_camera;   // of images as they come
  Camera camera;         // of images as they are worked on, and all below: see ModelOptions::binning
  ModelOptions given;    // options as given
  ModelOptions options;  // what the first frame decides is filled in
  Frame frame;           // the newest; its memory and the observer's are used again for the next
  SurfaceObserver observer{camera, options.fusion};
  MaskImage region;  // of the newest frame; empty where nothing is left out
  NoiseCalibration calibration{camera};
  std::optional<DepthCalibrator> depth_views;   // where depth is to be calibrated
  std::vector<std::int32_t> depth_view_frames;  // their numbers
  PointModel cloud;                             // in memory
  BlockIndex blocks;                            // of the cloud
  ParkedFiles files;                            // of what leaves memory
  ParkedPoints parked{files};                   // the rest of the model
  std::optional<DeformingShape> shape;          // of a cloud that deforms
  LoopClosure loops{camera, options, files};
  FrameHistory history;
  StillScene still_scene{camera};
  CarriedThings carried;
  CoarseFrame cells;                   // of the newest frame
  DepthView now;                       // of the newest, from the origin: where the camera is, is to be found
  std::vector<OutlinePoint> outline;   // of the newest
  DepthView before;                    // of the newest frame that was fused
  ConfidenceNoise confidence_noise;    // of registered frames
  ResidualNoise residual_noise;        // of registered frames, against what images show
  UsualConsistency usual_consistency;  // likewise, between them and the model
  double noise_factor = 1.0;           // of the newest frame
  FrameOdometry odometry;              // up to the newest
  PlaceHypothesis hypothesis;          // while the camera is lost
  std::vector<ObjectView> views;       // of an object that stands on a plane, from different directions
  double spacing = 0.0;
  std::int64_t num_lost = 0;             // frames in a row, up to the newest
  std::int64_t num_vain = 0;             // of them, those that showed something
  std::int64_t num_open = 0;             // registered frames in a row that left directions open, up to the newest
  double open_noise_factor = 1.0;        // with which the newest of them was found
  std::string torn;                      // why the newest frame is part of the model in part alone
  std::vector<StartFrame> start_frames;  // while the model holds one frame: the newest that may begin another
  bool is_trial = false;                 // whether the third frame is to confirm the first two
  bool forgets_earlier = false;          // whether the next frame begins the model without those before

  // binning: what the first frame decided, 1 before.
  Pipeline(const Camera& camera_in, const ModelOptions& options_in, int binning);

  FrameReport add_frame(const DepthRef& depth, const FrameExtras& extras);
  std::optional<DepthCalibration> depth_calibration() const;
  std::int64_t num_points() const { return cloud.size() + parked.size(); }
  void require_whole() const;         // as it was after its newest frame
  double known_noise_factor() const;  // of the frames so far
  NoiseModel noise() const { return options.depth.noise ? *options.depth.noise : calibration.model(); }

 private:
  FrameReport add_whole(const DepthRef& depth, const FrameExtras& extras);
  FrameReport add_worked_on(const DepthRef& depth, const FrameExtras& extras, FrameReport report);
  // The steps of the loop, in their order.
  DepthImage preprocess(const DepthRef& depth, const MaskRef& mask, FrameReport& report);
  void organise(const DepthRef& depth, const DepthImage& clean, FrameReport& report);
  void keep_region(FrameReport& report);
  void observe(const FrameExtras& extras, FrameReport& report);
  void leave_out_carried(FrameReport& report);
  void forget_carried();
  void deform(const FrameExtras& extras, FrameReport& report);
  TrackingResult locate(const FrameExtras& extras, FrameReport& report);
  void leave_out_moving(const TrackingResult& tracking, const ColorsRef& colors, FrameReport& report);
  void close_loops(const TrackingResult& tracking, bool is_given, FrameReport& report);
  void keep_view(const FrameReport& report);
  void adjust_views(FrameReport& report);
  void fuse_frame(const FrameExtras& extras, FrameReport& report);
  void unbend(FrameReport& report);
  void remember_view(const FrameReport& report);
  void calibrate_depth(FrameReport& report);
  void make_room();
  void coarsen();

  // What they need.
  bool was_lost() const { return num_lost > 0; }
  bool jumped() const;
  bool keeps_key_frames() const {
    return options.loop_closure && options.fusion_method == FusionMethod::fuse && !shape;
  }
  void recall_where_camera_may_be(const FrameExtras& extras);
  void recall_layers(std::int32_t oldest_frame);
  TrackingResult register_frame(const FrameExtras& extras, const RegionReport& region_report);
  bool learns_noise() const;
  Pose earlier_pose() const;
  TrackingTarget tracking_target(std::int32_t oldest_frame = 0) const;
  bool tells_noise(const TrackingResult& tracking) const;
  void learn_from(const TrackingResult& tracking);
  void learn_from_given(const Pose& world_from_camera);
  void set_noise_factor(double factor);
  std::vector<double> noise_factors() const;
  TrackingResult track_frame(TrackingPrior prior, bool may_search);
  std::vector<Pose> guesses(const FrameExtras& extras) const;
  bool is_in_view(const Pose& world_from_camera, const Pose& last) const;
  std::vector<Pose> key_poses() const;
  RelocalisationPlaces elsewhere(const RegionReport& region_report, bool may_search) const;
  std::optional<ObjectView> view_of_object(const RegionReport& region_report) const;
  std::vector<Pose> depth_view_poses() const;
  void straighten(double tilt, FrameReport& report);
  void move_all(const std::vector<Pose>& corrections, FrameReport& report);
};

}  // namespace nacre
