#include <utility>

#include "bindings.hpp"
#include "nacre/rendering.hpp"

namespace {

py::array_t<std::uint8_t> render(const nacre::PointsDoubleRef& points, const nacre::PointsRef& normals,
                                 const nacre::ColorsRef& colors, const nacre::ValuesRef& radii,
                                 const Eigen::Matrix3d& view_from_model, const Eigen::Vector3d& center,
                                 double metres_per_pixel, double distance, int width, int height, bool hide_reverse,
                                 int num_threads) {
  const nacre::PictureView view{view_from_model, center, metres_per_pixel, distance, width, height};
  nacre::Picture picture;
  {
    const Released release;
    picture = nacre::render_points(points, normals, colors, radii, view, hide_reverse, num_threads);
  }
  return py::array_t<std::uint8_t>(py::cast(std::move(picture))).reshape({height, width, 4});
}

}  // namespace

void bind_rendering(py::module_& m) {
  m.def("render_points", &render, py::arg("points"), py::arg("normals"), py::arg("colors"), py::arg("radii"),
        py::kw_only(), py::arg("view_from_model"), py::arg("center"), py::arg("metres_per_pixel"), py::arg("distance"),
        py::arg("width"), py::arg("height"), py::arg("hide_reverse"), py::arg("num_threads"));
}
