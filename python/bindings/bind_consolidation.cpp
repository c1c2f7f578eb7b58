#include "bindings.hpp"
#include "nacre/consolidation.hpp"

namespace {

using nacre::ConsolidateOptions;

// Points are gone over more than once, and another Python thread may write to their array meanwhile.
template <class Cloud>
using Snapshot = typename Cloud::PlainObject;

template <class T>
py::array_t<T> to_array(std::vector<T>&& values) {
  auto* kept = new std::vector<T>(std::move(values));
  const py::capsule owner(kept, [](void* memory) { delete static_cast<std::vector<T>*>(memory); });
  return py::array_t<T>(static_cast<py::ssize_t>(kept->size()), kept->data(), owner);
}

// `progress` gets the iterations done and wanted; a false answer ends them.
template <class Cloud>
py::tuple consolidate(const Cloud& points, ConsolidateOptions options, const nacre::AttributesRef& attributes,
                      const std::optional<py::function>& progress) {
  if (progress) {
    options.progress = [&progress](int done, int total) {
      const py::gil_scoped_acquire locked;
      return (*progress)(done, total).cast<bool>();
    };
  }
  decltype(nacre::consolidate(points, options, attributes)) result;
  {
    const Released unlocked;
    const Snapshot<Cloud> points_now = points;
    result = nacre::consolidate(Cloud(points_now), options, attributes);
  }
  return py::make_tuple(std::move(result.points), std::move(result.attributes), to_array(std::move(result.sources)),
                        result.iterations);
}

template <class Cloud>
auto project_samples(const Cloud& samples, const Cloud& points, const ConsolidateOptions& options,
                     const nacre::ProjectionHints& hints) {
  const Snapshot<Cloud> samples_now = samples, points_now = points;
  return nacre::project_samples(Cloud(samples_now), Cloud(points_now), options, hints);
}

}  // namespace

void bind_consolidation(py::module_& m) {
  py::native_enum<nacre::ConsolidationMethod>(m, "ConsolidationMethod", "enum.Enum")
      .value("wlop", nacre::ConsolidationMethod::wlop)
      .value("wlop_plus", nacre::ConsolidationMethod::wlop_plus)
      .value("cgal", nacre::ConsolidationMethod::cgal)
      .finalize();
  py::native_enum<nacre::Theta>(m, "Theta", "enum.Enum")
      .value("huang", nacre::Theta::huang)
      .value("printed", nacre::Theta::printed)
      .finalize();

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

  // The arguments are noconvert, so that each array meets the overload of its own precision.
  m.def("consolidate", &consolidate<nacre::PointsRef>, py::arg("points").noconvert(), py::arg("options"),
        py::arg("attributes"), py::arg("progress"), "Points, attributes, sources, iterations; see nacre.consolidate.");
  m.def("consolidate", &consolidate<nacre::PointsDoubleRef>, py::arg("points").noconvert(), py::arg("options"),
        py::arg("attributes"), py::arg("progress"), "Points, attributes, sources, iterations; see nacre.consolidate.");

  py::class_<nacre::ProjectionHints>(m, "ProjectionHints")
      .def(py::init<>())
      .def_readwrite("point_weights", &nacre::ProjectionHints::point_weights)
      .def_readwrite("sample_normals", &nacre::ProjectionHints::sample_normals)
      .def_readwrite("frozen", &nacre::ProjectionHints::frozen);

  m.def("project_samples", &project_samples<nacre::PointsRef>, py::arg("samples").noconvert(),
        py::arg("points").noconvert(), py::arg("options"), py::arg("hints"), ReleaseGil());
  m.def("project_samples", &project_samples<nacre::PointsDoubleRef>, py::arg("samples").noconvert(),
        py::arg("points").noconvert(), py::arg("options"), py::arg("hints"), ReleaseGil());
}
