#include "bindings.hpp"
#include "nacre/consolidation.hpp"

namespace {

using nacre::ConsolidateOptions;

template <class T>
py::array_t<T> to_array(std::vector<T>&& values) {
  auto* kept = new std::vector<T>(std::move(values));
  const py::capsule owner(kept, [](void* memory) { delete static_cast<std::vector<T>*>(memory); });
  return py::array_t<T>(static_cast<py::ssize_t>(kept->size()), kept->data(), owner);
}

}  // namespace

void bind_consolidation(py::module_& m) {
  py::enum_<nacre::ConsolidationMethod>(m, "ConsolidationMethod")
      .value("wlop", nacre::ConsolidationMethod::wlop)
      .value("wlop_plus", nacre::ConsolidationMethod::wlop_plus)
      .value("cgal", nacre::ConsolidationMethod::cgal);
  py::enum_<nacre::Theta>(m, "Theta").value("huang", nacre::Theta::huang).value("printed", nacre::Theta::printed);

  py::class_<ConsolidateOptions>(m, "ConsolidateOptions")
      .def(py::init<>())
      .def_readwrite("method", &ConsolidateOptions::method)
      .def_readwrite("radius", &ConsolidateOptions::radius)
      .def_readwrite("num_points", &ConsolidateOptions::num_points)
      .def_readwrite("iterations", &ConsolidateOptions::iterations)
      .def_readwrite("mu", &ConsolidateOptions::mu)
      .def_readwrite("theta", &ConsolidateOptions::theta)
      .def_readwrite("seed", &ConsolidateOptions::seed)
      .def_readwrite("num_threads", &ConsolidateOptions::num_threads)
      .def("check", &ConsolidateOptions::check);

  m.def(
      "consolidate",
      [](const nacre::PointsRef& points, const ConsolidateOptions& options, const nacre::AttributesRef& attributes) {
        nacre::Consolidated result;
        {
          const py::gil_scoped_release unlocked;
          result = nacre::consolidate(points, options, attributes);
        }
        return py::make_tuple(std::move(result.points), std::move(result.attributes),
                              to_array(std::move(result.sources)));
      },
      py::arg("points"), py::arg("options"), py::arg("attributes"),
      "Points, attributes and sources; see nacre.consolidate.");

  py::class_<nacre::ProjectionHints>(m, "ProjectionHints")
      .def(py::init<>())
      .def_readwrite("point_weights", &nacre::ProjectionHints::point_weights)
      .def_readwrite("sample_normals", &nacre::ProjectionHints::sample_normals)
      .def_readwrite("frozen", &nacre::ProjectionHints::frozen);

  m.def("project_samples", &nacre::project_samples, py::arg("samples"), py::arg("points"), py::arg("options"),
        py::arg("hints"), ReleaseGil());
}
