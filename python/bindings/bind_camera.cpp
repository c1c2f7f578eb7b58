#include <sstream>

#include "bindings.hpp"
#include "nacre/camera.hpp"

namespace {

using nacre::Camera;
using nacre::DepthKind;

DepthKind parse_depth_kind(const std::string& name) {
  if (name == "z") return DepthKind::z;
  if (name == "radial") return DepthKind::radial;
  throw std::invalid_argument("depth must be 'z' or 'radial', got '" + name + "'");
}

std::string depth_name(const Camera& camera) { return camera.depth_kind() == DepthKind::radial ? "radial" : "z"; }

std::string model_name(const Camera& camera) {
  return camera.model() == Camera::Model::orthographic ? "orthographic" : "pinhole";
}

std::string repr(const Camera& camera) {
  std::ostringstream text;
  text.precision(10);
  if (camera.model() == Camera::Model::orthographic) {
    text << "Camera.orthographic(width=" << camera.width() << ", height=" << camera.height()
         << ", pixel_size=" << camera.pixel_size() << ")";
    return text.str();
  }
  text << "Camera(width=" << camera.width() << ", height=" << camera.height() << ", fx=" << camera.fx()
       << ", fy=" << camera.fy() << ", cx=" << camera.cx() << ", cy=" << camera.cy();
  if (camera.distortion() != Camera::Distortion{}) {
    text << ", distortion=(";
    for (std::size_t i = 0; i < camera.distortion().size(); ++i) text << (i ? ", " : "") << camera.distortion()[i];
    text << ")";
  }
  if (camera.depth_kind() == DepthKind::radial) text << ", depth='radial'";
  text << ")";
  return text.str();
}

py::tuple to_state(const Camera& c) {
  return py::make_tuple(model_name(c), c.width(), c.height(), c.fx(), c.fy(), c.cx(), c.cy(), c.distortion(),
                        depth_name(c));
}

Camera from_state(const py::tuple& state) {
  const int width = state[1].cast<int>(), height = state[2].cast<int>();
  if (state[0].cast<std::string>() == "orthographic") {
    return Camera::orthographic(width, height, 1.0 / state[3].cast<double>());
  }
  return Camera::pinhole(width, height, state[3].cast<double>(), state[4].cast<double>(), state[5].cast<double>(),
                         state[6].cast<double>(), state[7].cast<Camera::Distortion>(),
                         parse_depth_kind(state[8].cast<std::string>()));
}

}  // namespace

void bind_camera(py::module_& m) {
  py::class_<Camera>(
      m, "Camera",
      R"(An immutable camera model. Pixel centres are integers; axes are OpenCV's (x right, y down, z forward).

Parameters
----------
width, height : int
    Size of the image [pixels].
fx, fy, cx, cy : float
    Focal lengths and principal point [pixels]: x = (u - cx) z / fx.
distortion : 5 floats
    Brown-Conrady coefficients k1 k2 p1 p2 k3, in OpenCV's order.
depth : "z" or "radial"
    What a depth value measures: the distance along the optical axis, or along the pixel's ray.

Raises
------
ValueError
    Names the argument that is out of range.)")
      .def(py::init([](int width, int height, double fx, double fy, double cx, double cy,
                       const Camera::Distortion& distortion, const std::string& depth) {
             return Camera::pinhole(width, height, fx, fy, cx, cy, distortion, parse_depth_kind(depth));
           }),
           py::arg("width"), py::arg("height"), py::arg("fx"), py::arg("fy"), py::arg("cx"), py::arg("cy"),
           py::kw_only(), py::arg("distortion") = Camera::Distortion{}, py::arg("depth") = "z")
      .def_static("orthographic", &Camera::orthographic, py::arg("width"), py::arg("height"), py::arg("pixel_size"),
                  "A camera with parallel rays: x = (u - (width - 1) / 2) pixel_size [m].")
      .def_property_readonly("model", &model_name, "'pinhole' or 'orthographic'")
      .def_property_readonly("width", &Camera::width)
      .def_property_readonly("height", &Camera::height)
      .def_property_readonly("fx", &Camera::fx)
      .def_property_readonly("fy", &Camera::fy)
      .def_property_readonly("cx", &Camera::cx)
      .def_property_readonly("cy", &Camera::cy)
      .def_property_readonly("distortion", &Camera::distortion)
      .def_property_readonly("depth", &depth_name, "'z' or 'radial'")
      .def_property_readonly("pixel_size", &Camera::pixel_size, "[m], of an orthographic camera")
      .def(
          "project",
          [](const Camera& camera,
             const Eigen::Ref<const Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>>& points) {
            Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor> pixels(points.rows(), 2);
            for (Eigen::Index i = 0; i < points.rows(); ++i) pixels.row(i) = camera.project(points.row(i).transpose());
            return pixels;
          },
          py::arg("points"),
          "The pixels (u, v) that see points of the camera frame, (N, 3) -> (N, 2); NaN behind the camera.")
      .def(
          "__eq__", [](const Camera& a, const Camera& b) { return a == b; }, py::is_operator())
      .def("__hash__", [](const Camera& camera) { return py::hash(to_state(camera)); })
      .def("__repr__", &repr)
      .def(py::pickle(&to_state, &from_state));
}
