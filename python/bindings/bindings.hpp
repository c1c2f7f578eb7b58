// What every binding file shares. The bindings hold no algorithm: they turn arrays into references, release the GIL
// and call the public C++ interface. Arrays arrive already validated by the Python package.
#pragma once

#include <pybind11/eigen.h>
#include <pybind11/native_enum.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "nacre/cancel.hpp"
#include "nacre/types.hpp"
#include "nacre/version.hpp"

namespace py = pybind11;

// While it lives, Python's other threads run, and signals are heard: what their handlers raise (Ctrl-C's
// KeyboardInterrupt) ends the call.
class Released {
 public:
  Released() : signals_(&hear_signals) {}

 private:
  static bool hear_signals() {
    const py::gil_scoped_acquire locked;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    return false;
  }

  py::gil_scoped_release unlocked_;
  nacre::CancelScope signals_;
};

using ReleaseGil = py::call_guard<Released>;

// Poses cross the border as 4 x 4 matrices.
using PoseMatrix = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
inline PoseMatrix to_matrix(const nacre::Pose& pose) { return pose.matrix(); }
inline nacre::Pose to_pose(const PoseMatrix& matrix) { return nacre::Pose(matrix); }

// A NumPy array that takes over the vector's memory.
template <class T>
py::array_t<T> as_array(std::vector<T>&& values) {
  auto* owned = new std::vector<T>(std::move(values));
  const py::capsule free(owned, [](void* vector) { delete static_cast<std::vector<T>*>(vector); });
  return py::array_t<T>(static_cast<py::ssize_t>(owned->size()), owned->data(), free);
}

// One row per weak direction, as NumPy users expect.
using Twists = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor>;

void bind_camera(py::module_& m);
void bind_consolidation(py::module_& m);
void bind_cubes(py::module_& m);
void bind_depth(py::module_& m);
void bind_kdtree(py::module_& m);
void bind_mesh(py::module_& m);
void bind_model(py::module_& m);
void bind_normals(py::module_& m);
void bind_region(py::module_& m);
void bind_registration(py::module_& m);
void bind_rendering(py::module_& m);
void bind_simulation(py::module_& m);
void bind_system(py::module_& m);
