#include "bindings.hpp"
#include "nacre/cubes.hpp"

namespace {

using nacre::CubeGrid;
using nacre::PointsDoubleRef;
using nacre::PointsRef;

template <class T>
using Array = py::array_t<T, py::array::c_style>;

template <class Points>
py::array_t<std::uint64_t> point_hashes(const Points& points, std::uint64_t seed, int num_threads) {
  std::vector<std::uint64_t> hashes;
  {
    const Released release;
    hashes = nacre::point_hashes(points, seed, num_threads);
  }
  return as_array(std::move(hashes));
}

template <class Points>
py::array_t<std::int64_t> cube_numbers(const Points& points, const Eigen::Vector3d& origin, double side,
                                       const std::array<std::int64_t, 3>& shape, int num_threads) {
  std::vector<std::int64_t> numbers;
  {
    const Released release;
    numbers = nacre::cube_numbers(points, CubeGrid{origin, side, shape}, num_threads);
  }
  return as_array(std::move(numbers));
}

py::tuple group_by_number(const Array<std::int64_t>& numbers) {
  nacre::NumberGroups groups;
  {
    const Released release;
    groups = nacre::group_by_number(numbers.data(), numbers.size());
  }
  return py::make_tuple(as_array(std::move(groups.numbers)), as_array(std::move(groups.counts)),
                        as_array(std::move(groups.rows)));
}

py::tuple order_by_hash(const std::vector<std::int64_t>& starts, const Array<std::uint64_t>& hashes, int num_threads) {
  nacre::HashOrder order;
  {
    const Released release;
    order = nacre::order_by_hash(starts, hashes.data(), hashes.size(), num_threads);
  }
  return py::make_tuple(as_array(std::move(order.rows)), as_array(std::move(order.hashes)));
}

}  // namespace

void bind_cubes(py::module_& m) {
  m.def("point_hashes", &point_hashes<PointsRef>, py::arg("points").noconvert(), py::arg("seed"),
        py::arg("num_threads"));
  m.def("point_hashes", &point_hashes<PointsDoubleRef>, py::arg("points").noconvert(), py::arg("seed"),
        py::arg("num_threads"));
  m.def("cube_numbers", &cube_numbers<PointsRef>, py::arg("points").noconvert(), py::arg("origin"), py::arg("side"),
        py::arg("shape"), py::arg("num_threads"));
  m.def("cube_numbers", &cube_numbers<PointsDoubleRef>, py::arg("points").noconvert(), py::arg("origin"),
        py::arg("side"), py::arg("shape"), py::arg("num_threads"));
  m.def("group_by_number", &group_by_number, py::arg("numbers").noconvert());
  m.def("order_by_hash", &order_by_hash, py::arg("starts"), py::arg("hashes").noconvert(), py::arg("num_threads"));
}
