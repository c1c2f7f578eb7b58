// What the parts of a model's state hold, field by field; see model/checkpoint/archive.hpp. Whoever adds a field to one
// of these structs adds it here, and raises the format's version in model/checkpoint/checkpoint.cpp.
#pragma once

#include "deformation/deforming_shape.hpp"
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
  archive(view.depth, view.sigma, view.world_from_camera, view.measured);
}

template <class Archive>
void exchange(Archive& archive, ObjectView& view) {
  archive(view.frame, view.world_from_camera, view.points, view.normals, view.depth, view.region, view.support,
          view.tolerance, view.size);
}

template <class Archive>
void exchange(Archive& archive, FrameCloud& cloud) {
  archive(cloud.points, cloud.normals, cloud.noise, cloud.sigma, cloud.depth);
}

template <class Archive>
void exchange(Archive& archive, OutlinePoint& point) {
  archive(point.point, point.normal, point.outward, point.pixel);
  const bool is_finite = point.point.allFinite() && point.normal.allFinite() && point.outward.allFinite();
  archive.require(is_finite, "an outline is not finite");
}

template <class Archive>
void exchange(Archive& archive, KeyFrame& key_frame) {
  archive(key_frame.frame, key_frame.cloud, key_frame.outline, key_frame.last_verified);
  key_frame.bounds = bounds_of(key_frame.cloud.points);
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
    archive(view.blocks, view.world_from_camera);
  }
  template <class Archive>
  static void exchange(Archive& archive, DepthCalibrator::Pair& pair) {
    archive(pair.first, pair.second, pair.motion);
  }
  template <class Archive>
  static void exchange(Archive& archive, DepthCalibrator::Fit& fit) {
    archive(fit.iteration, fit.tilt, fit.stretch, fit.last_step, fit.length, fit.pairs);
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
    archive(noise.log_scale_, noise.count_);
  }

  template <class Archive>
  static void exchange(Archive& archive, UsualConsistency& usual) {
    archive(usual.mean_.of_target, usual.mean_.of_source, usual.count_);
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
  static void exchange(Archive& archive, LoopClosure::TrajectoryNode& node) {
    archive(node.frame, node.key_frame, node.pose);
  }
  template <class Archive>
  static void exchange(Archive& archive, LoopClosure& loops) {
    archive(loops.key_frames_, loops.seen_with_, loops.graph_, loops.trajectory_, loops.first_verified_);
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
    archive(path.world_from_camera, path.uncertainty.shift, path.uncertainty.turn);
  }
  template <class Archive>
  static void exchange(Archive& archive, FrameOdometry& odometry) {
    archive(odometry.before_, odometry.path_, odometry.is_tracked_, odometry.motion_, odometry.largest_step_);
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
            parcel.first_gain, parcel.forgets_violations, parcel.is_named);
  }
  template <class Archive>
  static void exchange(Archive& archive, ParkedPoints::Released& released) {
    archive(released.file, released.checkpoint);
  }
  template <class Archive>
  static void exchange(Archive& archive, ParkedPoints& parked) {
    archive(parked.size_, parked.num_checkpoints_, parked.parcels_, parked.motions_, parked.gains_, parked.released_);
  }

  // Whether what was read can be gone on with.
  static bool is_sound(const NoiseCalibration& calibration);
  static bool is_sound(const DepthCalibrator& calibrator);
  static bool is_sound(const ConfidenceNoise& noise);
  static bool is_sound(const ResidualNoise& noise);
  static bool is_sound(const UsualConsistency& usual);
  static bool is_sound(const FrameHistory& history, const Camera& camera, const ModelOptions& options);
  static bool is_sound(const PoseGraph& graph);
  static bool is_sound(const LoopClosure& loops, std::size_t num_frames);
  static bool is_sound(const FrameOdometry& odometry);
  static bool is_sound(const DeformingShape& shape, std::size_t num_points, std::size_t num_frames);
  static bool is_sound(const StillScene& scene);
  static bool is_sound(const CarriedThings& things, const StillScene& scene);
  static bool is_sound(const ParkedPoints& parked, const BlockIndex& blocks, std::size_t num_points,
                       std::size_t num_frames);
};

template <class Archive, class T>
auto exchange(Archive& archive, T& value) -> decltype(PrivateState::exchange(archive, value)) {
  PrivateState::exchange(archive, value);
}

}  // namespace nacre
