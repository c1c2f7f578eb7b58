#include <algorithm>
#include <limits>
#include <vector>

#include "bindings.hpp"
#include "nacre/camera.hpp"

namespace {

// Arguments of any type, so that the error for a wrong one can name it; the signatures say what they should be.
bool is_anything(PyObject* /*object*/) { return true; }
class Whole : public py::object {
  PYBIND11_OBJECT_DEFAULT(Whole, py::object, is_anything)
};
class Real : public py::object {
  PYBIND11_OBJECT_DEFAULT(Real, py::object, is_anything)
};
class Coefficients : public py::object {
  PYBIND11_OBJECT_DEFAULT(Coefficients, py::object, is_anything)
};
class PointArray : public py::object {
  PYBIND11_OBJECT_DEFAULT(PointArray, py::object, is_anything)
};
class Depth : public py::object {
  PYBIND11_OBJECT_DEFAULT(Depth, py::object, is_anything)
};

}  // namespace

template <>
struct py::detail::handle_type_name<Whole> {
  static constexpr auto name = const_name("typing.SupportsInt | typing.SupportsIndex");
};
template <>
struct py::detail::handle_type_name<Real> {
  static constexpr auto name = const_name("typing.SupportsFloat | typing.SupportsIndex");
};
template <>
struct py::detail::handle_type_name<Coefficients> {
  static constexpr auto name = const_name("collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]");
};
template <>
struct py::detail::handle_type_name<PointArray> {
  static constexpr auto name = const_name("typing.Annotated[numpy.typing.ArrayLike, numpy.float64]");
};
template <>
struct py::detail::handle_type_name<Depth> {
  static constexpr auto name = const_name("str");
};

