#include "model/pipeline.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <utility>

#include "base/check.hpp"
#include "base/limits.hpp"
#include "base/pose_check.hpp"
#include "camera/limits.hpp"
#include "camera/point_spacing.hpp"
#include "deformation/shown_surface.hpp"
#include "depth/cleaning.hpp"
#include "depth/inverse_depth_image.hpp"
#include "depth/pixel_binning.hpp"
#include "depth/saturation.hpp"
#include "fusion/attribute_fusion.hpp"
#include "fusion/correction.hpp"
#include "fusion/fuse.hpp"
#include "fusion/point_arrays.hpp"
#include "model/limits.hpp"
#include "model/object_views.hpp"
#include "model/stopwatch.hpp"
#include "model/wlop_fusion.hpp"

namespace nacre {
namespace {

// Twice the size of a pixel of the sensor on the nearer surfaces (the lower quartile of depth).
double spacing_for(const Frame& frame, const Camera& camera) {
  std::vector<float> z;
  z.reserve(frame.valid.size());
  for (const std::int32_t row : frame.valid) z.push_back(frame.points(row, 2));
  const auto quartile = z.begin() + static_cast<std::ptrdiff_t>(z.size() / 4);
  std::nth_element(z.begin(), quartile, z.end());
  return model_limits::spacing_pixels * camera.footprint(*quartile) / camera.binning();
}

void check_extras(const Camera& camera, const FrameExtras& extras, const PointModel& model) {
  const Eigen::Index pixels = static_cast<Eigen::Index>(camera.width()) * camera.height();
  require(extras.colors.rows() == 0 || extras.colors.rows() == pixels, "colors", "one row per pixel",
          extras.colors.rows());
  const MaskImage& confidence = extras.confidence;
  if (confidence.size() > 0) require_camera_size("confidence", confidence.rows(), confidence.cols(), camera);
  if (extras.mask.size() > 0) require_camera_size("mask", extras.mask.rows(), extras.mask.cols(), camera);
  check_attributes(extras.attributes, camera, model);
  require(!extras.keep_guess || extras.guess.has_value(), "keep_guess", "used with a guess", "no guess");
  require(!extras.movable || extras.keep_guess, "movable", "used with a guess that is kept", "none");
  if (extras.guess) require_rigid(*extras.guess, "guess");
}

// What comes with an image, of its averaged pixels.
FrameExtras averaged(const FrameExtras& extras, const PixelBinning& pixels) {
  FrameExtras result = extras;
  if (extras.colors.size() > 0) result.colors = pixels.mean(extras.colors);
  if (extras.mask.size() > 0) result.mask = pixels.majority(extras.mask);
  if (extras.confidence.size() > 0) result.confidence = pixels.commonest(extras.confidence);
  for (FrameAttribute& attribute : result.attributes) attribute.values = pixels.mean(attribute.values);
  return result;
}

}  // namespace

Pipeline::Pipeline(const Camera& camera_in, const ModelOptions& options_in, int binning)
    : given_camera(camera_in),
      camera(camera_in.binned(binning)),
      given(options_in),
      options(options_in),
      files(options_in.points_folder) {
  options.check();
  options.binning = binning;
  options.registration.num_threads = options.num_threads;
  spacing = options.spacing;
  require(options.depth.tilt == 0.0 || can_calibrate_depth(camera), "depth.tilt",
          "0 unless the camera is a pinhole with depth along its axis", options.depth.tilt);
  const bool sees_one_scene = !options.region.is_limited();  // what turns before a camera is none with what is around
  if (options.deform) shape.emplace();
  if (options.calibrate_depth && sees_one_scene && !shape && can_calibrate_depth(camera)) depth_views.emplace(camera);
}

// What is no measurement goes, pixels are averaged, and their systematic error is taken away, before all else.
FrameReport Pipeline::add_frame(const DepthRef& depth, const FrameExtras& extras) {
  require_whole();
  require_camera_size("depth", depth.rows(), depth.cols(), given_camera);
  check_extras(given_camera, extras, cloud);
  if (files.is_on()) make_room();
  const DepthImage measured = without_saturated(depth);
  try {
    return add_whole(measured.size() > 0 ? DepthRef(measured) : depth, extras);
  } catch (const std::filesystem::filesystem_error& error) {
    torn = error.what();
    throw;
  }
}

FrameReport Pipeline::add_whole(const DepthRef& depth, const FrameExtras& extras) {
  FrameReport report;
  if (options.binning == 1 && options.depth.tilt == 0.0) return add_worked_on(depth, extras, report);
  DepthImage image;
  std::optional<FrameExtras> others;
  {
    const Stopwatch total(report.milliseconds.total), watch(report.milliseconds.preprocess);
    if (options.binning > 1) {
      const PixelBinning pixels(depth, given_camera, options.binning, options.num_threads);
      others = averaged(extras, pixels);
      image = pixels.depth();
    }
    if (options.depth.tilt != 0.0) {
      image =
          correct_depth(options.binning > 1 ? DepthRef(image) : depth, camera, options.depth.tilt, options.num_threads);
    }
  }
  return add_worked_on(image, others ? *others : extras, report);
}

FrameReport Pipeline::add_worked_on(const DepthRef& depth, const FrameExtras& extras, FrameReport report) {
  report.index = static_cast<std::int64_t>(history.size());
  report.timestamp = extras.timestamp;
  // See begin_anew: it confirms both, or begins without those before.
  report.corrects_earlier = (is_trial && history.num_registered() == 2) || std::exchange(forgets_earlier, false);
  {
    const Stopwatch total(report.milliseconds.total);
    const DepthImage clean = preprocess(depth, extras.mask, report);
    organise(depth, clean, report);
    keep_region(report);
    observe(extras, report);
    if (shape) deform(extras, report);
    if (parked.size() > 0) recall_where_camera_may_be(extras);
    TrackingResult tracking = locate(extras, report);
    if (report.status == FrameStatus::lost && shape && shape->follow_at_any_rate(cloud, options.num_threads)) {
      blocks.renew(cloud);
      tracking = locate(extras, report);
    }
    if (report.status == FrameStatus::tracked && !shape) leave_out_moving(tracking, extras.colors, report);
    if (report.status != FrameStatus::lost) close_loops(tracking, extras.keep_guess && !extras.movable, report);
    if (report.status == FrameStatus::tracked) {
      if (was_lost()) report.status = FrameStatus::relocalised;
      confidence_noise.add(extras.confidence, frame, cloud, report.world_from_camera, camera);
      if (options.relocalise) keep_view(report);
      if (tracking.is_on_plane) adjust_views(report);
      fuse_frame(extras, report);
      remember_view(report);
      calibrate_depth(report);
    }
    if (shape) unbend(report);
    odometry.end_frame(report.status, report.world_from_camera, report.weak_directions);
    const bool is_lost = report.status == FrameStatus::lost && history.num_registered() > 0;
    num_lost = is_lost ? num_lost + 1 : 0;
    if (report.status != FrameStatus::lost) num_open = report.status == FrameStatus::weak ? num_open + 1 : 0;
    num_vain = is_lost ? num_vain + (frame.valid.size() >= base_limits::least_points) : 0;
    report.num_points = num_points();
    report.spacing = spacing;
  }
  history.add(report);
  return history.back();
}

// Without what is noise at depth edges. The noise is measured from all images so far.
DepthImage Pipeline::preprocess(const DepthRef& depth, const MaskRef& mask, FrameReport& report) {
  const Stopwatch watch(report.milliseconds.preprocess);
  return clean_depth(depth, camera, options.depth, mask, &calibration, &report.depth, nullptr, options.num_threads,
                     carried.scene());
}

// Points and normals.
void Pipeline::organise(const DepthRef& depth, const DepthImage& clean, FrameReport& report) {
  const Stopwatch watch(report.milliseconds.back_project);
  now.measured.resize(depth.size());
  Eigen::Map<DepthImage>(now.measured.data(), depth.rows(), depth.cols()) = depth;
  make_frame(clean, camera, noise(), options.num_threads, frame);
}

void Pipeline::keep_region(FrameReport& report) {
  const Stopwatch watch(report.milliseconds.region);
  report.region.num_inside = report.depth.num_kept;
  if (!options.region.is_limited()) return;
  MaskImage found = select_region(frame, camera, options.region, region, &report.region, options.num_threads);
  nacre::keep_region(found, frame);
  if (report.region.num_inside > 0) region = std::move(found);
}

// What the camera carries is no part of the scene.
void Pipeline::leave_out_carried(FrameReport& report) {
  if (shape || options.registration.method == Metric::paper) return;
  carried.look_at(cells, camera, report.index);
  forget_carried();
  if (carried.scene().size() == 0) return;
  const auto num_inside = static_cast<std::int64_t>(frame.valid.size());
  nacre::keep_region(carried.scene(), frame);
  for (Eigen::Index i = 0; i < carried.scene().size(); ++i) {
    if (carried.scene().data()[i] == 0) now.measured[i] = std::numeric_limits<float>::quiet_NaN();
  }
  report.num_moving = num_inside - static_cast<std::int64_t>(frame.valid.size());
  cells = StillScene::cells_of(frame, camera);
}

// Until it was found, what the camera carries was taken for a part of the scene.
void Pipeline::forget_carried() {
  const Values& depth = carried.found();
  if (depth.size() == 0) return;
  const auto is_carried = [&](Eigen::Index cell, float z) {
    return z < static_cast<float>(1.0 + camera_limits::another_surface) * depth[cell];
  };
  const Camera coarse = StillScene::camera_of_cells(camera);
  std::vector<std::uint8_t> stays(cloud.points.size(), 1);
  for (auto i = static_cast<std::size_t>(carried.since()); i < history.size(); ++i) {
    if (history[i].status == FrameStatus::lost) continue;
    const auto look = [&](Eigen::Index point, const PointProjection::Block& block, int k) {
      if (is_carried(block.pixel[k], block.z[k])) stays[static_cast<std::size_t>(point)] = 0;
    };
    visit_points_in_view(as_rows(cloud.points), as_rows(cloud.normals), 0, cloud.size(),
                         PointProjection(coarse, history.pose(i)), look);
  }
  if (std::find(stays.begin(), stays.end(), 0) != stays.end()) {
    cloud.keep(stays);
    blocks.keep(stays);
    blocks.renew(cloud);
  }
  for (Eigen::Index pixel = 0; pixel < before.depth.size(); ++pixel) {
    const Eigen::Index u = pixel % camera.width() / cells.step, v = pixel / camera.width() / cells.step;
    if (u >= cells.width || v >= cells.height || !is_carried(v * cells.width + u, before.depth[pixel])) continue;
    before.depth[pixel] = before.measured[pixel] = std::numeric_limits<float>::quiet_NaN();
  }
  still_scene = StillScene(camera);
}

// Makes the frame ready to be asked about points.
void Pipeline::observe(const FrameExtras& extras, FrameReport& report) {
  const Stopwatch watch(report.milliseconds.back_project);
  confidence_noise.scale(extras.confidence, frame);
  cells = StillScene::cells_of(frame, camera);
  leave_out_carried(report);
  if (!(options.fusion.reference_sigma > 0.0)) options.fusion.reference_sigma = median_sigma(frame);
  observer.look_at(frame, extras.colors, options.num_threads);
  now.brightness = brightness_of(extras.colors);
  now.depth = frame.points.col(2);
  now.sigma = frame.sigma;
  noise_factor = 1.0;
  set_noise_factor(known_noise_factor());
}

// Noise and gate are given, or learned from registered frames.
bool Pipeline::learns_noise() const { return !options.depth.noise && !(options.registration.final_distance > 0.0); }

double Pipeline::known_noise_factor() const { return learns_noise() ? residual_noise.factor() : 1.0; }

void Pipeline::set_noise_factor(double factor) {
  frame.sigma *= static_cast<float>(factor / noise_factor);
  now.sigma = frame.sigma;
  noise_factor = factor;
}

// What the camera may see of the shape, from where it most likely is, is bent until it lies on the frame.
void Pipeline::deform(const FrameExtras& extras, FrameReport& report) {
  if (!shape->has_nodes()) return;
  const Stopwatch watch(report.milliseconds.registration);
  shape->bend(cloud, options.num_threads);
  blocks.renew(cloud);
  if (frame.valid.size() < base_limits::least_points) return;
  const CurrentFrame current{frame, cells, camera, observer, now, noise_factor};
  const TrackingTarget target = tracking_target();
  const Pose pose = extras.keep_guess
                        ? *extras.guess
                        : FrameRegistration(current, target, options)
                              .from(guesses(extras).front(), FrameRegistration::Gate::narrow, Expectation::expected)
                              .alignment.target_from_source;
  const FrameSamples samples = sample_frame(frame, observer, options);
  ShownSurface shown = shown_surface(samples, pose, camera, spacing);
  if (observer.has_colors() && !cloud.colors.empty()) {
    add_brightness(shown, samples, pose, bright_cloud(frame, observer), spacing, options.num_threads);
  }
  // What registered frames err by beyond one image's noise, neighbours share.
  shown.shared_error = 1.0 - 1.0 / (noise_factor * noise_factor);
  const WarpFit fit = shape->follow(cloud, rows_facing(cloud, camera, pose), shown, options.num_threads);
  report.deformation.explained = fit.explained;
  blocks.renew(cloud);
}

void Pipeline::keep_view(const FrameReport& report) {
  if (!is_new_direction(views, report.world_from_camera)) return;
  std::optional<ObjectView> view = view_of_object(report.region);
  if (!view) return;
  view->frame = static_cast<std::int32_t>(report.index);
  view->world_from_camera = report.world_from_camera;
  views.push_back(std::move(*view));
}

// Views far apart see little of the same surface: all of them together determine the newest, and each other.
void Pipeline::adjust_views(FrameReport& report) {
  if (views.empty() || views.back().frame != report.index) return;
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < history.size(); ++i) poses.push_back(history.pose(i));
  poses.push_back(report.world_from_camera);
  const std::vector<Pose> corrections = adjust(views, poses, options.num_threads);
  move_all(corrections, report);
  if (keeps_key_frames()) loops.move(corrections);
}

