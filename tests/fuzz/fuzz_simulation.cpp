// A camera anywhere that looks at any mesh.
#include "nacre/simulation.hpp"
#include "options.hpp"

NACRE_FUZZ_TARGET(bytes) {
  using namespace nacre;
  const Points vertices = bytes.points(40);
  Triangles triangles(bytes.integer(0, 60), 3);
  for (Eigen::Index i = 0; i < triangles.size(); ++i) {
    triangles.data()[i] = bytes.byte() % std::max(1, static_cast<int>(vertices.rows()));
  }
  const MeshTree tree(vertices, triangles);
  const Camera camera = bytes.camera(24);
  SimulationOptions options;
  if (bytes.boolean()) options.noise = nacre_fuzz::noise_model(bytes);
  bytes.change(options.edge_mixing), bytes.change(options.background_depth), bytes.change(options.quantization);
  bytes.change(options.dropout);
  options.seed = bytes.byte();
  if (camera.model() == Camera::Model::pinhole && options.edge_mixing == 0.0) {
    options.sensor = static_cast<Sensor>(bytes.integer(0, 4));
  }
  options.num_threads = bytes.threads();
  const DepthImage depth = simulate_depth(tree, camera, bytes.pose(), options);
  NACRE_HOLDS(depth.rows() == camera.height() && depth.cols() == camera.width());
  for (Eigen::Index i = 0; i < depth.size(); ++i) {
    const float z = depth.data()[i];
    NACRE_HOLDS(std::isnan(z) || (std::isfinite(z) && z > 0.0F));
  }
}
