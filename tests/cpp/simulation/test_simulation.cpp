#include <cmath>
#include <limits>

#include "doctest/doctest.h"
#include "meshes.hpp"
#include "nacre/simulation.hpp"

using Eigen::Vector3d;
using nacre::Camera;
using nacre::DepthImage;
using nacre::DepthKind;
using nacre::Mesh;
using nacre::MeshTree;
using nacre::Pose;
using nacre::SimulationOptions;

namespace {

MeshTree tree_of(const Mesh& mesh) { return MeshTree(mesh.vertices, mesh.triangles); }

std::vector<Camera> all_cameras() {
  const Camera::Distortion distortion = {-0.25, 0.08, 0.001, -0.002, 0.01};
  return {Camera::pinhole(80, 60, 70, 72, 39.0, 30.5), Camera::pinhole(80, 60, 70, 72, 39.0, 30.5, distortion),
          Camera::pinhole(80, 60, 70, 72, 39.0, 30.5, {}, DepthKind::radial),
          Camera::pinhole(80, 60, 70, 72, 39.0, 30.5, distortion, DepthKind::radial),
          Camera::orthographic(80, 60, 0.01)};
}

Pose some_pose() {
  Pose pose = Pose::Identity();
  pose.translate(Vector3d(0.3, -0.2, 0.7));
  pose.rotate(Eigen::AngleAxisd(0.4, Vector3d(1, 2, -0.5).normalized()));
  return pose;
}

Vector3d point_of(const Camera& camera, Eigen::Index pixel, double depth) {
  const nacre::Ray ray = camera.ray(static_cast<int>(pixel % camera.width()), static_cast<int>(pixel / camera.width()));
  return {ray.origin_x + depth * ray.direction_x, ray.origin_y + depth * ray.direction_y, depth * ray.direction_z};
}

bool same(const DepthImage& a, const DepthImage& b) { return (a == b || (a.isNaN() && b.isNaN())).all(); }

// A quad before a wall, both facing the camera; the edge of the quad runs along the column x = edge [m].
MeshTree step(double edge) {
  return tree_of(nacre_test::together(nacre_test::quad({-9, -9, 1}, {9 + edge, 0, 0}, {0, 18, 0}),
                                      nacre_test::quad({-9, -9, 2}, {18, 0, 0}, {0, 18, 0})));
}

}  // namespace

TEST_CASE("a slanted plane, in every camera") {
  const Vector3d normal = Vector3d(0.3, -0.4, -1).normalized(), foot(0.1, 0, 2);
  const Vector3d a = normal.cross(Vector3d::UnitX()).normalized(), b = normal.cross(a);
  const Pose pose = some_pose();
  const MeshTree plane = tree_of(
      nacre_test::quad(pose * Vector3d(foot - 50 * a - 50 * b), pose.linear() * (100 * a), pose.linear() * (100 * b)));
  for (const Camera& camera : all_cameras()) {
    const DepthImage depth = nacre::simulate_depth(plane, camera, pose);
    REQUIRE(depth.isFinite().all());
    for (Eigen::Index i = 0; i < depth.size(); ++i) {
      // float corners of a plane 100 m wide place it to about 1e-5 m
      CHECK(std::abs(normal.dot(point_of(camera, i, depth.data()[i]) - foot)) < 1e-5);
      CHECK(camera.depth_of(point_of(camera, i, depth.data()[i])) == doctest::Approx(depth.data()[i]).epsilon(1e-6));
    }
  }
}

TEST_CASE("a sphere is seen where its rays meet it, on the near side") {
  const Vector3d center(0.05, -0.1, 1.5);
  const double radius = 0.2;
  const Pose pose = some_pose();
  const MeshTree sphere = tree_of(nacre_test::sphere(pose * center, radius, 6));
  for (const Camera& camera : all_cameras()) {
    const DepthImage depth = nacre::simulate_depth(sphere, camera, pose);
    int num_hits = 0;
    for (Eigen::Index i = 0; i < depth.size(); ++i) {
      const Vector3d origin = point_of(camera, i, 0.0), direction = point_of(camera, i, 1.0) - origin;
      const Vector3d offset = origin - center;
      const double half = offset.dot(direction), scale = direction.squaredNorm();
      const double discriminant = half * half - scale * (offset.squaredNorm() - radius * radius);
      if (discriminant < 0.0) {
        CHECK(std::isnan(depth.data()[i]));
      } else if (discriminant > 0.01 * radius * radius) {  // not at the rim, where the facets' depth differs most
        ++num_hits;
        CHECK(depth.data()[i] == doctest::Approx((-half - std::sqrt(discriminant)) / scale).epsilon(2e-4));
      }
    }
    CHECK(num_hits > 100);
  }
}