// The poses of all frames, the newest included, and the model with them.
void Pipeline::move_all(const std::vector<Pose>& corrections, FrameReport& report) {
  report.corrects_earlier = true;
  history.move(corrections);
  move_points(cloud, corrections, options.num_threads);
  blocks.renew(cloud);
  parked.move(corrections);
  report.world_from_camera = corrections.back() * report.world_from_camera;
  still_scene.move(corrections.back());
  move_uncertainty(report, corrections.back());
}

// What moves before the scene is no part of it.
void Pipeline::leave_out_moving(const TrackingResult& tracking, const ColorsRef& colors, FrameReport& report) {
  const Stopwatch watch(report.milliseconds.registration);
  const double margin = camera_limits::surface_spacings * spacing;
  MaskImage still = tracking.still;
  if (still.size() == 0 && tracking.moving > 0.0) {
    still = still_scene.still_region(cells, report.world_from_camera, margin);
  }
  still_scene.add(cells, still, report.world_from_camera, margin);
  if (still.size() == 0) return;
  const auto num_inside = static_cast<std::int64_t>(frame.valid.size());
  nacre::keep_region(still, frame);
  report.num_moving += num_inside - static_cast<std::int64_t>(frame.valid.size());
  for (Eigen::Index i = 0; i < still.size(); ++i) {
    if (still.data()[i] == 0) now.depth[i] = now.measured[i] = std::numeric_limits<float>::quiet_NaN();
  }
  observer.look_at(frame, colors, options.num_threads);
}

