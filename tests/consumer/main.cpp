// A stranger's program: a wavy surface seen twice by a depth camera, through most of nacre's public headers.
#include <cmath>
#include <cstdio>

#include "nacre/camera.hpp"
#include "nacre/consolidation.hpp"
#include "nacre/depth.hpp"
#include "nacre/kdtree.hpp"
#include "nacre/model.hpp"
#include "nacre/normals.hpp"
#include "nacre/registration.hpp"
#include "nacre/version.hpp"

namespace {

int failures = 0;

void check(bool condition, const char* what, double value) {
  std::printf("%-32s %12.6g  %s\n", what, value, condition ? "ok" : "FAILED");
  failures += !condition;
}

nacre::DepthImage wavy_surface(const nacre::Camera& camera) {
  nacre::DepthImage depth(camera.height(), camera.width());
  for (int v = 0; v < camera.height(); ++v) {
    for (int u = 0; u < camera.width(); ++u) {
      depth(v, u) = 1.0f + 0.05f * std::sin(0.15f * static_cast<float>(u)) * std::cos(0.11f * static_cast<float>(v));
    }
  }
  return depth;
}

}  // namespace

int main() {
  std::printf("nacre %s\n", NACRE_VERSION);
  const nacre::Camera camera = nacre::Camera::pinhole(160, 120, 150, 150, 79.5, 59.5);
  const nacre::DepthImage depth = wavy_surface(camera);

  nacre::Points points = nacre::back_project(depth, camera);
  check(points.rows() == 160 * 120, "points", static_cast<double>(points.rows()));

  const nacre::KdTree tree(points);
  const nacre::Neighbors neighbors = tree.query(points, 2);
  check((neighbors.distances.col(0).array() == 0.0).all(), "distance to itself", neighbors.distances.col(0).maxCoeff());

  const nacre::Points normals = nacre::estimate_normals(points);
  check(normals.rows() == points.rows(), "normals", static_cast<double>(normals.rows()));

  nacre::Pose truth = nacre::Pose::Identity();
  truth.rotate(Eigen::AngleAxisd(0.02, Eigen::Vector3d(1, 2, 3).normalized()));
  truth.pretranslate(Eigen::Vector3d(0.004, -0.003, 0.002));
  const Eigen::Matrix3f rotation = truth.linear().cast<float>();
  const Eigen::RowVector3f translation = truth.translation().transpose().cast<float>();
  const nacre::Points moved = (points * rotation.transpose()).rowwise() + translation;
  const nacre::AlignResult result = nacre::align(nacre::AlignCloud(points), nacre::AlignCloud(moved));
  const double error = (result.target_from_source.matrix() - truth.matrix()).norm();
  check(result.converged() && error < 1e-3, "registration error", error);

  nacre::ConsolidateOptions options;
  options.radius = 0.05;
  options.num_points = 500;
  const nacre::Consolidated thin = nacre::consolidate(points, options);
  check(thin.points.rows() == 500, "consolidated points", static_cast<double>(thin.points.rows()));

  nacre::Model model(camera);
  const nacre::FrameReport report = model.add_frame(depth);
  check(report.status == nacre::FrameStatus::tracked, "model points", static_cast<double>(model.cloud().size()));

  // Memory that nacre allocated is resized and freed here: both sides must agree on how, whatever their compiler flags.
  points.resize(2 * points.rows(), 3);
  return failures == 0 ? 0 : 1;
}
