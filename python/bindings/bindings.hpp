// What every binding file shares. The bindings hold no algorithm: they turn arrays into references, release the GIL
// and call the public C++ interface. Arrays arrive already validated by the Python package.
#pragma once

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "nacre/types.hpp"
#include "nacre/version.hpp"

namespace py = pybind11;

using ReleaseGil = py::call_guard<py::gil_scoped_release>;

// Poses cross the border as 4 x 4 matrices.
using PoseMatrix = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
inline PoseMatrix to_matrix(const nacre::Pose& pose) { return pose.matrix(); }
inline nacre::Pose to_pose(const PoseMatrix& matrix) { return nacre::Pose(matrix); }

// One row per weak direction, as NumPy users expect.
using Twists = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor>;

void bind_camera(py::module_& m);
void bind_consolidation(py::module_& m);
void bind_depth(py::module_& m);
void bind_kdtree(py::module_& m);
void bind_mesh(py::module_& m);
void bind_model(py::module_& m);
void bind_normals(py::module_& m);
void bind_region(py::module_& m);
void bind_registration(py::module_& m);
void bind_simulation(py::module_& m);
void bind_system(py::module_& m);