// Where the camera comes back to what it saw before, model and poses are corrected.
void Pipeline::close_loops(const TrackingResult& tracking, bool is_given, FrameReport& report) {
  const Stopwatch watch(report.milliseconds.loop_closure);
  if (!keeps_key_frames()) return;
  const std::int32_t oldest_frame = loops.oldest_frame();
  const LoopReport loop =
      loops.add_frame({static_cast<std::int32_t>(report.index), frame, now, observer, outline, tracking.alignment,
                       spacing, is_given, was_lost() || tracking.is_to_whole_model});
  if (loop.corrections.empty()) return;
  report.loop_frame = loop.frame;
  report.loop_distance = loop.distance;
  if (report.status == FrameStatus::weak) {  // what it saw before determines its pose
    report.status = FrameStatus::tracked;
    report.reason.clear();
    report.weak_directions.resize(6, 0);
  }
  move_all(loop.corrections, report);
  const double noise = static_cast<double>(median_sigma(frame));
  if (parked.size() > 0) recall_layers(oldest_frame);
  const std::vector<std::uint8_t> kept = merge_layers(cloud, oldest_frame, spacing, [&](const Eigen::Vector3f& point) {
    const double distance = (point.cast<double>() - report.world_from_camera.translation()).norm();
    const double farther = camera.model() == Camera::Model::pinhole ? distance / loop.depth : 1.0;
    const double sigma = noise * farther * farther;  // noise grows with the square
    return spacing_at(static_cast<float>(distance), static_cast<float>(sigma), camera, spacing);
  });
  blocks.keep(kept);
  blocks.renew(cloud);
  give_back_room(cloud);
  parked.forget_violations();
  for (ObjectView& view : views) {
    view.world_from_camera = loop.corrections[static_cast<std::size_t>(view.frame)] * view.world_from_camera;
  }
}

