#include <algorithm>
#include <cstring>
#include <filesystem>

#include "bindings.hpp"
#include "nacre/model.hpp"

using namespace nacre;

namespace {

py::array_t<float> copy_rows(const std::vector<Eigen::Vector3f>& rows) {
  py::array_t<float> array({static_cast<py::ssize_t>(rows.size()), static_cast<py::ssize_t>(3)});
  if (!rows.empty()) std::memcpy(array.mutable_data(), rows.front().data(), rows.size() * sizeof(Eigen::Vector3f));
  return array;
}

template <class Value>
py::array_t<Value> copy_values(const std::vector<Value>& values) {
  return py::array_t<Value>(static_cast<py::ssize_t>(values.size()), values.data());
}

// name: (points, channels)
py::dict copy_attributes(const PointModel& cloud) {
  py::dict result;
  for (const PointAttribute& attribute : cloud.attributes) {
    py::array_t<float> array(
        {static_cast<py::ssize_t>(cloud.size()), static_cast<py::ssize_t>(attribute.num_channels)});
    std::copy(attribute.values.begin(), attribute.values.end(), array.mutable_data());
    result[attribute.name.c_str()] = array;
  }
  return result;
}

py::dict milliseconds(const FrameReport& report) {
  const StepTimes& times = report.milliseconds;
  py::dict result;
  result["preprocess"] = times.preprocess;
  result["back_project"] = times.back_project;
  result["region"] = times.region;
  result["registration"] = times.registration;
  result["loop_closure"] = times.loop_closure;
  result["fuse"] = times.fuse;
  result["normals"] = times.normals;
  result["total"] = times.total;
  return result;
}

FrameReport add_frame(Model& model, const DepthRef& depth, const MaskRef& mask, const MaskRef& confidence,
                      const ColorsRef& colors, const std::vector<std::pair<std::string, Attributes>>& attributes,
                      std::optional<double> timestamp, const std::optional<PoseMatrix>& guess, bool keep_guess,
                      bool movable, bool search) {
  FrameExtras extras;
  extras.mask = mask;
  extras.confidence = confidence;
  extras.colors = colors;
  for (const auto& [name, values] : attributes) extras.attributes.push_back({name, values});
  extras.timestamp = timestamp;
  if (guess) extras.guess = to_pose(*guess);
  extras.keep_guess = keep_guess;
  extras.movable = movable;
  extras.search = search;
  return model.add_frame(depth, extras);
}

}  // namespace

