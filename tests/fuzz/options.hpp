// Options of every kind from the fuzzer's bytes; numbers that are nothing but work stay small.
#pragma once

#include "bytes.hpp"
#include "nacre/model.hpp"

namespace nacre_fuzz {

inline NoiseModel noise_model(Bytes& bytes) {
  NoiseModel noise = NoiseModel::kinect();
  bytes.change(noise.constant), bytes.change(noise.quadratic), bytes.change(noise.offset), bytes.change(noise.shared);
  return noise;
}

inline DepthOptions depth_options(Bytes& bytes) {
  DepthOptions options;
  bytes.change_to(options.edge_test, 3);
  bytes.change(options.min_depth), bytes.change(options.max_depth), bytes.change(options.gradient_threshold);
  bytes.change(options.edge_dilation, -1, 100), bytes.change(options.edge_sigmas),
      bytes.change(options.planar_keep_sigmas);
  bytes.change(options.max_slant), bytes.change(options.max_missing), bytes.change(options.min_component, -1, 3000);
  if (bytes.boolean()) options.noise = noise_model(bytes);
  return options;
}

inline RegionOptions region_options(Bytes& bytes) {
  RegionOptions options;
  bytes.change(options.min_x), bytes.change(options.max_x), bytes.change(options.min_y), bytes.change(options.max_y);
  bytes.change(options.min_z), bytes.change(options.max_z), bytes.change(options.object);
  bytes.change(options.min_object), bytes.change(options.plane_margin);
  return options;
}

inline AlignOptions align_options(Bytes& bytes) {
  AlignOptions options;
  options.max_iterations = 8;
  bytes.change_to(options.method, 3);
  bytes.change(options.max_iterations, -1, 30), bytes.change(options.max_distance),
      bytes.change(options.final_distance);
  bytes.change(options.gate_decay), bytes.change(options.max_angle), bytes.change(options.robust);
  bytes.change(options.sample_fraction), bytes.change(options.max_points, -1, 300);
  bytes.change(options.max_samples, -1, 300), bytes.change(options.coarse_samples, -1, 300);
  bytes.change(options.keep_best), bytes.change(options.weak_threshold);
  options.seed = bytes.byte();
  options.num_threads = bytes.threads();
  return options;
}

inline ConsolidateOptions consolidate_options(Bytes& bytes) {
  ConsolidateOptions options;
  options.iterations = 3;
  options.radius = 0.3;
  options.num_points = 40;
  bytes.change_to(options.method, 3), bytes.change_to(options.theta, 2);
  bytes.change(options.radius), bytes.change(options.num_points, -1, 300), bytes.change(options.iterations, -1, 8);
  bytes.change(options.mu);
  options.seed = bytes.byte();
  options.num_threads = bytes.threads();
  return options;
}

inline FusionOptions fusion_options(Bytes& bytes) {
  FusionOptions options;
  bytes.change(options.support), bytes.change(options.max_angle), bytes.change(options.max_confidence);
  bytes.change(options.min_observations, -1, 300), bytes.change(options.max_free_space_violations, -1, 300);
  bytes.change(options.reference_sigma);
  return options;
}

inline WlopOptions wlop_options(Bytes& bytes) {
  WlopOptions options;
  options.iterations = 3;
  bytes.change_to(options.theta, 2);
  bytes.change(options.radius), bytes.change(options.iterations, -1, 8), bytes.change(options.mu);
  bytes.change(options.first_fraction), bytes.change(options.kept_fraction), bytes.change(options.new_fraction);
  bytes.change(options.normal_neighbors, -1, 40), bytes.change(options.normal_radius);
  options.seed = bytes.byte();
  return options;
}

inline ModelOptions model_options(Bytes& bytes) {
  ModelOptions options = bytes.byte() >= 192 ? ModelOptions::preset("paper") : ModelOptions();
  if (bytes.byte() >= 128) {
    options.depth = depth_options(bytes);
    options.region = region_options(bytes);
    options.registration = align_options(bytes);
    options.fusion = fusion_options(bytes);
    options.wlop = wlop_options(bytes);
  }
  bytes.change_to(options.fusion_method, 3);
  bytes.change(options.region.object), bytes.change(options.binning, -1, 9), bytes.change(options.spacing),
      bytes.change(options.max_points, -1, 400);
  bytes.change(options.predict_motion), bytes.change(options.relocalise), bytes.change(options.loop_closure);
  bytes.change(options.denoise_samples), bytes.change(options.verify), bytes.change(options.min_score);
  options.num_threads = bytes.threads();
  return options;
}

inline void check_cloud(const PointModel& cloud, const ModelOptions& options) {
  NACRE_HOLDS(cloud.size() <= options.max_points);
  NACRE_HOLDS(cloud.normals.size() == cloud.points.size());
  NACRE_HOLDS(cloud.colors.empty() || cloud.colors.size() == cloud.points.size());
  for (const Eigen::Vector3f& point : cloud.points) NACRE_HOLDS(point.allFinite());
}

}  // namespace nacre_fuzz