// The frame becomes part of the model.
void Pipeline::fuse_frame(const FrameExtras& extras, FrameReport& report) {
  const auto index = static_cast<std::int32_t>(report.index);
  {
    const Stopwatch watch(report.milliseconds.fuse);
    if (!(spacing > 0.0)) spacing = spacing_for(frame, camera);
    if (options.fusion_method == FusionMethod::fuse) {
      const RegisteredFrame registered{frame, camera, observer, report.world_from_camera, index};
      if (parked.size() > 0)
        parked.recall(cloud, blocks, std::vector{observed_volume(registered, options.fusion, spacing)});
      Eigen::Vector3f gain;
      report.fusion = fuse_observed(cloud, blocks, registered, spacing, options.fusion, options.num_threads,
                                    extras.attributes, &gain);
      parked.expose(gain);
      const std::vector<std::uint8_t> kept = remove_violated(cloud, blocks, options.fusion, report.fusion);
      if (shape && !kept.empty()) shape->keep(kept);
    } else {
      consolidate_frame(cloud, frame, report.world_from_camera, options, spacing, index);
    }
    if (options.fusion_method == FusionMethod::fuse && !files.is_on()) coarsen();
  }
  if (options.fusion_method == FusionMethod::fuse) return;
  const Stopwatch watch(report.milliseconds.normals);
  renew_normals(cloud, options);
  blocks.renew(cloud);
}