void bind_model(py::module_& m) {
  py::native_enum<FusionMethod>(m, "FusionMethod", "enum.Enum")
      .value("fuse", FusionMethod::fuse)
      .value("wlop", FusionMethod::wlop)
      .value("wlop_plus", FusionMethod::wlop_plus)
      .finalize();

  py::class_<FusionOptions>(m, "FusionOptions")
      .def(py::init<>())
      .def_readwrite("max_confidence", &FusionOptions::max_confidence)
      .def_readwrite("min_observations", &FusionOptions::min_observations)
      .def_readwrite("max_free_space_violations", &FusionOptions::max_free_space_violations)
      .def_readwrite("reference_sigma", &FusionOptions::reference_sigma);

  py::class_<WlopOptions>(m, "WlopOptions")
      .def(py::init<>())
      .def_readwrite("radius", &WlopOptions::radius)
      .def_readwrite("iterations", &WlopOptions::iterations)
      .def_readwrite("mu", &WlopOptions::mu)
      .def_readwrite("theta", &WlopOptions::theta)
      .def_readwrite("first_fraction", &WlopOptions::first_fraction)
      .def_readwrite("kept_fraction", &WlopOptions::kept_fraction)
      .def_readwrite("new_fraction", &WlopOptions::new_fraction)
      .def_readwrite("normal_neighbors", &WlopOptions::normal_neighbors)
      .def_readwrite("normal_radius", &WlopOptions::normal_radius)
      .def_readwrite("seed", &WlopOptions::seed);

  py::class_<ModelOptions>(m, "ModelOptions")
      .def(py::init<>())
      .def_static("preset", &ModelOptions::preset)
      .def_readwrite("depth", &ModelOptions::depth)
      .def_readwrite("region", &ModelOptions::region)
      .def_readwrite("registration", &ModelOptions::registration)
      .def_readwrite("fusion_method", &ModelOptions::fusion_method)
      .def_readwrite("fusion", &ModelOptions::fusion)
      .def_readwrite("wlop", &ModelOptions::wlop)
      .def_readwrite("binning", &ModelOptions::binning)
      .def_readwrite("calibrate_depth", &ModelOptions::calibrate_depth)
      .def_readwrite("deform", &ModelOptions::deform)
      .def_readwrite("spacing", &ModelOptions::spacing)
      .def_readwrite("max_points", &ModelOptions::max_points)
      .def_readwrite("predict_motion", &ModelOptions::predict_motion)
      .def_readwrite("relocalise", &ModelOptions::relocalise)
      .def_readwrite("loop_closure", &ModelOptions::loop_closure)
      .def_readwrite("denoise_samples", &ModelOptions::denoise_samples)
      .def_readwrite("verify", &ModelOptions::verify)
      .def_readwrite("min_score", &ModelOptions::min_score)
      .def_readwrite("num_threads", &ModelOptions::num_threads);

  py::class_<PointModel>(m, "PointModel")
      .def_property_readonly("points", [](const PointModel& cloud) { return copy_rows(cloud.points); })
      .def_property_readonly("normals", [](const PointModel& cloud) { return copy_rows(cloud.normals); })
      .def_property_readonly("colors", [](const PointModel& cloud) { return copy_rows(cloud.colors); })
      .def_property_readonly("attributes", &copy_attributes)
      .def_property_readonly("confidence", [](const PointModel& cloud) { return copy_values(cloud.confidence); })
      .def_property_readonly("observations", [](const PointModel& cloud) { return copy_values(cloud.observations); })
      .def_property_readonly("last_seen", [](const PointModel& cloud) { return copy_values(cloud.last_seen); })
      .def("__len__", &PointModel::size);

  py::class_<DeformationReport>(m, "DeformationReport")
      .def_readonly("num_nodes", &DeformationReport::num_nodes)
      .def_readonly("explained", &DeformationReport::explained)
      .def_readonly("strain", &DeformationReport::strain);

  py::class_<ShapeAtFrame>(m, "ShapeAtFrame")
      .def_property_readonly("points", [](const ShapeAtFrame& shape) { return copy_rows(shape.points); })
      .def_property_readonly("normals", [](const ShapeAtFrame& shape) { return copy_rows(shape.normals); })
      .def_property_readonly("nodes", [](const ShapeAtFrame& shape) { return copy_rows(shape.nodes); });

  py::class_<FrameReport>(m, "FrameReport")
      .def_readonly("index", &FrameReport::index)
      .def_readonly("timestamp", &FrameReport::timestamp)
      .def_property_readonly("status", [](const FrameReport& report) { return to_string(report.status); })
      .def_readonly("reason", &FrameReport::reason)
      .def_property_readonly("world_from_camera",
                             [](const FrameReport& report) { return to_matrix(report.world_from_camera); })
      .def_readonly("num_inliers", &FrameReport::num_inliers)
      .def_readonly("overlap", &FrameReport::overlap)
      .def_readonly("consistency", &FrameReport::consistency)
      .def_readonly("score", &FrameReport::score)
      .def_property_readonly("probability", &FrameReport::probability)
      .def_readonly("rmse", &FrameReport::rmse)
      .def_readonly("center", &FrameReport::center)
      .def_property_readonly("information",
                             [](const FrameReport& report) { return Eigen::Matrix<double, 6, 6>(report.information); })
      .def_property_readonly("weak_directions",
                             [](const FrameReport& report) { return Twists(report.weak_directions.transpose()); })
      .def_readonly("loop_frame", &FrameReport::loop_frame)
      .def_readonly("loop_distance", &FrameReport::loop_distance)
      .def_readonly("corrects_earlier", &FrameReport::corrects_earlier)
      .def_readonly("depth", &FrameReport::depth)
      .def_readonly("region", &FrameReport::region)
      .def_readonly("num_moving", &FrameReport::num_moving)
      .def_property_readonly("num_updated", [](const FrameReport& report) { return report.fusion.num_updated; })
      .def_property_readonly("num_inserted", [](const FrameReport& report) { return report.fusion.num_inserted; })
      .def_property_readonly("num_removed", [](const FrameReport& report) { return report.fusion.num_removed; })
      .def_readonly("deformation", &FrameReport::deformation)
      .def_readonly("num_points", &FrameReport::num_points)
      .def_readonly("spacing", &FrameReport::spacing)
      .def_property_readonly("milliseconds", &milliseconds);

  // Its arguments: the reason, and the place in the bytes.
  static py::handle checkpoint_error = py::exception<CheckpointError>(m, "CheckpointError", PyExc_ValueError).release();
  py::register_local_exception_translator([](std::exception_ptr pointer) {
    try {
      if (pointer) std::rethrow_exception(pointer);
    } catch (const CheckpointError& error) {
      const py::tuple arguments = py::make_tuple(error.what(), error.offset());
      PyErr_SetObject(checkpoint_error.ptr(), arguments.ptr());
    }
  });

  py::register_local_exception_translator([](std::exception_ptr pointer) {
    try {
      if (pointer) std::rethrow_exception(pointer);
    } catch (const std::filesystem::filesystem_error& error) {
      const std::string path = error.path1().string();
      const py::tuple arguments = py::make_tuple(error.code().value(), error.what(), path);
      PyErr_SetObject(PyExc_OSError, path.empty() ? py::make_tuple(error.what()).ptr() : arguments.ptr());
    }
  });

  py::class_<Model>(m, "Model")
      .def(py::init([](const Camera& camera, ModelOptions options, const py::bytes& points_folder) {
        options.points_folder = points_folder;
        return Model(camera, options);
      }))
      .def("add_frame", &add_frame, ReleaseGil())
      .def("save",
           [](const Model& model, const std::string& note) {
             std::string bytes;
             {
               const py::gil_scoped_release unlocked;
               bytes = model.save(note);
             }
             return py::bytes(bytes);
           })
      .def_static("load",
                  [](const py::bytes& bytes, const py::bytes& points_folder) {
                    const std::string folder = points_folder;
                    std::string note;
                    const auto data = static_cast<std::string_view>(bytes);
                    std::optional<Model> model;
                    {
                      const py::gil_scoped_release unlocked;
                      model.emplace(Model::load(data, &note, folder));
                    }
                    return std::make_pair(std::move(*model), py::bytes(note));
                  })
      .def_property_readonly("given_options", &Model::given_options)
      .def_property_readonly("camera", &Model::camera)
      .def_property_readonly("cloud", &Model::cloud, py::return_value_policy::reference_internal)
      .def_property_readonly("num_points", &Model::num_points)
      .def("whole_cloud", &Model::whole_cloud, ReleaseGil())
      .def("recall_all", &Model::recall_all, ReleaseGil())
      .def("shape_at", &Model::shape_at, ReleaseGil())
      .def("cloud_in_camera", &Model::cloud_in_camera)
      .def_property_readonly("depth_calibration", &Model::depth_calibration)
      .def_property_readonly("tilt", [](const Model& model) { return model.options().depth.tilt; })
      .def_property_readonly("noise", &Model::noise)
      .def_property_readonly("depth_unit", &Model::depth_unit)
      .def_property_readonly("binning", [](const Model& model) { return model.options().binning; })
      .def_property_readonly("noise_factor", &Model::noise_factor)
      .def_property_readonly("num_frames", [](const Model& model) { return model.frames().size(); })
      .def("report", [](const Model& model, std::size_t i) { return model.frames()[i]; })  // i < num_frames
      .def_property_readonly("spacing", &Model::spacing);
}
