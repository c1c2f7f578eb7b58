// What options, points and reports hold, field by field; see base/archive.hpp. Whoever adds a field to one of these
// structs adds it here, and raises the format's version in model/checkpoint/checkpoint.cpp.
#pragma once

#include <cmath>

#include "base/archive.hpp"
#include "base/pose_check.hpp"
#include "nacre/frame_report.hpp"
#include "nacre/model_options.hpp"

namespace nacre {

template <class Archive>
void exchange(Archive& archive, Pose& pose) {
  archive(pose.matrix());
  archive.require(is_rigid(pose), "a pose is not a rotation and a finite translation");
}

template <class Archive>
void exchange(Archive& archive, NoiseModel& noise) {
  archive(noise.constant, noise.quadratic, noise.offset, noise.shared);
}

template <class Archive>
void exchange(Archive& archive, DepthOptions& options) {
  archive.choice(options.edge_test, EdgeTest::inverse_depth);
  archive(options.min_depth, options.max_depth, options.gradient_threshold, options.edge_dilation, options.edge_sigmas,
          options.planar_keep_sigmas, options.max_slant, options.max_missing, options.min_component, options.tilt,
          options.noise);
}

template <class Archive>
void exchange(Archive& archive, RegionOptions& options) {
  archive(options.min_x, options.max_x, options.min_y, options.max_y, options.min_z, options.max_z, options.object,
          options.min_object, options.plane_margin);
}

template <class Archive>
void exchange(Archive& archive, AlignOptions& options) {
  archive.choice(options.method, Metric::paper);
  archive(options.max_iterations, options.max_distance, options.final_distance, options.gate_decay, options.max_angle,
          options.robust, options.sample_fraction, options.max_points, options.max_samples, options.coarse_samples,
          options.keep_best, options.weak_threshold, options.seed, options.num_threads);
}

template <class Archive>
void exchange(Archive& archive, FusionOptions& options) {
  archive(options.support, options.max_angle, options.max_confidence, options.min_observations,
          options.max_free_space_violations, options.reference_sigma);
}

template <class Archive>
void exchange(Archive& archive, WlopOptions& options) {
  archive(options.radius, options.iterations, options.mu);
  archive.choice(options.theta, Theta::printed);
  archive(options.first_fraction, options.kept_fraction, options.new_fraction, options.normal_neighbors,
          options.normal_radius, options.seed);
}

template <class Archive>
void exchange(Archive& archive, ModelOptions& options) {
  archive(options.depth, options.region, options.registration);
  archive.choice(options.fusion_method, FusionMethod::wlop_plus);
  archive(options.fusion, options.wlop, options.binning, options.calibrate_depth, options.deform, options.spacing,
          options.max_points, options.predict_motion, options.relocalise, options.loop_closure, options.denoise_samples,
          options.verify, options.min_score, options.num_threads);
}

template <class Archive>
void exchange(Archive& archive, PointAttribute& attribute) {
  archive(attribute.name, attribute.num_channels, attribute.values);
}

template <class Archive>
void exchange(Archive& archive, PointModel& model) {
  archive(model.points, model.normals, model.colors, model.attributes, model.confidence, model.last_seen,
          model.observations, model.free_space_violations);
}

template <class Archive, class... Counts>
void exchange_counts(Archive& archive, Counts&... counts) {
  archive(counts...);
  archive.require((... && (counts >= 0)), "a count is negative");
}

template <class Archive>
void exchange(Archive& archive, DepthReport& report) {
  exchange_counts(archive, report.num_pixels, report.num_invalid, report.num_out_of_range, report.num_masked,
                  report.num_edge, report.num_slanted, report.num_isolated, report.num_kept);
}

template <class Archive>
void exchange(Archive& archive, SupportPlane& plane) {
  archive(plane.normal, plane.offset);
}

template <class Archive>
void exchange(Archive& archive, RegionReport& report) {
  exchange_counts(archive, report.num_inside, report.num_outside);
  archive(report.planes, report.support, report.reason);
}

template <class Archive>
void exchange(Archive& archive, FusionReport& report) {
  exchange_counts(archive, report.num_updated, report.num_inserted, report.num_removed);
}

template <class Archive>
void exchange(Archive& archive, DeformationReport& report) {
  exchange_counts(archive, report.num_nodes);
  if (report.num_nodes > 0) archive.single(report.explained, report.strain);
}

// As whole nanoseconds.
template <class Archive>
void exchange(Archive& archive, StepTimes& times) {
  for (double* milliseconds : {&times.preprocess, &times.back_project, &times.region, &times.registration,
                               &times.loop_closure, &times.fuse, &times.normals, &times.total}) {
    std::int64_t nanoseconds = std::llround(1e6 * *milliseconds);
    archive(nanoseconds);
    *milliseconds = 1e-6 * static_cast<double>(nanoseconds);
  }
}

// Single precision, with one exponent for all, since that has few of them.
template <class Archive>
void exchange_symmetric(Archive& archive, Matrix6& matrix) {
  int exponent = 0;
  std::frexp(matrix.cwiseAbs().maxCoeff(), &exponent);
  archive(exponent);
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column <= row; ++column) {
      double value = std::ldexp(matrix(row, column), -exponent);
      archive.single(value);
      matrix(row, column) = matrix(column, row) = std::ldexp(value, exponent);
    }
  }
}

// Without index and pose; see FrameHistory.
template <class Archive>
void exchange(Archive& archive, FrameReport& report) {
  archive.choice(report.status, FrameStatus::relocalised);
  archive(report.timestamp, report.reason, report.num_inliers, report.is_on_plane);
  archive.single(report.overlap, report.consistency, report.score, report.rmse, report.loop_distance);
  bool was_matched = !report.information.isZero(0.0);
  archive(was_matched);
  if (was_matched) {
    archive.single(report.center.x(), report.center.y(), report.center.z());
    exchange_symmetric(archive, report.information);
  }
  archive(report.weak_directions, report.loop_frame, report.corrects_earlier, report.depth, report.region,
          report.num_moving, report.fusion, report.num_points, report.spacing, report.milliseconds, report.deformation);
}

}  // namespace nacre
