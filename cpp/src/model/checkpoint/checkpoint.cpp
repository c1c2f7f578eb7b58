// A model as bytes, and back: a header (magic, format, nacre's version, length, checksum), then the state.
#include "model/checkpoint/checkpoint.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/check.hpp"
#include "base/seal.hpp"
#include "depth/limits.hpp"
#include "model/checkpoint/state.hpp"
#include "model/checkpoint/surface_check.hpp"
#include "model/limits.hpp"
#include "tracking/limits.hpp"

namespace nacre {
namespace {

struct CameraFields {
  Camera::Model model = Camera::Model::pinhole;
  DepthKind depth_kind = DepthKind::z;
  int width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0, pixel_size = 0;
  Camera::Distortion distortion{};
  int binning = 1;

  std::int64_t num_pixels() const { return static_cast<std::int64_t>(width) * height; }
  // Whether its rays take memory for every pixel.
  bool has_table() const { return distortion != Camera::Distortion{} || depth_kind == DepthKind::radial; }
  Camera camera() const {
    if (model == Camera::Model::orthographic) return Camera::orthographic(width, height, pixel_size);
    return Camera::pinhole(width, height, fx, fy, cx, cy, distortion, depth_kind, binning);
  }
};

CameraFields fields_of(const Camera& camera) {
  return {camera.model(), camera.depth_kind(), camera.width(),      camera.height(),     camera.fx(),     camera.fy(),
          camera.cx(),    camera.cy(),         camera.pixel_size(), camera.distortion(), camera.binning()};
}

template <class Archive>
void exchange(Archive& archive, CameraFields& fields) {
  archive.choice(fields.model, Camera::Model::orthographic);
  archive.choice(fields.depth_kind, DepthKind::radial);
  archive(fields.width, fields.height, fields.fx, fields.fy, fields.cx, fields.cy, fields.pixel_size, fields.distortion,
          fields.binning);
}

// What of a model is neither given nor of the newest frame alone.
template <class Archive>
void exchange_state(Archive& archive, Pipeline& state) {
  archive(state.options.fusion.reference_sigma, state.options.depth.tilt, state.depth_view_frames, state.region,
          state.calibration, state.confidence_noise, state.residual_noise, state.usual_consistency, state.cloud,
          state.loops, state.history, state.before, state.still_scene, state.carried, state.odometry, state.hypothesis,
          state.views, state.spacing, state.num_lost, state.num_vain, state.num_open, state.open_noise_factor,
          state.start_frames);
  std::vector<BlockIndex::Gap> gaps = state.blocks.gaps();
  if (state.files.is_on()) archive(state.files, state.parked, gaps);
  state.blocks.set_gaps(std::move(gaps));
  if (state.depth_views) archive(*state.depth_views);
  if (state.shape) archive(*state.shape);
}

// Space that the table of rays may take before a frame was fused: see load.
std::string filler_of(const CameraFields& camera, const Pipeline& state) {
  constexpr std::size_t bytes_per_pixel = 8;
  const bool is_needed = camera.has_table() && state.before.depth.size() == 0;
  return std::string(is_needed ? bytes_per_pixel * static_cast<std::size_t>(camera.num_pixels()) : 0, '\0');
}

// Whether all numbers are counts, of at most so many.
template <class... Counts>
bool are_counts(std::int64_t most, Counts... numbers) {
  return (... && (numbers >= 0 && numbers <= most));
}

bool is_sound(const DepthReport& depth, std::int64_t num_pixels) {
  std::int64_t left = num_pixels;  // each pixel is counted once; no sum of numbers that are made up may overflow
  for (const std::int64_t count : {depth.num_invalid, depth.num_out_of_range, depth.num_masked, depth.num_edge,
                                   depth.num_slanted, depth.num_isolated, depth.num_kept}) {
    if (!are_counts(left, count)) return false;
    left -= count;
  }
  return depth.num_pixels == num_pixels && left == 0;
}

bool is_sound(const RegionReport& region, std::int64_t num_kept) {
  return are_counts(num_kept, region.num_inside, region.num_outside) &&
         region.num_inside <= num_kept - region.num_outside && region.support >= -1 &&
         region.support < static_cast<int>(region.planes.size());
}

bool is_sound(const FrameReport& report, std::int64_t num_pixels, std::int64_t max_points) {
  return is_rigid(report.world_from_camera) && is_sound(report.depth, num_pixels) &&
         is_sound(report.region, report.depth.num_kept) &&
         are_counts(report.region.num_inside, report.num_inliers, report.fusion.num_inserted) &&
         are_counts(max_points, report.num_points, report.fusion.num_updated) &&
         are_counts(max_points + report.fusion.num_inserted, report.fusion.num_removed) &&
         (!report.loop_frame || is_within(*report.loop_frame, static_cast<std::size_t>(report.index)));
}

bool is_image(const MaskImage& image, const Camera& camera) {
  return image.rows() == camera.height() && image.cols() == camera.width();
}

bool is_sound(const StartFrame& frame, const Camera& camera, std::size_t num_frames) {
  const FrameExtras& extras = frame.extras;
  const Eigen::Index num_pixels = static_cast<Eigen::Index>(camera.width()) * camera.height();
  return is_within(frame.index, num_frames) && frame.depth.rows() == camera.height() &&
         frame.depth.cols() == camera.width() && (extras.colors.rows() == 0 || extras.colors.rows() == num_pixels) &&
         (extras.mask.size() == 0 || is_image(extras.mask, camera)) &&
         (extras.confidence.size() == 0 || is_image(extras.confidence, camera));
}

bool is_sound(const ObjectView& view, const Camera& camera, std::size_t num_frames) {
  return is_within(view.frame, num_frames) && view.points.rows() > 0 && view.normals.rows() == view.points.rows() &&
         view.depth.size() == static_cast<Eigen::Index>(camera.width()) * camera.height() &&
         is_image(view.region, camera);
}

}  // namespace

bool PrivateState::is_sound(const FrameHistory& history, const Camera& camera, const ModelOptions& options) {
  const std::int64_t num_pixels = static_cast<std::int64_t>(camera.width()) * camera.height();
  const std::size_t num_frames = history.size();
  const bool is_bounded = options.points_folder.empty();  // of those on disk a report may tell as many as it likes
  const std::int64_t most_points = is_bounded ? options.max_points : std::numeric_limits<std::int64_t>::max() / 2;
  for (const FrameHistory::Chunk& chunk : history.chunks_) {
    const bool is_last = &chunk == &history.chunks_.back();
    if (chunk.ends.empty() || chunk.ends.size() > FrameHistory::per_chunk ||
        (!is_last && chunk.ends.size() < FrameHistory::per_chunk) || chunk.poses.size() != chunk.ends.size() ||
        chunk.ends.back() != chunk.bytes.size() || !std::is_sorted(chunk.ends.begin(), chunk.ends.end())) {
      return false;
    }
  }
  std::vector<std::int32_t> registered;
  try {
    for (std::size_t i = 0; i < num_frames; ++i) {
      const FrameReport report = history[i];
      if (!nacre::is_sound(report, num_pixels, most_points)) return false;
      if (report.status != FrameStatus::lost) registered.push_back(static_cast<std::int32_t>(i));
    }
  } catch (const CheckpointError&) {  // whose place is none in the file
    return false;
  }
  return registered == history.registered_;
}

bool PrivateState::is_sound(const PoseGraph& graph) {
  const std::size_t count = graph.poses_.size();
  if (graph.unknowns_.size() != count) return false;
  int next = 0;
  for (const int unknown : graph.unknowns_) {
    if (unknown != -1 && unknown != next) return false;
    if (unknown != -1) next += 6;
  }
  return graph.num_unknowns_ == next &&
         std::all_of(graph.edges_.begin(), graph.edges_.end(),
                     [&](const PoseEdge& edge) { return is_within(edge.from, count) && is_within(edge.to, count); });
}

bool PrivateState::is_sound(const KeyFrameViews& views) {
  for (std::size_t k = 0; k < views.places_.size(); ++k) {
    if (views.places_[k].file.empty() != (k >= views.num_written_)) return false;
  }
  return views.num_written_ <= views.places_.size();
}

bool PrivateState::is_sound(const LoopClosure& loops, std::size_t num_frames) {
  const std::size_t count = loops.key_frames_.size();
  if (!is_sound(loops.graph_) || loops.graph_.poses_.size() != count || loops.seen_with_.size() != count ||
      !is_sound(loops.views_) || loops.views_.places_.size() != count) {
    return false;
  }
  const auto is_key_frame = [&](const KeyFrame& key_frame) { return is_within(key_frame.frame, num_frames); };
  if (!are_all(loops.key_frames_, is_key_frame)) return false;
  for (const std::vector<int>& others : loops.seen_with_) {
    if (!std::all_of(others.begin(), others.end(), [&](int other) { return is_within(other, count); })) return false;
  }
  std::int32_t last = -1;
  for (const LoopClosure::TrajectoryNode& node : loops.trajectory_) {
    if (!is_within(node.key_frame, count) || !is_within(node.frame, num_frames) || node.frame <= last) return false;
    last = node.frame;
  }
  return loops.trajectory_.empty() == loops.key_frames_.empty();
}

bool PrivateState::is_sound(const StillScene& scene) {
  const Eigen::Index num_cells = static_cast<Eigen::Index>(scene.camera_.width()) * scene.camera_.height();
  const auto is_sound = [&](const DepthView& view) {
    return view.depth.size() == num_cells && view.sigma.size() == num_cells && view.measured.size() == 0;
  };
  if (scene.scene_.depth.size() == 0) return scene.all_.depth.size() == 0 && scene.moved_.empty();
  return is_sound(scene.scene_) && is_sound(scene.all_) &&
         (scene.moved_.empty() || static_cast<Eigen::Index>(scene.moved_.size()) == num_cells);
}

bool PrivateState::is_sound(const CarriedThings& things, const StillScene& scene) {
  const Eigen::Index num_cells = static_cast<Eigen::Index>(scene.camera_.width()) * scene.camera_.height();
  const bool has_size = things.scene_.rows() == scene.height_ && things.scene_.cols() == scene.width_;
  return things.changed_ >= 0 && static_cast<Eigen::Index>(things.is_carried_.size()) == things.depth_.size() &&
         (things.depth_.size() == 0 || things.depth_.size() == num_cells) && (things.scene_.size() == 0 || has_size);
}

bool PrivateState::is_sound(const FrameOdometry& odometry) {
  const auto& before = odometry.before_;
  const bool has_normals = !before || before->normals.rows() == 0 || before->normals.rows() == before->points.rows();
  const auto is_size = [](double value) { return value >= 0.0 && std::isfinite(value); };
  return has_normals && is_size(odometry.largest_turn_) && is_size(odometry.largest_shift_) &&
         (!odometry.path_ ||
          (odometry.path_->uncertainty.shift >= 0.0 && odometry.path_->uncertainty.turn.allFinite()));
}

bool PrivateState::is_sound(const DeformingShape& shape, std::size_t num_points, std::size_t num_frames) {
  const WarpField& field = shape.field_;
  const std::size_t count = field.nodes.size();
  if (field.bindings.size() != num_points || shape.states_.size() != num_frames || !std::isfinite(field.node_spacing) ||
      (count > 0 && !(field.node_spacing > 0.0))) {
    return false;
  }
  const auto is_bound = [](const WarpBinding& binding, std::size_t most) {  // to some of the first nodes
    const int num_nodes = binding.count();
    for (int k = 0; k < num_nodes; ++k) {
      const auto i = static_cast<std::size_t>(k);
      if (!is_within(binding.nodes[i], most) || !(binding.distances[i] >= 0.0F)) return false;
    }
    return true;
  };
  for (std::size_t i = 0; i < count; ++i) {
    const WarpNode& node = field.nodes[i];
    const bool is_turned = (node.rotation.transpose() * node.rotation).isIdentity(1e-6);
    if (!is_bound(node.parents, i) || !node.rest.allFinite() || !node.position.allFinite() || !is_turned) return false;
  }
  for (const NodeStates& states : shape.states_) {
    if (states.size() > count) return false;
    for (const std::array<float, 7>& state : states) {
      if (!std::all_of(state.begin(), state.end(), [](float value) { return std::isfinite(value); })) return false;
    }
  }
  return are_all(field.bindings, [&](const WarpBinding& binding) { return is_bound(binding, count); }) &&
         are_all(field.edges, [&](const WarpEdge& edge) {
           return is_within(edge.first, count) && is_within(edge.second, count) && edge.first < edge.second;
         });
}

bool PrivateState::is_sound(const NoiseCalibration& calibration) {
  const auto is_mean = [](const NoiseCalibration::Mean& mean) {
    return std::isfinite(mean.value) && std::isfinite(mean.count) && mean.count >= 0.0;
  };
  return calibration.unit_.step >= 0.0F && std::isfinite(calibration.unit_.step) && is_mean(calibration.local_) &&
         is_mean(calibration.total_) && is_mean(calibration.fitted_) &&
         std::all_of(calibration.bins_.begin(), calibration.bins_.end(), is_mean) &&
         std::all_of(calibration.windows_.begin(), calibration.windows_.end(), is_mean);
}

bool PrivateState::is_sound(const DepthCalibrator& calibrator) {
  const std::vector<DepthCalibrator::View>& views = calibrator.views_;
  if (const std::optional<DepthCalibrator::Fit>& fit = calibrator.fit_) {
    const auto is_of_views = [&](const DepthCalibrator::Pair& pair) {
      return is_within(pair.first, views.size()) && is_within(pair.second, views.size());
    };
    const bool goes_on = fit->iteration >= 0 && fit->iteration < depth_limits::most_calibration_steps;
    if (!goes_on || !std::isfinite(fit->tilt) || !(std::abs(fit->stretch) > 0.0) || !std::isfinite(fit->stretch) ||
        !std::isfinite(fit->radial) || !std::all_of(fit->pairs.begin(), fit->pairs.end(), is_of_views)) {
      return false;
    }
  }
  return std::all_of(views.begin(), views.end(),
                     [&](const DepthCalibrator::View& view) { return view.depths.size() == calibrator.num_blocks(); });
}

bool PrivateState::is_sound(const ConfidenceNoise& noise) {
  return std::all_of(noise.levels_.begin(), noise.levels_.end(), [](const ConfidenceNoise::Level& level) {
    return std::isfinite(level.log_scale) && std::isfinite(level.count) && level.count >= 0.0;
  });
}

bool PrivateState::is_sound(const ResidualNoise& noise) {
  return std::isfinite(noise.log_scale_) && std::isfinite(noise.count_) && noise.count_ >= 0.0 &&
         noise.num_frames_ >= 0;
}

bool PrivateState::is_sound(const UsualConsistency& usual) {
  const auto is_part = [](double value) { return value >= 0.0 && value <= 1.0; };
  const auto is_count = [](double value) { return value >= 0.0 && std::isfinite(value); };
  return is_part(usual.mean_.of_target) && is_part(usual.mean_.of_source) && is_count(usual.count_) &&
         std::abs(usual.likeness_.agreement) <= 1.0 && is_count(usual.likeness_.num_squares) &&
         is_count(usual.num_alike_);
}

// A file is none but one of its own folder's.
static bool is_points_file(const std::string& name) {
  const std::size_t dash = name.find('-');
  if (dash != 16 || name.size() < dash + 9 || name.compare(name.size() - 7, 7, ".points") != 0) return false;
  const std::string token = name.substr(0, dash), number = name.substr(dash + 1, name.size() - 7 - (dash + 1));
  return token.find_first_not_of("0123456789abcdef") == std::string::npos &&
         number.find_first_not_of("0123456789") == std::string::npos;
}

bool PrivateState::is_sound(const ParkedPoints& parked, const BlockIndex& blocks, std::size_t num_points,
                            std::size_t num_frames) {
  const std::vector<BlockIndex::Gap>& gaps = blocks.gaps();
  const auto is_frame = [&](std::int32_t frame) { return is_within(frame, num_frames); };
  if (gaps.size() != parked.parcels_.size()) return false;
  std::size_t place = 0;
  std::int64_t size = 0;
  for (std::size_t k = 0; k < gaps.size(); ++k) {
    const ParkedPoints::Parcel& parcel = parked.parcels_[k];
    if (gaps[k].place < place || gaps[k].place > num_points || parcel.count <= 0 ||
        static_cast<std::uint64_t>(parcel.count) != gaps[k].count || parcel.count > (std::int64_t{1} << 32) ||
        !is_place(parcel.lowest) || !is_place(parcel.highest) ||
        !(parcel.lowest.array() <= parcel.highest.array()).all() || parcel.frames.empty() ||
        !std::is_sorted(parcel.frames.begin(), parcel.frames.end()) || !are_all(parcel.frames, is_frame) ||
        !is_within(parcel.first_motion, parked.motions_.size() + 1) ||
        !is_within(parcel.first_gain, parked.gains_.size() + 1)) {
      return false;
    }
    for (auto i = static_cast<std::size_t>(parcel.first_motion); i < parked.motions_.size(); ++i) {
      if (!is_within(parcel.frames.back(), parked.motions_[i].size())) return false;
    }
    place = gaps[k].place;
    size += parcel.count;
  }
  return size == parked.size_;
}

bool PrivateState::is_sound(const ParkedFiles& files, const ParkedPoints& parked, const LoopClosure& loops) {
  std::vector<std::string> needed, known;
  for (const ParkedPoints::Parcel& parcel : parked.parcels_) needed.push_back(parcel.file);
  for (const KeyFrameViews::Place& place : loops.views_.places_) {
    if (!place.file.empty()) needed.push_back(place.file);
  }
  std::sort(needed.begin(), needed.end());
  for (const auto& [file, is_named] : files.is_named_) known.push_back(file);
  const auto is_named = [](const ParkedFiles::Released& released) { return is_points_file(released.file); };
  return needed == known && are_all(known, is_points_file) && are_all(files.released_, is_named) &&
         files.num_checkpoints_ >= 0;
}

std::string save_checkpoint(Pipeline& pipeline, const std::string& note) {
  pipeline.require_whole();
  pipeline.files.note_checkpoint();
  std::string bytes(sealed_header_size, '\0'), kept = note;
  StateWriter archive(bytes);
  CameraFields camera = fields_of(pipeline.given_camera);
  exchange(archive, camera);
  std::string filler = filler_of(camera, pipeline);
  bool has_folder = pipeline.files.is_on();
  archive(pipeline.given, pipeline.options.binning, has_folder, filler);
  exchange_state(archive, pipeline);
  archive(kept);
  return sealed(std::move(bytes));
}

std::unique_ptr<Pipeline> load_checkpoint(std::string_view bytes, std::string* note, const std::string& points_folder) {
  check_seal(bytes);
  StateReader archive(bytes, sealed_header_size);
  CameraFields camera;
  ModelOptions given;
  int binning = 1;
  std::string filler, kept;
  exchange(archive, camera);
  // Of a camera whose size is made up, the rays would take more memory than there is.
  archive.require(!camera.has_table() || (camera.width > 0 && camera.height > 0 &&
                                          static_cast<std::size_t>(camera.num_pixels()) <= archive.left() / 8),
                  "the camera is larger than what is left");
  bool has_folder = false;
  archive(given, binning, has_folder, filler);
  require(has_folder == !points_folder.empty(), "points_folder",
          has_folder ? "the folder of the points that left the model's memory" : "empty for a model that had none",
          points_folder);
  given.points_folder = points_folder;
  archive.require(binning >= 1 && (given.binning == 0 || binning == given.binning), "pixels are averaged otherwise");
  std::unique_ptr<Pipeline> pipeline;
  try {
    pipeline = std::make_unique<Pipeline>(camera.camera(), given, binning);
  } catch (const std::invalid_argument& error) {
    archive.fail(error.what());
  }
  Pipeline& state = *pipeline;
  exchange_state(archive, state);
  archive(kept);
  archive.require_end();

  archive.require(PrivateState::is_sound(state.history, state.camera, given),
                  "the report of a frame contradicts itself, the camera or the options");
  const std::size_t num_frames = state.history.size();
  const Eigen::Index num_pixels = fields_of(state.camera).num_pixels();
  const auto is_pixels = [&](const Values& values) { return values.size() == num_pixels; };
  const DepthView& before = state.before;
  const bool is_first = state.cloud.size() == 0 && before.depth.size() == 0;
  archive.require(filler == filler_of(camera, state), "its length does not fit the camera");
  archive.require(state.region.size() == 0 || is_image(state.region, state.camera), "the region has another size");
  archive.require(is_surface(state.cloud, num_frames), "the points are not all there, or no surface");
  archive.require(is_first || (is_pixels(before.depth) && is_pixels(before.sigma) && is_pixels(before.measured)),
                  "the newest view has another size than the camera");
  archive.require(before.brightness.empty() || before.brightness.size() == static_cast<std::size_t>(num_pixels),
                  "the newest view has another size in colour");
  archive.require(is_first || state.history.num_registered() > 0, "the poses are missing");
  archive.require(PrivateState::is_sound(state.parked, state.blocks, state.cloud.points.size(), num_frames),
                  "the points that left memory contradict the others");
  archive.require(num_frames == 0 || state.history.back().num_points == state.num_points() || state.files.is_on(),
                  "the newest report has another number of points");
  archive.require(is_within(state.num_lost, num_frames + 1), "more frames are lost than there are");
  archive.require(is_within(state.num_vain, static_cast<std::size_t>(state.num_lost) + 1),
                  "more frames were searched for than are lost");
  archive.require(is_within(state.num_open, num_frames + 1), "more frames left directions open than there are");
  archive.require(state.open_noise_factor >= 1.0 && state.open_noise_factor <= tracking_limits::largest_noise_factor,
                  "a frame that left directions open has another noise than is tried");
  const bool is_spaced = state.spacing > 0.0 || state.cloud.size() == 0;
  archive.require(is_spaced && state.spacing >= given.spacing && state.spacing < farthest_place,
                  "the spacing is not a distance between the points");
  for (const ObjectView& view : state.views) {
    archive.require(is_sound(view, state.camera, num_frames), "a view of the object contradicts the camera");
  }
  archive.require(state.start_frames.size() < model_limits::start_frames, "more frames may begin the model than do");
  std::int64_t last_start = -1;
  for (const StartFrame& frame : state.start_frames) {
    archive.require(is_sound(frame, state.given_camera, num_frames) && frame.index > last_start,
                    "a frame that may begin the model contradicts the camera");
    last_start = frame.index;
  }
  archive.require(PrivateState::is_sound(state.loops, num_frames), "the key frames contradict each other");
  archive.require(PrivateState::is_sound(state.files, state.parked, state.loops),
                  "the files are not those of what left memory");
  const std::size_t num_views = state.depth_views ? static_cast<std::size_t>(state.depth_views->num_views()) : 0;
  const bool is_tilted = state.depth_views.has_value() || state.options.depth.tilt == given.depth.tilt;
  archive.require(is_tilted && std::isfinite(state.options.depth.tilt) && state.depth_view_frames.size() == num_views &&
                      are_all(state.depth_view_frames, [&](auto frame) { return is_within(frame, num_frames); }) &&
                      std::is_sorted(state.depth_view_frames.begin(), state.depth_view_frames.end()) &&
                      (!state.depth_views || PrivateState::is_sound(*state.depth_views)),
                  "the views that calibrate depth contradict the camera");
  archive.require(PrivateState::is_sound(state.still_scene) && PrivateState::is_sound(state.carried, state.still_scene),
                  "the still scene has another size than the camera");
  archive.require(!state.shape || PrivateState::is_sound(*state.shape, state.cloud.points.size(), num_frames),
                  "the shape contradicts the points or itself");
  archive.require(PrivateState::is_sound(state.odometry), "the frame before contradicts itself");
  archive.require(PrivateState::is_sound(state.calibration) && PrivateState::is_sound(state.confidence_noise) &&
                      PrivateState::is_sound(state.residual_noise) && PrivateState::is_sound(state.usual_consistency),
                  "the noise is not finite");
  state.blocks.renew(state.cloud);
  if (note != nullptr) *note = std::move(kept);
  return pipeline;
}

CheckpointError::CheckpointError(const std::string& reason, std::int64_t offset)
    : std::runtime_error(reason), offset_(offset) {}
CheckpointError::~CheckpointError() = default;

}  // namespace nacre
