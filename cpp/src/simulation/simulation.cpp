#include "nacre/simulation.hpp"

#include <cmath>
#include <limits>

#include "base/check.hpp"
#include "base/parallel.hpp"
#include "base/pose_check.hpp"
#include "base/random.hpp"
#include "simulation/mixed_edges.hpp"
#include "simulation/sensors.hpp"
#include "simulation/view.hpp"

namespace nacre {
namespace {

// Without a sensor's errors: what the pixels see, and where they see both sides of an edge.
Depths see(const View& view, const SimulationOptions& options) {
  const Hits hits = cast_pixels(view, options.num_threads);
  const bool mixes = options.edge_mixing > 0.0;
  const double background = mixes ? background_of(view, hits, options.background_depth) : 0.0;
  const std::vector<std::uint8_t> edges =
      mixes ? find_edges(view, hits, options.edge_mixing, options.num_threads) : std::vector<std::uint8_t>();
  return depths_of(view, options.num_threads, [&](std::int64_t i, double u, double v) {
    if (mixes && edges[as_size(i)]) return mixed_depth(view, u, v, options.edge_mixing, background);
    return hits[as_size(i)].triangle >= 0 ? hits[as_size(i)].distance : not_measured;
  });
}

Depths sense(const View& view, const SimulationOptions& options) {
  const Seeds seeds = {options.seed, options.sensor_seed};
  const int threads = options.num_threads;
  switch (options.sensor) {
    case Sensor::stereo:
      return sense_stereo(view, seeds, threads);
    case Sensor::structured_light:
      return sense_structured_light(view, seeds, threads);
    case Sensor::time_of_flight:
      return sense_time_of_flight(view, seeds, options.background_depth, threads);
    case Sensor::phone_lidar:
      return sense_phone_lidar(view, seeds, threads);
    case Sensor::none:
      break;
  }
  return see(view, options);
}

// What noise, steps and dropout make of a depth.
double measure(double depth, std::int64_t pixel, const SimulationOptions& options) {
  const auto counter = static_cast<std::uint64_t>(pixel);
  const double sigma = options.noise.sigma(depth);
  if (sigma > 0.0) depth += sigma * random_normal(options.seed, counter);
  if (options.quantization > 0.0) depth = std::round(depth / options.quantization) * options.quantization;
  constexpr std::uint64_t dropout_stream = std::uint64_t{1} << 63;
  const bool dropped =
      options.dropout > 0.0 && random_uniform(options.seed, dropout_stream | counter) < options.dropout;
  using Stored = std::numeric_limits<float>;
  return depth >= Stored::denorm_min() && depth <= Stored::max() && !dropped ? depth : not_measured;
}

}  // namespace

void SimulationOptions::check() const {
  const auto require_length = [](double value, const char* name) {
    require(std::isfinite(value) && value >= 0.0, name, "finite and at least 0", value);
  };
  require_length(noise.constant, "noise.constant");
  require_length(noise.quadratic, "noise.quadratic");
  require(std::isfinite(noise.offset), "noise.offset", "finite", noise.offset);
  require(noise.shared >= 0.0 && noise.shared < 1.0, "noise.shared", "a part from 0 to below 1", noise.shared);
  require(edge_mixing >= 0.0 && edge_mixing <= 16.0, "edge_mixing", "0 to 16 pixels", edge_mixing);
  require(edge_mixing == 0.0 || sensor == Sensor::none, "edge_mixing", "0 with a sensor, which mixes by itself",
          edge_mixing);
  require_length(background_depth, "background_depth");
  require_length(quantization, "quantization");
  require(dropout >= 0.0 && dropout <= 1.0, "dropout", "0 to 1", dropout);
  require(num_threads >= 0, "num_threads", "at least 0", num_threads);
}

DepthImage simulate_depth(const MeshTree& mesh, const Camera& camera, const Pose& world_from_camera,
                          const SimulationOptions& options) {
  options.check();
  require(options.sensor == Sensor::none || camera.model() == Camera::Model::pinhole, "camera",
          "a pinhole camera for a sensor", "an orthographic one");
  require_rigid(world_from_camera, "world_from_camera");
  const View view(mesh, camera, world_from_camera);
  const Depths depths = sense(view, options);
  DepthImage image(camera.height(), camera.width());
  parallel_for(view.num_pixels(), 1024, options.num_threads,
               [&](std::int64_t i) { image.data()[i] = static_cast<float>(measure(depths[as_size(i)], i, options)); });
  return image;
}

}  // namespace nacre
