#include "bindings.hpp"
#include "nacre/simulation.hpp"

namespace {

using nacre::SimulationOptions;

nacre::DepthImage simulate(const nacre::MeshTree& mesh, const nacre::Camera& camera,
                           const Eigen::Matrix4d& world_from_camera, const SimulationOptions& options) {
  return nacre::simulate_depth(mesh, camera, nacre::Pose(world_from_camera), options);
}

}  // namespace

void bind_simulation(py::module_& m) {
  py::class_<SimulationOptions>(m, "SimulationOptions")
      .def(py::init<>())
      .def_readwrite("noise", &SimulationOptions::noise)
      .def_readwrite("edge_mixing", &SimulationOptions::edge_mixing)
      .def_readwrite("background_depth", &SimulationOptions::background_depth)
      .def_readwrite("quantization", &SimulationOptions::quantization)
      .def_readwrite("dropout", &SimulationOptions::dropout)
      .def_readwrite("seed", &SimulationOptions::seed)
      .def_readwrite("num_threads", &SimulationOptions::num_threads);
  m.def("simulate_depth", &simulate, py::arg("mesh"), py::arg("camera"), py::arg("world_from_camera"),
        py::arg("options"), ReleaseGil());
}