void Pipeline::coarsen() {
  while (cloud.size() > options.max_points) {
    spacing *= model_limits::coarsening;
    const std::vector<std::uint8_t> kept = thinned(cloud, spacing);
    cloud.keep(kept);
    if (shape) shape->keep(kept);
    blocks.keep(kept);
    blocks.renew(cloud);
  }
}

// The shape is as it was, where the camera is lost.
void Pipeline::unbend(FrameReport& report) {
  if (report.status == FrameStatus::lost && shape->has_nodes()) shape->go_back(cloud, options.num_threads);
  const NoiseModel model = noise();
  const auto spacing_of = [&](float z) {
    const double sigma = noise_factor * model.sigma(static_cast<double>(z));
    return spacing_at(z, static_cast<float>(sigma), camera, spacing);
  };
  shape->unbend(cloud, report.world_from_camera, spacing, spacing_of, static_cast<std::int32_t>(report.index),
                options.num_threads);
  shape->end_frame();
  report.deformation.num_nodes = static_cast<std::int64_t>(shape->num_nodes());
  report.deformation.strain = shape->strain();
}

// What the camera saw is what the next frame is held against.
void Pipeline::remember_view(const FrameReport& report) {
  std::swap(before, now);
  before.world_from_camera = report.world_from_camera;
  now.world_from_camera = Pose::Identity();
}

}  // namespace nacre