TEST_CASE("every point of an image lies on the mesh, nearer than all else along its ray") {
  const Mesh mesh = nacre::built_in_object();
  const MeshTree tree = tree_of(mesh);
  Pose pose = Pose::Identity();
  pose.translate(Vector3d(0.0, 0.05, -0.3));
  pose.rotate(Eigen::AngleAxisd(3.14159265358979323846, Vector3d::UnitZ()));
  for (const Camera& camera :
       {Camera::orthographic(170, 130, 0.001), Camera::pinhole(160, 120, 160, 160, 79.5, 59.5)}) {
    const DepthImage depth = nacre::simulate_depth(tree, camera, pose);
    int num_valid = 0;
    for (Eigen::Index i = 0; i < depth.size(); ++i) {
      if (std::isnan(depth.data()[i])) continue;
      ++num_valid;
      CHECK(tree.closest(pose * point_of(camera, i, depth.data()[i])).distance < 1e-6);
    }
    CHECK(num_valid > 2000);
  }
}

TEST_CASE("nothing behind an orthographic camera is seen") {
  const MeshTree sphere = tree_of(nacre_test::sphere({0, 0, 0}, 0.2, 4));
  const Camera camera = Camera::orthographic(41, 41, 0.005);
  Pose pose = Pose::Identity();
  const DepthImage inside = nacre::simulate_depth(sphere, camera, pose);
  CHECK(inside(20, 20) == doctest::Approx(0.2).epsilon(1e-3));
  pose.translation().z() = 0.3;
  CHECK(nacre::simulate_depth(sphere, camera, pose).isNaN().all());
}

TEST_CASE("mixed depths lie between both sides of an edge, within its reach and nowhere else") {
  const Camera camera = Camera::orthographic(20, 6, 0.01);
  for (const double radius : {0.5, 1.0, 2.0}) {
    for (const double offset : {0.0, 0.2, 0.45, 0.7}) {  // of the edge, from the centre of column 9 [pixels]
      const double edge = (9 + offset - 9.5) * 0.01;
      SimulationOptions options;
      options.edge_mixing = radius;
      const DepthImage depth = nacre::simulate_depth(step(edge), camera, Pose::Identity(), options);
      for (int u = 0; u < 20; ++u) {
        const double distance = 9 + offset - u;  // to the edge, to the right
        CAPTURE(radius);
        CAPTURE(distance);
        CHECK((depth.col(u) == depth(0, u)).all());
        if (distance >= radius) {
          CHECK(depth(0, u) == 1.0F);
        } else if (distance <= -radius) {
          CHECK(depth(0, u) == 2.0F);
        } else {
          // The part of the tent beyond the edge, to the accuracy of eight samples.
          const double x = distance / radius;
          const double beyond = x > 0 ? 0.5 * (1 - x) * (1 - x) : 1 - 0.5 * (1 + x) * (1 + x);
          CHECK(std::abs(depth(0, u) - (1 + beyond)) < 0.13);
        }
      }
    }
  }
}

