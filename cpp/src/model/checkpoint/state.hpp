// What the parts of a model's state hold, field by field; see base/archive.hpp. Whoever adds a field to one of
// these structs adds it here, and raises the format's version in model/checkpoint/checkpoint.cpp.
#pragma once

#include "deformation/deforming_shape.hpp"
#include "loops/key_frame_views.hpp"
#include "loops/loop_closure.hpp"
#include "model/checkpoint/fields.hpp"
#include "model/frame_history.hpp"
#include "model/pipeline.hpp"
#include "tracking/carried_things.hpp"
#include "tracking/object_view.hpp"
#include "tracking/relocalisation_filter.hpp"
#include "tracking/still_scene.hpp"

namespace nacre {

template <class Archive>
void exchange(Archive& archive, DepthView& view) {
  archive(view.depth, view.sigma, view.world_from_camera, view.measured, view.brightness);
}

template <class Archive>
void exchange(Archive& archive, ObjectView& view) {
  archive(view.frame, view.world_from_camera, view.points, view.normals, view.depth, view.region, view.support,
          view.tolerance, view.size);
}

template <class Archive>
void exchange(Archive& archive, KeyFrame& key_frame) {
  archive(key_frame.frame, key_frame.depth, key_frame.bounds.min(), key_frame.bounds.max(), key_frame.last_verified);
}

template <class Archive>
void exchange(Archive& archive, PoseEdge& edge) {
  archive(edge.from, edge.to, edge.from_from_to, edge.information, edge.is_loop);
}

template <class Archive>
void exchange(Archive& archive, FrameAttribute& attribute) {
  archive(attribute.name, attribute.values);
}

template <class Archive>
void exchange(Archive& archive, StartFrame& frame) {
  FrameExtras& extras = frame.extras;
  archive(frame.depth, frame.index, extras.colors, extras.attributes, extras.mask, extras.confidence, extras.timestamp,
          extras.guess);
}

template <class Archive>
void exchange(Archive& archive, WarpBinding& binding) {
  archive(binding.nodes, binding.distances);
}

template <class Archive>
void exchange(Archive& archive, WarpNode& node) {
  archive(node.rest, node.parents, node.rotation, node.position);
}

template <class Archive>
void exchange(Archive& archive, WarpEdge& edge) {
  archive(edge.first, edge.second);
}

template <class Archive>
void exchange(Archive& archive, WarpField& field) {
  archive(field.node_spacing, field.nodes, field.edges, field.bindings);
}

template <class Archive>
void exchange(Archive& archive, BlockIndex::Gap& gap) {
  archive(gap.place, gap.count);
}

// Of classes that keep theirs to themselves.
struct PrivateState {
  template <class Archive>
  static void exchange(Archive& archive, NoiseCalibration::Mean& mean) {
    archive(mean.value, mean.count);
  }
  template <class Archive>
  static void exchange(Archive& archive, NoiseCalibration& calibration) {
    archive(calibration.unit_.step, calibration.unit_.is_of_inverse);
    for (NoiseCalibration::Mean* mean : {&calibration.local_, &calibration.total_, &calibration.fitted_}) {
      exchange(archive, *mean);
    }
    for (NoiseCalibration::Mean& bin : calibration.bins_) exchange(archive, bin);
    for (NoiseCalibration::Mean& windows : calibration.windows_) exchange(archive, windows);
  }

  template <class Archive>
  static void exchange(Archive& archive, DepthCalibrator::View& view) {
    archive(view.depths, view.world_from_camera);
  }
  template <class Archive>
  static void exchange(Archive& archive, DepthCalibrator::Pair& pair) {
    archive(pair.first, pair.second, pair.motion);
  }
  template <class Archive>
  static void exchange(Archive& archive, DepthCalibrator::Fit& fit) {
    archive(fit.iteration, fit.tilt, fit.stretch, fit.radial, fit.last_step, fit.length, fit.pairs);
  }
  template <class Archive>
  static void exchange(Archive& archive, DepthCalibrator& calibrator) {
    archive(calibrator.views_, calibrator.fit_);
  }

  template <class Archive>
  static void exchange(Archive& archive, ConfidenceNoise& noise) {
    for (ConfidenceNoise::Level& level : noise.levels_) archive(level.log_scale, level.count);
  }

  template <class Archive>
  static void exchange(Archive& archive, ResidualNoise& noise) {
    archive(noise.log_scale_, noise.count_, noise.has_told_, noise.num_frames_);
  }

  template <class Archive>
  static void exchange(Archive& archive, UsualConsistency& usual) {
    archive(usual.mean_.of_target, usual.mean_.of_source, usual.count_, usual.likeness_.agreement,
            usual.likeness_.num_squares, usual.num_alike_);
  }

  template <class Archive>
  static void exchange(Archive& archive, FrameHistory::Chunk& chunk) {
    archive(chunk.poses, chunk.ends, chunk.bytes);
  }
  template <class Archive>
  static void exchange(Archive& archive, FrameHistory& history) {
    archive(history.chunks_, history.registered_);
  }

