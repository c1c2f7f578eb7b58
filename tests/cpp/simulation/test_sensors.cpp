#include <cmath>
#include <stdexcept>
#include <string>

#include "doctest/doctest.h"
#include "meshes.hpp"
#include "nacre/simulation.hpp"
#include "simulation/smooth_noise.hpp"

using nacre::Camera;
using nacre::DepthImage;
using nacre::MeshTree;
using nacre::Pose;
using nacre::Sensor;
using nacre::SimulationOptions;

namespace {

constexpr Sensor all_sensors[] = {Sensor::stereo, Sensor::structured_light, Sensor::time_of_flight,
                                  Sensor::phone_lidar};

MeshTree board_before_wall() {
  const nacre::Mesh scene = nacre_test::together(nacre_test::quad({-9, -9, 2}, {18, 0, 0}, {0, 18, 0}),
                                                 nacre_test::quad({-0.2F, -0.2F, 1}, {0.4F, 0, 0}, {0, 0.4F, 0}));
  return MeshTree(scene.vertices, scene.triangles);
}

bool same(const DepthImage& a, const DepthImage& b) { return ((a == b) || (a.isNaN() && b.isNaN())).all(); }

std::string refusal(const Camera& camera, const SimulationOptions& options) {
  try {
    nacre::simulate_depth(board_before_wall(), camera, Pose::Identity(), options);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("smooth noise is standard normal at every place, and alike at places near each other") {
  constexpr int count = 20000;
  for (const double offset : {0.0, 0.3, 0.5}) {
    double sum = 0.0, squares = 0.0, near = 0.0, one = 0.0, far = 0.0;
    for (int i = 0; i < count; ++i) {
      const auto at = [&](double x) {
        return nacre::smooth_noise<2>(5, Eigen::Vector2d(8.0 * i + offset + x, -offset));
      };
      const double here = at(0.0);
      sum += here, squares += here * here, near += here * at(0.3), one += here * at(1.0), far += here * at(4.0);
    }
    CHECK(std::abs(sum / count) < 0.03);
    CHECK(squares / count == doctest::Approx(1.0).epsilon(0.04));
    CHECK(near / count > 0.85);
    CHECK(one / count == doctest::Approx(0.4).epsilon(0.2));
    CHECK(std::abs(far / count) < 0.03);
  }
}

TEST_CASE("smooth noise is finite anywhere") {
  for (const double far : {1e15, -1e15, 1e300}) {
    CHECK(std::isfinite(nacre::smooth_noise<3>(1, Eigen::Vector3d(far, 0.5, -far))));
  }
}

TEST_CASE("sensors give the same bits for any number of threads, others for another seed") {
  const MeshTree scene = board_before_wall();
  const Camera camera = Camera::pinhole(80, 60, 100, 100, 39.5, 29.5);
  for (const Sensor sensor : all_sensors) {
    SimulationOptions options;
    options.sensor = sensor;
    options.num_threads = 1;
    const DepthImage one = nacre::simulate_depth(scene, camera, Pose::Identity(), options);
    for (const int threads : {2, 3}) {
      options.num_threads = threads;
      CHECK(same(nacre::simulate_depth(scene, camera, Pose::Identity(), options), one));
    }
    options.seed = 1;
    CHECK(!same(nacre::simulate_depth(scene, camera, Pose::Identity(), options), one));
  }
}

TEST_CASE("a sensor refuses parallel rays, and edges that are mixed already") {
  for (const Sensor sensor : all_sensors) {
    SimulationOptions options;
    options.sensor = sensor;
    CHECK(refusal(Camera::orthographic(4, 4, 0.01), options) ==
          "camera must be a pinhole camera for a sensor, got an orthographic one");
    options.edge_mixing = 1.0;
    CHECK(refusal(Camera::pinhole(4, 4, 4, 4, 1.5, 1.5), options) ==
          "edge_mixing must be 0 with a sensor, which mixes by itself, got 1");
  }
}