TEST_CASE("silhouettes mix with the background, pure background stays empty") {
  const MeshTree square = tree_of(nacre_test::quad({-0.0505, -0.0505, 1}, {0.1, 0, 0}, {0, 0.1, 0}));
  const Camera camera = Camera::orthographic(30, 30, 0.01);
  SimulationOptions options;
  const DepthImage exact = nacre::simulate_depth(square, camera, Pose::Identity(), options);
  options.edge_mixing = 1.0;
  options.background_depth = 3.0;
  const DepthImage mixed = nacre::simulate_depth(square, camera, Pose::Identity(), options);
  CHECK(exact.isFinite().count() == 100);
  CHECK(mixed.isFinite().count() > 100);
  CHECK(mixed.isFinite().count() <= 144);
  CHECK((mixed.isNaN() || (mixed >= 1.0F && mixed < 3.0F)).all());
  CHECK((mixed == 1.0F).count() == 64);  // all but the rim

  options.background_depth = 0.0;
  const DepthImage automatic = nacre::simulate_depth(square, camera, Pose::Identity(), options);
  const float farthest = automatic.isNaN().select(0.0F, automatic).maxCoeff();
  CHECK(farthest > 1.0F);
  CHECK(farthest < 1.0F + 0.1F * 0.1415F);
}

TEST_CASE("mixing leaves slanted and curved surfaces as they are") {
  SimulationOptions options;
  options.edge_mixing = 1.0;
  const MeshTree plane = tree_of(nacre_test::quad({-40, -40, 2 - 40 * 1.2}, {80, 0, 80 * 1.2}, {0, 80, 0}));
  for (const Camera& camera : all_cameras()) {
    const DepthImage exact = nacre::simulate_depth(plane, camera, Pose::Identity());
    CHECK(same(nacre::simulate_depth(plane, camera, Pose::Identity(), options), exact));
  }
  // Of a faceted sphere, the pixels around the rim change alone.
  const MeshTree sphere = tree_of(nacre_test::sphere({0, 0, 1}, 0.1, 4));
  const Camera camera = Camera::orthographic(240, 240, 0.001);
  const DepthImage exact = nacre::simulate_depth(sphere, camera, Pose::Identity());
  const DepthImage mixed = nacre::simulate_depth(sphere, camera, Pose::Identity(), options);
  for (Eigen::Index v = 0; v < 240; ++v) {
    for (Eigen::Index u = 0; u < 240; ++u) {
      if (std::hypot(static_cast<double>(u) - 119.5, static_cast<double>(v) - 119.5) > 97.0) continue;
      CHECK(mixed(v, u) == exact(v, u));
    }
  }
}

TEST_CASE("an edge too fine for the pixel grid is mixed by its share of the pixel") {
  const Camera camera = Camera::orthographic(8, 8, 0.01);
  const Mesh wire = nacre_test::quad({0.0, -1, 1}, {0.01, 0, 0}, {0, 2, 0});
  const MeshTree scene = tree_of(nacre_test::together(wire, nacre_test::quad({-1, -1, 2}, {2, 0, 0}, {0, 2, 0})));
  SimulationOptions options;
  options.edge_mixing = 1.0;
  const DepthImage depth = nacre::simulate_depth(scene, camera, Pose::Identity(), options);
  CHECK(depth(3, 4) == doctest::Approx(2 - 0.75).epsilon(0.03));  // the wire covers the middle of the tent
  CHECK(depth(3, 3) == doctest::Approx(2 - 0.125).epsilon(0.03));
  CHECK(depth(3, 2) == 2.0F);
}

TEST_CASE("noise has the model's deviation and no bias") {
  const MeshTree plane = tree_of(nacre_test::quad({-9, -9, 2}, {18, 0, 0}, {0, 18, 0}));
  const Camera camera = Camera::pinhole(300, 200, 300, 300, 149.5, 99.5);
  SimulationOptions options;
  options.noise = nacre::NoiseModel::kinect();
  options.seed = 5;
  const Eigen::ArrayXXd error = nacre::simulate_depth(plane, camera, Pose::Identity(), options).cast<double>() - 2.0;
  const double sigma = 0.0012 + 0.0019 * 1.6 * 1.6, n = static_cast<double>(error.size());
  CHECK(std::abs(error.mean()) < 4.0 * sigma / std::sqrt(n));
  CHECK(std::sqrt(error.square().mean()) == doctest::Approx(sigma).epsilon(0.015));
  CHECK((error.abs() > 2.0 * sigma).cast<double>().mean() == doctest::Approx(0.0455).epsilon(0.1));
  // Neighbours are independent.
  const double covariance = (error.leftCols(299) * error.rightCols(299)).mean();
  CHECK(std::abs(covariance) < 4.0 * sigma * sigma / std::sqrt(n));
}

