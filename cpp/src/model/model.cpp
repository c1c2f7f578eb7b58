#include "nacre/model.hpp"

#include <algorithm>
#include <utility>

#include "base/check.hpp"
#include "depth/pixel_binning.hpp"
#include "model/checkpoint/checkpoint.hpp"
#include "model/new_start.hpp"
#include "model/pipeline.hpp"
#include "nacre/cancel.hpp"

namespace nacre {

namespace {

// Of a region it is not known yet how little of the image it is.
bool decides_binning(const Pipeline& model) {
  return model.given.binning == 0 && model.history.size() == 0 && !model.given.region.is_limited();
}

}  // namespace

Model::Model(const Camera& camera, const ModelOptions& options)
    : pipeline_(std::make_unique<Pipeline>(camera, options, std::max(1, options.binning))) {}
Model::~Model() = default;
Model::Model(std::unique_ptr<Pipeline> pipeline) : pipeline_(std::move(pipeline)) {}
Model::Model(Model&&) noexcept = default;
Model& Model::operator=(Model&&) noexcept = default;

FrameReport Model::add_frame(const DepthRef& depth, const FrameExtras& extras) {
  const CancelScope whole(nullptr);  // stopped halfway, the model would be neither the one nor the other
  if (decides_binning(*pipeline_)) {
    const int binning = binning_for(depth, extras.mask, pipeline_->given_camera);
    pipeline_ = std::make_unique<Pipeline>(pipeline_->given_camera, pipeline_->given, binning);
  }
  FrameReport report = pipeline_->add_frame(depth, extras);
  if (auto begun = begin_anew(*pipeline_, depth, extras)) {
    pipeline_ = std::move(begun);
    report = pipeline_->history.back();
  }
  return report;
}

Camera Model::camera() const { return pipeline_->given_camera; }
const ModelOptions& Model::options() const { return pipeline_->options; }
const ModelOptions& Model::given_options() const { return pipeline_->given; }
const PointModel& Model::cloud() const { return pipeline_->cloud; }
FrameReports Model::frames() const { return FrameReports(pipeline_->history); }
std::optional<DepthCalibration> Model::depth_calibration() const { return pipeline_->depth_calibration(); }
NoiseModel Model::noise() const { return pipeline_->noise(); }
double Model::depth_unit() const { return pipeline_->calibration.unit(); }
double Model::noise_factor() const { return pipeline_->known_noise_factor(); }
double Model::spacing() const { return pipeline_->spacing; }

std::int64_t Model::num_points() const { return pipeline_->num_points(); }

void Model::for_each_part(const std::function<void(const PointModel& part)>& visit) const {
  pipeline_->parked.for_each_part(pipeline_->cloud, pipeline_->blocks, visit);
}

PointModel Model::whole_cloud() const {
  if (pipeline_->parked.size() == 0) return pipeline_->cloud;
  PointModel whole;
  for_each_part([&](const PointModel& part) { append_range(whole, part, 0, part.points.size()); });
  return whole;
}

void Model::recall_all() { pipeline_->parked.recall_all(pipeline_->cloud, pipeline_->blocks); }

PointModel Model::cloud_in_camera() const {
  PointModel moved = whole_cloud();
  if (pipeline_->history.num_registered() == 0) return moved;
  const Eigen::Isometry3f camera_from_world(pipeline_->history.registered_pose(0).inverse().cast<float>());
  for (Eigen::Vector3f& point : moved.points) point = camera_from_world * point;
  for (Eigen::Vector3f& normal : moved.normals) normal = camera_from_world.linear() * normal;
  return moved;
}

ShapeAtFrame Model::shape_at(std::int64_t frame) const {
  const std::optional<DeformingShape>& shape = pipeline_->shape;
  require(shape.has_value(), "deform", "on for a model that has a shape at each frame", "a model that is rigid");
  require(frame >= 0 && frame < static_cast<std::int64_t>(shape->num_frames()), "frame",
          "one of the " + std::to_string(shape->num_frames()) + " that were added, from 0", frame);
  const WarpField field = shape->field_at(static_cast<std::size_t>(frame));
  ShapeAtFrame result;
  const PointModel& cloud = pipeline_->cloud;
  OrientedPoints moved = warped(field, cloud.points, cloud.normals, pipeline_->options.num_threads);
  result.points = std::move(moved.points);
  result.normals = std::move(moved.normals);
  for (const WarpNode& node : field.nodes) result.nodes.push_back(node.position.cast<float>());
  return result;
}

std::string Model::save(const std::string& note) const { return save_checkpoint(*pipeline_, note); }
Model Model::load(std::string_view bytes, std::string* note, const std::string& points_folder) {
  return Model(load_checkpoint(bytes, note, points_folder));
}

}  // namespace nacre
