#include "bindings.hpp"
#include "nacre/global_registration.hpp"
#include "nacre/registration.hpp"

using namespace nacre;

void bind_registration(py::module_& m) {
  py::native_enum<Metric>(m, "Metric", "enum.Enum")
      .value("point_to_point", Metric::point_to_point)
      .value("point_to_plane", Metric::point_to_plane)
      .value("symmetric", Metric::symmetric)
      .value("paper", Metric::paper)
      .finalize();

  py::class_<AlignOptions>(m, "AlignOptions")
      .def(py::init<>())
      .def_readwrite("method", &AlignOptions::method)
      .def_readwrite("max_iterations", &AlignOptions::max_iterations)
      .def_readwrite("max_distance", &AlignOptions::max_distance)
      .def_readwrite("final_distance", &AlignOptions::final_distance)
      .def_readwrite("gate_decay", &AlignOptions::gate_decay)
      .def_readwrite("max_angle", &AlignOptions::max_angle)
      .def_readwrite("robust", &AlignOptions::robust)
      .def_readwrite("sample_fraction", &AlignOptions::sample_fraction)
      .def_readwrite("max_points", &AlignOptions::max_points)
      .def_readwrite("max_samples", &AlignOptions::max_samples)
      .def_readwrite("coarse_samples", &AlignOptions::coarse_samples)
      .def_readwrite("keep_best", &AlignOptions::keep_best)
      .def_readwrite("weak_threshold", &AlignOptions::weak_threshold)
      .def_readwrite("seed", &AlignOptions::seed)
      .def_readwrite("num_threads", &AlignOptions::num_threads);

  py::class_<AlignResult>(m, "AlignResult")
      .def_property_readonly("target_from_source",
                             [](const AlignResult& result) { return to_matrix(result.target_from_source); })
      .def_property_readonly("status", [](const AlignResult& result) { return to_string(result.status); })
      .def_readonly("iterations", &AlignResult::iterations)
      .def_readonly("num_inliers", &AlignResult::num_inliers)
      .def_readonly("overlap", &AlignResult::overlap)
      .def_readonly("rmse", &AlignResult::rmse)
      .def_readonly("center", &AlignResult::center)
      .def_property_readonly("information",
                             [](const AlignResult& result) { return Eigen::Matrix<double, 6, 6>(result.information); })
      .def_property_readonly("weak_directions",
                             [](const AlignResult& result) { return Twists(result.weak_directions.transpose()); });

  m.def(
      "align",
      [](const PointsRef& source, const PointsRef& source_normals, const ValuesRef& source_sigma,
         const ValuesRef& source_brightness, const PointsRef& target, const PointsRef& target_normals,
         const ValuesRef& target_sigma, const ValuesRef& target_brightness, const PoseMatrix& initial,
         const AlignOptions& options) {
        return align(AlignCloud(source, source_normals, source_sigma, source_brightness),
                     AlignCloud(target, target_normals, target_sigma, target_brightness), to_pose(initial), options);
      },
      ReleaseGil());

  py::class_<GlobalAlignOptions>(m, "GlobalAlignOptions")
      .def(py::init<>())
      .def_readwrite("num_rotations", &GlobalAlignOptions::num_rotations)
      .def_readwrite("num_candidates", &GlobalAlignOptions::num_candidates)
      .def_readwrite("tolerance", &GlobalAlignOptions::tolerance)
      .def_readwrite("max_angle", &GlobalAlignOptions::max_angle)
      .def_readwrite("min_overlap", &GlobalAlignOptions::min_overlap)
      .def_readwrite("min_consistency", &GlobalAlignOptions::min_consistency)
      .def_readwrite("max_residual", &GlobalAlignOptions::max_residual)
      .def_readwrite("max_rivalry", &GlobalAlignOptions::max_rivalry)
      .def_readwrite("outlines", &GlobalAlignOptions::outlines)
      .def_readwrite("max_points", &GlobalAlignOptions::max_points)
      .def_readwrite("max_samples", &GlobalAlignOptions::max_samples)
      .def_readwrite("coarse_samples", &GlobalAlignOptions::coarse_samples)
      .def_readwrite("seed", &GlobalAlignOptions::seed)
      .def_readwrite("num_threads", &GlobalAlignOptions::num_threads);

  py::class_<GlobalAlignResult>(m, "GlobalAlignResult")
      .def_property_readonly("status", [](const GlobalAlignResult& result) { return to_string(result.status); })
      .def_readonly("alignment", &GlobalAlignResult::alignment)
      .def_readonly("overlap", &GlobalAlignResult::overlap)
      .def_readonly("consistency", &GlobalAlignResult::consistency)
      .def_readonly("rivalry", &GlobalAlignResult::rivalry)
      .def_readonly("tolerance", &GlobalAlignResult::tolerance);

  m.def(
      "align_global",
      [](const PointsRef& source, const PointsRef& source_normals,
         const std::optional<Eigen::Vector3d>& source_viewpoint, const PointsRef& target,
         const PointsRef& target_normals, const std::optional<Eigen::Vector3d>& target_viewpoint,
         const GlobalAlignOptions& options) {
        return align_global(GlobalCloud(source, source_normals, source_viewpoint),
                            GlobalCloud(target, target_normals, target_viewpoint), options);
      },
      ReleaseGil());
}