TEST_CASE("quantization and dropout") {
  const MeshTree plane = tree_of(nacre_test::quad({-9, -9, 1 - 9 * 0.5}, {18, 0, 18 * 0.5}, {0, 18, 0}));
  const Camera camera = Camera::orthographic(300, 200, 0.001);
  SimulationOptions options;
  const DepthImage exact = nacre::simulate_depth(plane, camera, Pose::Identity(), options);
  options.quantization = 0.004;
  const DepthImage steps = nacre::simulate_depth(plane, camera, Pose::Identity(), options);
  CHECK(((steps - exact).abs() < 0.002F + 1e-6F).all());
  CHECK(((steps / 0.004F - (steps / 0.004F).round()).abs() < 1e-4F).all());
  options.quantization = 0.0;
  options.dropout = 0.3;
  const DepthImage holes = nacre::simulate_depth(plane, camera, Pose::Identity(), options);
  CHECK(holes.isNaN().cast<double>().mean() == doctest::Approx(0.3).epsilon(0.03));
  CHECK((holes.isNaN() || holes == exact).all());
  options.dropout = 1.0;
  CHECK(nacre::simulate_depth(plane, camera, Pose::Identity(), options).isNaN().all());
}

TEST_CASE("the seed decides, the number of threads does not") {
  const MeshTree tree = tree_of(nacre::built_in_object());
  const Camera camera = Camera::pinhole(160, 120, 160, 160, 79.5, 59.5);
  Pose pose = Pose::Identity();
  pose.translation() = Vector3d(0.0, 0.05, -0.2);
  SimulationOptions options;
  options.noise.constant = 0.001;
  options.edge_mixing = 1.0;
  options.dropout = 0.1;
  options.seed = 3;
  options.num_threads = 1;
  const DepthImage one = nacre::simulate_depth(tree, camera, pose, options);
  for (const int threads : {0, 2, 3, 8}) {
    options.num_threads = threads;
    CHECK(same(nacre::simulate_depth(tree, camera, pose, options), one));
  }
  options.seed = 4;
  CHECK(!same(nacre::simulate_depth(tree, camera, pose, options), one));
}

TEST_CASE("depth that no float holds is not measured") {
  const MeshTree plane = tree_of(nacre_test::quad({-9, -9, 0}, {18, 0, 0}, {0, 18, 0}));
  const Camera camera = Camera::orthographic(4, 4, 0.01);
  Pose pose = Pose::Identity();
  pose.translation().z() = -1e-60;
  CHECK(nacre::simulate_depth(plane, camera, pose).isNaN().all());
  pose.translation().z() = -1.0;
  SimulationOptions options;
  options.noise.constant = 1e60;
  CHECK(nacre::simulate_depth(plane, camera, pose, options).isNaN().all());
}

TEST_CASE("options out of range are refused by name") {
  const MeshTree plane = tree_of(nacre_test::quad({-9, -9, 2}, {18, 0, 0}, {0, 18, 0}));
  const Camera camera = Camera::orthographic(4, 4, 0.01);
  const auto message = [&](const SimulationOptions& options) -> std::string {
    try {
      nacre::simulate_depth(plane, camera, Pose::Identity(), options);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  SimulationOptions options;
  for (const double bad : {-1.0, nan}) {
    options = {};
    options.noise.constant = bad;
    CHECK(message(options).find("noise.constant") == 0);
    options = {};
    options.edge_mixing = bad;
    CHECK(message(options).find("edge_mixing") == 0);
    options = {};
    options.background_depth = bad;
    CHECK(message(options).find("background_depth") == 0);
    options = {};
    options.quantization = bad;
    CHECK(message(options).find("quantization") == 0);
    options = {};
    options.dropout = bad;
    CHECK(message(options).find("dropout") == 0);
  }
  options = {};
  options.num_threads = -1;
  CHECK(message(options).find("num_threads") == 0);
  Pose pose = Pose::Identity();
  pose.translation().x() = nan;
  CHECK_THROWS_AS(nacre::simulate_depth(plane, camera, pose), std::invalid_argument);
}