namespace {

using nacre::Camera;
using nacre::DepthKind;

[[noreturn]] void refuse(const char* name, const char* expected, const py::handle& value) {
  throw py::type_error(std::string(name) + " must be " + expected + ", got " + py::repr(value).cast<std::string>());
}

int as_pixels(const char* name, const Whole& value) {
  if (PyIndex_Check(value.ptr()) == 0) refuse(name, "an integer", value);
  const Py_ssize_t number = PyNumber_AsSsize_t(value.ptr(), nullptr);  // the nearest that there is
  using Limits = std::numeric_limits<int>;
  return static_cast<int>(std::clamp<Py_ssize_t>(number, Limits::min(), Limits::max()));
}

double as_number(const char* name, const py::handle& value) {
  const double number = PyFloat_AsDouble(value.ptr());
  if (number == -1.0 && PyErr_Occurred() != nullptr) {
    PyErr_Clear();
    refuse(name, "a number that a float can hold", value);
  }
  return number;
}

DepthKind parse_depth_kind(const std::string& name) {
  if (name == "z") return DepthKind::z;
  if (name == "radial") return DepthKind::radial;
  throw std::invalid_argument("depth must be 'z' or 'radial', got '" + name + "'");
}

std::string depth_name(const Camera& camera) { return camera.depth_kind() == DepthKind::radial ? "radial" : "z"; }

std::string model_name(const Camera& camera) {
  return camera.model() == Camera::Model::orthographic ? "orthographic" : "pinhole";
}

// OpenCV's vector of 4 or 5 coefficients; none is no distortion.
Camera::Distortion parse_distortion(const py::object& value) {
  std::vector<double> coefficients;
  if (py::isinstance<py::str>(value) || PySequence_Check(value.ptr()) == 0) {
    refuse("distortion", "4 or 5 numbers", value);
  }
  for (const py::handle coefficient : py::iter(value)) coefficients.push_back(as_number("distortion", coefficient));
  if (!coefficients.empty() && coefficients.size() != 4 && coefficients.size() != 5) {
    throw std::invalid_argument("distortion must be the 4 or 5 coefficients k1 k2 p1 p2 (k3), got " +
                                std::to_string(coefficients.size()));
  }
  Camera::Distortion distortion{};
  std::copy(coefficients.begin(), coefficients.end(), distortion.begin());
  return distortion;
}

py::tuple distortion_tuple(const Camera& camera) { return py::tuple(py::cast(camera.distortion())); }

std::string repr(const Camera& camera) {
  const auto number = [](double value) { return py::repr(py::float_(value)).cast<std::string>(); };
  const std::string size = "width=" + std::to_string(camera.width()) + ", height=" + std::to_string(camera.height());
  if (camera.model() == Camera::Model::orthographic) {
    return "Camera.orthographic(" + size + ", pixel_size=" + number(camera.pixel_size()) + ")";
  }
  std::string text = "Camera(" + size + ", fx=" + number(camera.fx()) + ", fy=" + number(camera.fy()) +
                     ", cx=" + number(camera.cx()) + ", cy=" + number(camera.cy());
  if (camera.distortion() != Camera::Distortion{}) {
    text += ", distortion=" + py::repr(distortion_tuple(camera)).cast<std::string>();
  }
  if (camera.depth_kind() == DepthKind::radial) text += ", depth='radial'";
  return text + ")";
}

py::array_t<double> project(const Camera& camera, const PointArray& given) {
  const py::array_t<double, py::array::c_style | py::array::forcecast> points(
      py::module_::import("nacre._internal.arrays").attr("as_real")("points", given));
  if (points.ndim() != 2 || points.shape(1) != 3) {
    throw std::invalid_argument("points must have shape (N, 3), got " +
                                py::repr(points.attr("shape")).cast<std::string>());
  }
  const py::ssize_t count = points.shape(0);
  py::array_t<double> pixels({count, py::ssize_t{2}});
  const double* const source = points.data();
  double* const target = pixels.mutable_data();
  const Released release;
  for (py::ssize_t i = 0; i < count; ++i) {
    Eigen::Map<Eigen::Vector2d>(target + 2 * i) = camera.project(Eigen::Map<const Eigen::Vector3d>(source + 3 * i));
  }
  return pixels;
}

py::tuple to_state(const Camera& c) {
  return py::make_tuple(model_name(c), c.width(), c.height(), c.fx(), c.fy(), c.cx(), c.cy(), distortion_tuple(c),
                        depth_name(c), c.pixel_size());
}

Camera from_state(const py::tuple& state) {
  const int width = state[1].cast<int>(), height = state[2].cast<int>();
  if (state[0].cast<std::string>() == "orthographic") {
    return Camera::orthographic(width, height, state[9].cast<double>());
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
distortion : 4 or 5 floats
    Brown-Conrady coefficients k1 k2 p1 p2 (k3), in OpenCV's order.
depth : "z" or "radial"
    What a depth value measures: the distance along the optical axis, or along the pixel's ray.

Raises
------
ValueError
    Names the argument that is out of range.)")
      .def(py::init([](const Whole& width, const Whole& height, const Real& fx, const Real& fy, const Real& cx,
                       const Real& cy, const Coefficients& distortion, const Depth& depth) {
             if (!py::isinstance<py::str>(depth)) refuse("depth", "'z' or 'radial'", depth);
             return Camera::pinhole(as_pixels("width", width), as_pixels("height", height), as_number("fx", fx),
                                    as_number("fy", fy), as_number("cx", cx), as_number("cy", cy),
                                    parse_distortion(distortion), parse_depth_kind(depth.cast<std::string>()));
           }),
           py::arg("width"), py::arg("height"), py::arg("fx"), py::arg("fy"), py::arg("cx"), py::arg("cy"),
           py::kw_only(), py::arg("distortion") = std::vector<double>(5, 0.0), py::arg("depth") = "z")
      .def_static(
          "orthographic",
          [](const Whole& width, const Whole& height, const Real& pixel_size) {
            return Camera::orthographic(as_pixels("width", width), as_pixels("height", height),
                                        as_number("pixel_size", pixel_size));
          },
          py::arg("width"), py::arg("height"), py::arg("pixel_size"),
          "A camera with parallel rays: x = (u - (width - 1) / 2) pixel_size [m].")
      .def_property_readonly("model", &model_name, "'pinhole' or 'orthographic'")
      .def_property_readonly("width", &Camera::width, "[pixels]")
      .def_property_readonly("height", &Camera::height, "[pixels]")
      .def_property_readonly("fx", &Camera::fx, "[pixels]")
      .def_property_readonly("fy", &Camera::fy, "[pixels]")
      .def_property_readonly("cx", &Camera::cx, "[pixels]")
      .def_property_readonly("cy", &Camera::cy, "[pixels]")
      .def_property_readonly("distortion", &distortion_tuple, "k1 k2 p1 p2 k3")
      .def_property_readonly("depth", &depth_name, "'z' or 'radial'")
      .def_property_readonly(
          "pixel_size",
          [](const Camera& camera) {
            if (camera.model() == Camera::Model::orthographic) return camera.pixel_size();
            throw py::attribute_error("pixel_size belongs to an orthographic camera; this one has fx and fy");
          },
          "[m], of an orthographic camera")
      .def("project", &project, py::arg("points"),
           "The pixels (u, v) that see points of the camera frame, (N, 3) -> (N, 2); NaN behind the camera and where "
           "the distortion model has ended.")
      .def(
          "__eq__", [](const Camera& a, const Camera& b) { return a == b; }, py::is_operator())
      .def("__hash__", [](const Camera& camera) { return py::hash(to_state(camera)); })
      .def("__repr__", &repr)
      .def(py::pickle(&to_state, &from_state));
}
