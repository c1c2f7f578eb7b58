#include "bindings.hpp"
#include "nacre/region.hpp"

namespace {

using nacre::Camera;
using nacre::DepthRef;
using nacre::Frame;
using nacre::MaskImage;
using nacre::MaskRef;
using nacre::NoiseModel;
using nacre::RegionOptions;
using nacre::RegionReport;

std::pair<MaskImage, RegionReport> select_in_depth(const DepthRef& depth, const Camera& camera,
                                                   const RegionOptions& options, const MaskRef& previous,
                                                   const std::optional<NoiseModel>& noise, int num_threads) {
  std::pair<MaskImage, RegionReport> result;
  const Frame frame = nacre::make_frame(depth, camera, noise, num_threads);
  result.first = nacre::select_region(frame, camera, options, previous, &result.second, num_threads);
  return result;
}

}  // namespace

void bind_region(py::module_& m) {
  py::class_<RegionOptions>(m, "RegionOptions")
      .def(py::init<>())
      .def_readwrite("min_x", &RegionOptions::min_x)
      .def_readwrite("max_x", &RegionOptions::max_x)
      .def_readwrite("min_y", &RegionOptions::min_y)
      .def_readwrite("max_y", &RegionOptions::max_y)
      .def_readwrite("min_z", &RegionOptions::min_z)
      .def_readwrite("max_z", &RegionOptions::max_z)
      .def_readwrite("object", &RegionOptions::object)
      .def_readwrite("min_object", &RegionOptions::min_object)
      .def_readwrite("plane_margin", &RegionOptions::plane_margin);
  py::class_<RegionReport>(m, "RegionReport")
      .def_readonly("num_inside", &RegionReport::num_inside)
      .def_readonly("num_outside", &RegionReport::num_outside)
      .def_readonly("support", &RegionReport::support)
      .def_readonly("reason", &RegionReport::reason)
      .def_property_readonly("planes", [](const RegionReport& report) {
        Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor> planes(report.planes.size(), 4);
        for (std::size_t i = 0; i < report.planes.size(); ++i) {
          planes.row(static_cast<Eigen::Index>(i)) << report.planes[i].normal.transpose(), report.planes[i].offset;
        }
        return planes;
      });

  m.def("select_region", &select_in_depth, py::arg("depth"), py::arg("camera"), py::arg("options"), py::arg("previous"),
        py::arg("noise"), py::arg("num_threads"), ReleaseGil());
}
