#include "bindings.hpp"
#include "nacre/depth.hpp"
#include "nacre/depth_calibration.hpp"

namespace {

using nacre::Camera;
using nacre::DepthCalibration;
using nacre::DepthCalibrator;
using nacre::DepthImage;
using nacre::DepthOptions;
using nacre::DepthRef;
using nacre::DepthReport;
using nacre::EdgeTest;
using nacre::Frame;
using nacre::MaskRef;
using nacre::NoiseCalibration;
using nacre::NoiseModel;

std::pair<DepthImage, DepthReport> preprocess_depth(const DepthRef& depth, const Camera& camera,
                                                    const DepthOptions& options, const MaskRef& mask, int num_threads) {
  std::pair<DepthImage, DepthReport> result;
  result.first = nacre::preprocess_depth(depth, camera, options, mask, &result.second, num_threads);
  return result;
}

}  // namespace

void bind_depth(py::module_& m) {
  py::native_enum<EdgeTest>(m, "EdgeTest", "enum.Enum")
      .value("none", EdgeTest::none)
      .value("gradient", EdgeTest::gradient)
      .value("inverse_depth", EdgeTest::inverse_depth)
      .finalize();
  py::class_<NoiseModel>(m, "NoiseModel")
      .def(py::init<>())
      .def_readwrite("constant", &NoiseModel::constant)
      .def_readwrite("quadratic", &NoiseModel::quadratic)
      .def_readwrite("offset", &NoiseModel::offset)
      .def_readwrite("shared", &NoiseModel::shared)
      .def("sigma", &NoiseModel::sigma, py::arg("z"))
      .def("local", &NoiseModel::local)
      .def_static("kinect", &NoiseModel::kinect)
      .def_static("stereo", &NoiseModel::stereo, py::arg("fx"), py::arg("baseline") = 0.05,
                  py::arg("disparity_sigma") = 0.08)
      .def_static("time_of_flight", &NoiseModel::time_of_flight);
  py::class_<NoiseCalibration>(m, "NoiseCalibration")
      .def(py::init<const Camera&>(), py::arg("camera"))
      .def("add", py::overload_cast<const DepthRef&, int>(&NoiseCalibration::add), py::arg("depth"),
           py::arg("num_threads"), ReleaseGil())
      .def("model", &NoiseCalibration::model);
  py::class_<DepthCalibration>(m, "DepthCalibration")
      .def(py::init([](double tilt, double sigma, int num_pairs, double focal_scale, double focal_sigma, double radial,
                       double radial_sigma) {
        return DepthCalibration{tilt, sigma, num_pairs, focal_scale, focal_sigma, radial, radial_sigma};
      }))
      .def_readonly("tilt", &DepthCalibration::tilt)
      .def_readonly("sigma", &DepthCalibration::sigma)
      .def_readonly("num_pairs", &DepthCalibration::num_pairs)
      .def_readonly("focal_scale", &DepthCalibration::focal_scale)
      .def_readonly("focal_sigma", &DepthCalibration::focal_sigma)
      .def_readonly("radial", &DepthCalibration::radial)
      .def_readonly("radial_sigma", &DepthCalibration::radial_sigma)
      .def_property_readonly("is_significant", &DepthCalibration::is_significant)
      .def_property_readonly("has_wrong_focal_length", &DepthCalibration::has_wrong_focal_length)
      .def_property_readonly("has_radial_depth", &DepthCalibration::has_radial_depth);
  py::class_<DepthCalibrator>(m, "DepthCalibrator")
      .def(py::init<const Camera&>(), py::arg("camera"))
      .def("add", [](DepthCalibrator& views, const DepthRef& depth,
                     const PoseMatrix& pose) { return views.add(depth, to_pose(pose)); })
      .def("is_new_direction",
           [](const DepthCalibrator& views, const PoseMatrix& pose) { return views.is_new_direction(to_pose(pose)); })
      .def_property_readonly("has_enough", &DepthCalibrator::has_enough)
      .def("fit", &DepthCalibrator::fit, py::arg("num_threads"), ReleaseGil());
  m.def("correct_depth", &nacre::correct_depth, py::arg("depth"), py::arg("camera"), py::arg("tilt"),
        py::arg("num_threads"), ReleaseGil());
  m.def("can_calibrate_depth", &nacre::can_calibrate_depth, py::arg("camera"));
  py::class_<DepthOptions>(m, "DepthOptions")
      .def(py::init<>())
      .def_readwrite("edge_test", &DepthOptions::edge_test)
      .def_readwrite("min_depth", &DepthOptions::min_depth)
      .def_readwrite("max_depth", &DepthOptions::max_depth)
      .def_readwrite("gradient_threshold", &DepthOptions::gradient_threshold)
      .def_readwrite("edge_dilation", &DepthOptions::edge_dilation)
      .def_readwrite("edge_sigmas", &DepthOptions::edge_sigmas)
      .def_readwrite("planar_keep_sigmas", &DepthOptions::planar_keep_sigmas)
      .def_readwrite("max_slant", &DepthOptions::max_slant)
      .def_readwrite("max_missing", &DepthOptions::max_missing)
      .def_readwrite("min_component", &DepthOptions::min_component)
      .def_readwrite("tilt", &DepthOptions::tilt)
      .def_readwrite("noise", &DepthOptions::noise);
  py::class_<DepthReport>(m, "DepthReport")
      .def_readonly("num_pixels", &DepthReport::num_pixels)
      .def_readonly("num_invalid", &DepthReport::num_invalid)
      .def_readonly("num_out_of_range", &DepthReport::num_out_of_range)
      .def_readonly("num_masked", &DepthReport::num_masked)
      .def_readonly("num_edge", &DepthReport::num_edge)
      .def_readonly("num_slanted", &DepthReport::num_slanted)
      .def_readonly("num_isolated", &DepthReport::num_isolated)
      .def_readonly("num_kept", &DepthReport::num_kept);
  py::class_<Frame>(m, "Frame")
      .def_readonly("width", &Frame::width)
      .def_readonly("height", &Frame::height)
      .def_readonly("points", &Frame::points)
      .def_readonly("normals", &Frame::normals)
      .def_readonly("sigma", &Frame::sigma)
      .def_property_readonly("valid", [](py::object self) {
        const auto& valid = self.cast<const Frame&>().valid;
        return py::array_t<std::int32_t>(static_cast<py::ssize_t>(valid.size()), valid.data(), std::move(self));
      });

  m.def("depth_from_raw", &nacre::depth_from_raw, py::arg("raw"), py::arg("depth_scale"), ReleaseGil());
  m.def("preprocess_depth", &preprocess_depth, py::arg("depth"), py::arg("camera"), py::arg("options"), py::arg("mask"),
        py::arg("num_threads"), ReleaseGil());
  m.def("label_pixels", &nacre::label_pixels, py::arg("depth"), py::arg("camera"), py::arg("options"), py::arg("mask"),
        py::arg("num_threads"), ReleaseGil());
  m.def("estimate_noise", &nacre::estimate_noise, py::arg("depth"), py::arg("camera"), py::arg("num_threads"),
        ReleaseGil());
  m.def("back_project", &nacre::back_project, py::arg("depth"), py::arg("camera"), py::arg("num_threads"),
        ReleaseGil());
  m.def("make_frame",
        py::overload_cast<const DepthRef&, const Camera&, const std::optional<NoiseModel>&, int>(&nacre::make_frame),
        py::arg("depth"), py::arg("camera"), py::arg("noise"), py::arg("num_threads"), ReleaseGil());
  m.def("depth_normals", &nacre::depth_normals, py::arg("depth"), py::arg("camera"), py::arg("noise"),
        py::arg("num_threads"), ReleaseGil());
}
