// A hash of the bits of each stage's result, from inputs that every platform computes alike: to see where two builds
// differ, compare what they print.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <vector>

#include "base/random.hpp"
#include "nacre/camera.hpp"
#include "nacre/consolidation.hpp"
#include "nacre/depth.hpp"
#include "nacre/kdtree.hpp"
#include "nacre/mesh.hpp"
#include "nacre/model.hpp"
#include "nacre/normals.hpp"
#include "nacre/registration.hpp"
#include "nacre/simulation.hpp"

using namespace nacre;

namespace {

// FNV-1a.
std::uint64_t hash_of(const void* data, std::size_t size) {
  std::uint64_t hash = 14695981039346656037ULL;
  for (std::size_t i = 0; i < size; ++i) hash = (hash ^ static_cast<const unsigned char*>(data)[i]) * 1099511628211ULL;
  return hash;
}

template <class Array>
void print(const char* stage, const Array& array) {
  const std::uint64_t hash = hash_of(array.data(), sizeof(*array.data()) * static_cast<std::size_t>(array.size()));
  std::printf("%-28s %016llx\n", stage, static_cast<unsigned long long>(hash));
}

// A paraboloid with a step, seen from the front: additions, products and divisions alone.
DepthImage step_and_curve(const Camera& camera) {
  DepthImage depth(camera.height(), camera.width());
  for (int v = 0; v < camera.height(); ++v) {
    for (int u = 0; u < camera.width(); ++u) {
      const double x = (u - 79.5) / 80, y = (v - 59.5) / 80;
      const auto pixel = static_cast<std::uint64_t>(v * camera.width() + u);
      const double noise = 0.001 * (random_uniform(5, pixel) - 0.5);
      depth(v, u) = static_cast<float>(0.8 + 0.1 * (x * x + 0.6 * y * y + 0.3 * x * y) + (x > 0.5 ? 0.15 : 0) + noise);
    }
  }
  return depth;
}

// A turn about an axis by 2 atan(tangent), with nothing but a square root.
Pose turned(const Eigen::Vector3d& axis, double tangent) {
  const Eigen::Vector3d v = axis * (tangent / std::sqrt(axis.dot(axis)));
  const double length = std::sqrt(1 + v.dot(v));
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::Quaterniond(1 / length, v.x() / length, v.y() / length, v.z() / length).toRotationMatrix();
  return pose;
}

void print_functions() {
  std::vector<double> uniform, logarithm, sine, normal;
  for (std::uint64_t i = 1; i < 20000; ++i) {
    const double x = random_uniform(7, i);
    uniform.push_back(x);
    logarithm.push_back(std::log(x));
    sine.push_back(std::sin(10 * x));
    normal.push_back(random_normal(7, i));
  }
  print("uniform random numbers", uniform);
  print("logarithms (libm)", logarithm);
  print("sines (libm)", sine);
  print("normal random numbers", normal);
}

void print_cloud_stages(const Camera& camera) {
  const DepthImage depth = step_and_curve(camera);
  print("depth image", depth);
  const NoiseModel noise = estimate_noise(depth, camera);
  print("noise", std::vector<double>{noise.sigma(0.8), noise.sigma(1.6)});
  print("cleaned depth", preprocess_depth(depth, camera));
  print("normals of an image", depth_normals(depth, camera));

  const Points points = back_project(depth, camera);
  print("points", points);
  const KdTree tree(points);
  print("distances to neighbours", tree.query(points, 12).distances);
  print("normals of a cloud", estimate_normals(points));

  Pose motion = turned({1, 2, 3}, 0.01);
  motion.translation() = Eigen::Vector3d(0.004, -0.003, 0.002);
  const Points moved =
      (points * motion.linear().cast<float>().transpose()).rowwise() + motion.translation().cast<float>().transpose();
  print("registration", align(AlignCloud(points), AlignCloud(moved)).target_from_source.matrix());

  ConsolidateOptions options;
  options.radius = 0.03;
  options.num_points = 1000;
  print("consolidated points", consolidate(points, options).points);
}

void print_model(const Camera& camera) {
  const Mesh mesh = built_in_object();
  print("object (libm)", mesh.vertices);
  const MeshTree tree(mesh.vertices, mesh.triangles);
  Model model(camera);
  DepthImage depth;
  for (int frame = 0; frame < 6; ++frame) {
    Pose pose = turned({0, 0, 1}, 0.03 * frame) * turned({1, 0, 0}, -1.0);
    pose.translation() = pose.linear() * Eigen::Vector3d(0, 0, -3 * tree.upper().z()) + tree.upper() * 0.3;
    SimulationOptions simulation;
    simulation.noise.constant = 0.0003;
    simulation.seed = static_cast<std::uint64_t>(frame);
    depth = simulate_depth(tree, camera, pose, simulation);
    model.add_frame(depth);
  }
  print("simulated depth", depth);
  print("model of six frames", model.cloud().points);
  print("last pose", model.frames().back().world_from_camera.matrix());
  std::printf("points %lld, last frame %s\n", static_cast<long long>(model.cloud().size()),
              to_string(model.frames().back().status));
}

}  // namespace

int main() {
  const Camera camera = Camera::pinhole(160, 120, 150, 150, 79.5, 59.5);
  print_functions();
  print_cloud_stages(camera);
  print_model(camera);
}
