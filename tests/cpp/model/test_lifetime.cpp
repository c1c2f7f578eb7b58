// Models that come and go. Under the address sanitizer the end of the program tells of what they left (LeakSanitizer).
#include <utility>

#include "doctest/doctest.h"
#include "nacre/mesh.hpp"
#include "nacre/model.hpp"
#include "nacre/simulation.hpp"

using namespace nacre;

TEST_CASE("A thousand models are made, run and destroyed") {
  const Mesh mesh = built_in_object();
  const MeshTree tree(mesh.vertices, mesh.triangles);
  const Camera camera = Camera::pinhole(40, 30, 50.0, 50.0, 19.5, 14.5);
  Pose world_from_camera = Pose::Identity();
  world_from_camera.translation() << 0.0, 0.06, -0.2;
  SimulationOptions simulation;
  simulation.noise.constant = 0.0005;
  const DepthImage first = simulate_depth(tree, camera, world_from_camera, simulation);
  world_from_camera.translation().x() += 0.003;
  const DepthImage second = simulate_depth(tree, camera, world_from_camera, simulation);

  for (int cycle = 0; cycle < 1000; ++cycle) {
    ModelOptions options;
    options.fusion_method = static_cast<FusionMethod>(cycle % 3);
    options.num_threads = 1 + cycle % 2;
    options.relocalise = cycle % 100 == 0;  // takes long
    Model model(camera, options);
    FrameExtras extras;
    if (cycle % 2 == 1) extras.colors = Colors::Constant(first.size(), 3, 100);
    model.add_frame(first, extras);
    REQUIRE(model.add_frame(second, extras).status == FrameStatus::tracked);
    CHECK_THROWS_AS(model.add_frame(DepthImage::Ones(2, 2)), std::invalid_argument);
    const Model moved = std::move(model);
    REQUIRE(moved.cloud().size() > 0);
  }
}
