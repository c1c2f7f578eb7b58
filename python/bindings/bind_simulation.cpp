#include "bindings.hpp"
#include "nacre/simulation.hpp"

namespace {

using nacre::Sensor;
using nacre::SimulationOptions;

nacre::DepthImage simulate(const nacre::MeshTree& mesh, const nacre::Camera& camera,
                           const Eigen::Matrix4d& world_from_camera, const SimulationOptions& options) {
  return nacre::simulate_depth(mesh, camera, nacre::Pose(world_from_camera), options);
}

}  // namespace

void bind_simulation(py::module_& m) {
  py::native_enum<Sensor>(m, "Sensor", "enum.Enum")
      .value("none", Sensor::none)
      .value("stereo", Sensor::stereo)
      .value("structured_light", Sensor::structured_light)
      .value("time_of_flight", Sensor::time_of_flight)
      .value("phone_lidar", Sensor::phone_lidar)
      .finalize();

  py::class_<SimulationOptions>(m, "SimulationOptions")
      .def(py::init<>())
      .def_readwrite("sensor", &SimulationOptions::sensor)
      .def_readwrite("noise", &SimulationOptions::noise)
      .def_readwrite("edge_mixing", &SimulationOptions::edge_mixing)
      .def_readwrite("background_depth", &SimulationOptions::background_depth)
      .def_readwrite("quantization", &SimulationOptions::quantization)
      .def_readwrite("dropout", &SimulationOptions::dropout)
      .def_readwrite("seed", &SimulationOptions::seed)
      .def_readwrite("sensor_seed", &SimulationOptions::sensor_seed)
      .def_readwrite("num_threads", &SimulationOptions::num_threads);
  m.def("simulate_depth", &simulate, py::arg("mesh"), py::arg("camera"), py::arg("world_from_camera"),
        py::arg("options"), ReleaseGil());
}
