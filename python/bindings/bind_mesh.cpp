#include <utility>

#include "bindings.hpp"
#include "nacre/mesh.hpp"

namespace {

using nacre::MeshTree;
using nacre::PointsDoubleRef;

py::tuple cast_rays(const MeshTree& tree, const PointsDoubleRef& origins, const PointsDoubleRef& directions,
                    int num_threads) {
  MeshTree::Hits hits;
  {
    const Released release;
    hits = tree.cast(origins, directions, num_threads);
  }
  return py::make_tuple(std::move(hits.distances), std::move(hits.triangles));
}

py::tuple closest_points(const MeshTree& tree, const PointsDoubleRef& points, int num_threads) {
  MeshTree::ClosestPoints found;
  {
    const Released release;
    found = tree.closest(points, num_threads);
  }
  return py::make_tuple(std::move(found.points), std::move(found.normals), std::move(found.distances),
                        std::move(found.triangles));
}

py::tuple make_built_in_object() {
  nacre::Mesh mesh;
  {
    const Released release;
    mesh = nacre::built_in_object();
  }
  return py::make_tuple(std::move(mesh.vertices), std::move(mesh.triangles));
}

}  // namespace

void bind_mesh(py::module_& m) {
  py::class_<MeshTree>(m, "MeshTree")
      .def(py::init<const nacre::PointsRef&, const nacre::TrianglesRef&>(), py::arg("vertices"), py::arg("triangles"),
           ReleaseGil())
      .def("cast", &cast_rays, py::arg("origins"), py::arg("directions"), py::arg("num_threads"))
      .def("closest", &closest_points, py::arg("points"), py::arg("num_threads"))
      .def_property_readonly("lower", &MeshTree::lower)
      .def_property_readonly("upper", &MeshTree::upper);
  m.def("built_in_object", &make_built_in_object);
  m.def("connected_parts", &nacre::connected_parts, py::arg("triangles"), py::arg("num_points"), ReleaseGil());
  m.def("on_surface", &nacre::on_surface, py::arg("points"), py::arg("normals"), py::arg("confidence"),
        py::arg("num_threads"), ReleaseGil());
  m.def("triangulate", &nacre::triangulate, py::arg("points"), py::arg("normals"), py::arg("num_threads"),
        ReleaseGil());
}
