#include "bindings.hpp"
#include "nacre/kdtree.hpp"

namespace {

using nacre::KdTree;
using nacre::PointsDoubleRef;
using nacre::PointsRef;

// In NumPy's own memory, which is in large pages where it is large.
template <class Points>
py::tuple query(const KdTree& tree, const Points& queries, int k, double max_distance, int num_threads) {
  using Distance = typename Points::Scalar;
  const std::array<py::ssize_t, 2> shape = {queries.rows(), k};
  py::array_t<std::int64_t> indices(shape);
  py::array_t<Distance> distances(shape);
  std::int64_t* const to_indices = indices.mutable_data();
  Distance* const to_distances = distances.mutable_data();
  {
    const Released release;
    tree.query_into(queries, k, max_distance, num_threads, to_indices, to_distances);
  }
  return py::make_tuple(distances, indices);
}

template <class Points>
py::tuple query_radius(const KdTree& tree, const Points& queries, double radius, int num_threads) {
  nacre::RadiusNeighbors found;
  {
    const Released release;
    found = tree.query_radius(queries, radius, num_threads);
  }
  return py::make_tuple(as_array(std::move(found.offsets)), as_array(std::move(found.indices)),
                        as_array(std::move(found.distances)));
}

}  // namespace

// The arguments are noconvert, so that each array meets the overload of its own precision.
void bind_kdtree(py::module_& m) {
  py::class_<KdTree>(m, "KdTree")
      .def(py::init<const PointsRef&, int>(), py::arg("points").noconvert(), py::arg("num_threads"), ReleaseGil())
      .def(py::init<const PointsDoubleRef&, int>(), py::arg("points").noconvert(), py::arg("num_threads"), ReleaseGil())
      .def("__len__", &KdTree::size)
      .def("query", &query<PointsRef>, py::arg("queries").noconvert(), py::arg("k"), py::arg("max_distance"),
           py::arg("num_threads"))
      .def("query", &query<PointsDoubleRef>, py::arg("queries").noconvert(), py::arg("k"), py::arg("max_distance"),
           py::arg("num_threads"))
      .def("query_radius", &query_radius<PointsRef>, py::arg("queries").noconvert(), py::arg("radius"),
           py::arg("num_threads"))
      .def("query_radius", &query_radius<PointsDoubleRef>, py::arg("queries").noconvert(), py::arg("radius"),
           py::arg("num_threads"));
}
