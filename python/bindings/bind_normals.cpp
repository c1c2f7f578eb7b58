#include "bindings.hpp"
#include "nacre/normals.hpp"

void bind_normals(py::module_& m) {
  using nacre::NormalOptions;
  py::class_<NormalOptions>(m, "NormalOptions")
      .def(py::init<>())
      .def_readwrite("k", &NormalOptions::k)
      .def_readwrite("max_radius", &NormalOptions::max_radius)
      .def_readwrite("num_threads", &NormalOptions::num_threads);
  m.def("estimate_normals",
        py::overload_cast<const nacre::PointsRef&, const NormalOptions&, const Eigen::Vector3d&>(
            &nacre::estimate_normals),
        py::arg("points").noconvert(), py::arg("options"), py::arg("viewpoint"), ReleaseGil());
  m.def("estimate_normals",
        py::overload_cast<const nacre::PointsDoubleRef&, const NormalOptions&, const Eigen::Vector3d&>(
            &nacre::estimate_normals),
        py::arg("points").noconvert(), py::arg("options"), py::arg("viewpoint"), ReleaseGil());
}