  template <class Archive>
  static void exchange(Archive& archive, PoseGraph& graph) {
    archive(graph.poses_, graph.unknowns_, graph.num_unknowns_, graph.edges_);
  }

  template <class Archive>
  static void exchange(Archive& archive, KeyFrameViews::Place& place) {
    archive(place.file);
    if (!place.file.empty()) return;
    if (!place.view) place.view = std::make_shared<KeyFrameView>();
    archive(*place.view);
  }
  template <class Archive>
  static void exchange(Archive& archive, KeyFrameViews& views) {
    archive(views.places_, views.num_written_);
  }
  template <class Archive>
  static void exchange(Archive& archive, LoopClosure::TrajectoryNode& node) {
    archive(node.frame, node.key_frame, node.pose);
  }
  template <class Archive>
  static void exchange(Archive& archive, LoopClosure& loops) {
    archive(loops.key_frames_, loops.views_, loops.seen_with_, loops.graph_, loops.trajectory_, loops.first_verified_);
  }

  template <class Archive>
  static void exchange(Archive& archive, PlaceOdds& odds) {
    archive(odds.log_odds_, odds.num_views_);
  }
  template <class Archive>
  static void exchange(Archive& archive, PlaceHypothesis::Place& place) {
    archive(place.pose, place.followed, place.views, place.odds);
  }
  template <class Archive>
  static void exchange(Archive& archive, PlaceHypothesis& hypothesis) {
    archive(hypothesis.place_, hypothesis.depth_);
  }

  template <class Archive>
  static void exchange(Archive& archive, FrameOdometry::Surface& surface) {
    archive(surface.points, surface.normals);
  }
  template <class Archive>
  static void exchange(Archive& archive, FrameOdometry::Path& path) {
    archive(path.world_from_camera, path.uncertainty.shift, path.uncertainty.turn, path.is_seen);
  }
  template <class Archive>
  static void exchange(Archive& archive, FrameOdometry& odometry) {
    archive(odometry.before_, odometry.path_, odometry.is_tracked_, odometry.motion_, odometry.largest_turn_,
            odometry.largest_shift_);
  }

  template <class Archive>
  static void exchange(Archive& archive, StillScene& scene) {
    archive(scene.scene_, scene.all_, scene.moved_);
  }

  template <class Archive>
  static void exchange(Archive& archive, CarriedThings& things) {
    archive(things.depth_, things.is_carried_, things.scene_, things.changed_);
  }

  template <class Archive>
  static void exchange(Archive& archive, DeformingShape& shape) {
    archive(shape.field_, shape.states_);
  }

  template <class Archive>
  static void exchange(Archive& archive, ParkedPoints::Parcel& parcel) {
    archive(parcel.file, parcel.count, parcel.lowest, parcel.highest, parcel.frames, parcel.first_motion,
            parcel.first_gain, parcel.forgets_violations);
  }
  template <class Archive>
  static void exchange(Archive& archive, ParkedPoints& parked) {
    archive(parked.size_, parked.parcels_, parked.motions_, parked.gains_);
  }

  template <class Archive>
  static void exchange(Archive& archive, ParkedFiles::Released& released) {
    archive(released.file, released.checkpoint);
  }
  // A checkpoint names all files that are needed.
  template <class Archive>
  static void exchange(Archive& archive, ParkedFiles& files) {
    std::vector<std::string> names;
    for (const auto& [file, is_named] : files.is_named_) names.push_back(file);
    archive(names, files.num_checkpoints_, files.released_);
    for (const std::string& file : names) files.is_named_[file] = true;
  }

  // Whether what was read can be gone on with.
  static bool is_sound(const NoiseCalibration& calibration);
  static bool is_sound(const DepthCalibrator& calibrator);
  static bool is_sound(const ConfidenceNoise& noise);
  static bool is_sound(const ResidualNoise& noise);
  static bool is_sound(const UsualConsistency& usual);
  static bool is_sound(const FrameHistory& history, const Camera& camera, const ModelOptions& options);
  static bool is_sound(const PoseGraph& graph);
  static bool is_sound(const KeyFrameViews& views);
  static bool is_sound(const LoopClosure& loops, std::size_t num_frames);
  static bool is_sound(const FrameOdometry& odometry);
  static bool is_sound(const DeformingShape& shape, std::size_t num_points, std::size_t num_frames);
  static bool is_sound(const StillScene& scene);
  static bool is_sound(const CarriedThings& things, const StillScene& scene);
  static bool is_sound(const ParkedPoints& parked, const BlockIndex& blocks, std::size_t num_points,
                       std::size_t num_frames);
  static bool is_sound(const ParkedFiles& files, const ParkedPoints& parked, const LoopClosure& loops);
};

template <class Archive, class T>
auto exchange(Archive& archive, T& value) -> decltype(PrivateState::exchange(archive, value)) {
  PrivateState::exchange(archive, value);
}

}  // namespace nacre
