// Single kernels through the public headers, for those who change them:
//   cmake --preset default -DNACRE_BUILD_BENCHMARKS=ON && cmake --build --preset default --target benchmark_kernels
//   build/default/benchmarks/cpp/benchmark_kernels --benchmark_filter=KdTree
// Arguments are the number of points, where there is one, and the number of threads.
#include <benchmark/benchmark.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include "nacre/consolidation.hpp"
#include "nacre/depth.hpp"
#include "nacre/fusion.hpp"
#include "nacre/kdtree.hpp"
#include "nacre/model.hpp"
#include "nacre/normals.hpp"
#include "nacre/registration.hpp"

namespace {

using benchmark::State;

float bump(const Eigen::Vector3f& d) {
  return std::sin(7 * d.x() + 1) * std::cos(6 * d.y()) + std::sin(5 * d.z() + 2 * d.x());
}

// Noisy points of a bumpy closed surface of 0.15 m, in random order.
nacre::Points cloud(std::int64_t size, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<float> normal;
  nacre::Points points(size, 3);
  for (Eigen::Index i = 0; i < size; ++i) {
    Eigen::Vector3f direction(normal(generator), normal(generator), normal(generator));
    direction.normalize();
    const Eigen::Vector3f noise(normal(generator), normal(generator), normal(generator));
    points.row(i) = 0.075F * (1 + 0.04F * bump(direction)) * direction + 0.0005F * noise;
  }
  return points;
}

nacre::Camera camera() { return nacre::Camera::pinhole(640, 480, 525, 525, 319.5, 239.5); }

// A bumpy wall 0.6 m away, sigma 0.5 mm, seen from (x, 0, 0).
nacre::DepthImage depth(float x) {
  std::mt19937 generator(1);
  std::normal_distribution<float> noise(0.0F, 0.0005F);
  nacre::DepthImage image(480, 640);
  for (int v = 0; v < 480; ++v) {
    for (int u = 0; u < 640; ++u) {
      float z = 0.6F;
      for (int step = 0; step < 8; ++step) {  // along the ray, to where it meets the wall
        const Eigen::Vector3f at((static_cast<float>(u) - 319.5F) / 525 * z + x,
                                 (static_cast<float>(v) - 239.5F) / 525 * z, 0.6F);
        z = 0.6F + 0.02F * bump(4 * at);
      }
      image(v, u) = z + noise(generator);
    }
  }
  return image;
}

const nacre::NoiseModel sigma{0.0005, 0.0, 0.0};

void KdTree_build(State& state) {
  const nacre::Points points = cloud(state.range(0), 1);
  for (auto _ : state) benchmark::DoNotOptimize(nacre::KdTree(points, static_cast<int>(state.range(1))));
  state.SetItemsProcessed(state.iterations() * state.range(0));
}

// k neighbours of each point of the tree's own cloud, or of another.
void KdTree_query(State& state, int k, bool other) {
  const nacre::Points points = cloud(state.range(0), 1);
  const nacre::Points queries = other ? cloud(state.range(0), 2) : points;
  const nacre::KdTree tree(points);
  for (auto _ : state) {
    benchmark::DoNotOptimize(tree.query(queries, k, nacre::KdTree::infinity, static_cast<int>(state.range(1))));
  }
  state.SetItemsProcessed(state.iterations() * state.range(0));
}

void KdTree_nearest(State& state) {
  const nacre::Points points = cloud(state.range(0), 1);
  const nacre::KdTree tree(points);
  std::int64_t index = 0;
  double squared_distance = 0;
  Eigen::Index i = 0;
  for (auto _ : state) {
    const Eigen::Vector3d query = points.row(i).cast<double>().transpose();
    benchmark::DoNotOptimize(tree.nearest(query, 1, nacre::KdTree::infinity, &index, &squared_distance));
    i = (i + 1) % points.rows();
  }
}

void estimate_normals(State& state) {
  const nacre::Points points = cloud(state.range(0), 1);
  nacre::NormalOptions options;
  options.num_threads = static_cast<int>(state.range(1));
  for (auto _ : state) benchmark::DoNotOptimize(nacre::estimate_normals(points, options));
  state.SetItemsProcessed(state.iterations() * state.range(0));
}

void align(State& state) {
  const nacre::Pose moved(Eigen::Translation3d(0.004, -0.004, 0.005) *
                          Eigen::AngleAxisd(0.17, Eigen::Vector3d(1, 2, 3).normalized()));
  const nacre::Points target = cloud(state.range(0), 1);
  const nacre::Points source =
      ((cloud(state.range(0), 2).cast<double>().rowwise() - moved.translation().transpose()) * moved.linear())
          .cast<float>();
  nacre::AlignOptions options;
  options.num_threads = static_cast<int>(state.range(1));
  for (auto _ : state) {
    benchmark::DoNotOptimize(nacre::align(nacre::AlignCloud(source), nacre::AlignCloud(target), {}, options));
  }
}

void consolidate(State& state, nacre::ConsolidationMethod method) {
  const nacre::Points points = cloud(state.range(0), 1);
  nacre::ConsolidateOptions options;
  options.method = method;
  options.num_points = static_cast<int>(state.range(0) / 2);
  options.radius = std::sqrt(30 * 0.0725 / (3.1416 * static_cast<double>(state.range(0))));  // 30 neighbours
  options.num_threads = static_cast<int>(state.range(1));
  for (auto _ : state) benchmark::DoNotOptimize(nacre::consolidate(points, options));
  state.SetItemsProcessed(state.iterations() * options.num_points * options.iterations);
}

void preprocess_depth(State& state) {
  const nacre::DepthImage image = depth(0.0F);
  nacre::DepthOptions options;
  options.noise = sigma;
  for (auto _ : state) {
    benchmark::DoNotOptimize(nacre::preprocess_depth(image, camera(), options, nacre::MaskImage(), nullptr,
                                                     static_cast<int>(state.range(0))));
  }
}

void make_frame(State& state) {
  const nacre::DepthImage image = depth(0.0F);
  const nacre::Camera view = camera();
  for (auto _ : state) {
    benchmark::DoNotOptimize(nacre::make_frame(image, view, sigma, static_cast<int>(state.range(0))));
  }
}

// A second frame into the model of the first.
void fuse(State& state) {
  const nacre::Camera view = camera();
  const int threads = static_cast<int>(state.range(0));
  nacre::PointModel first;
  nacre::fuse(first, nacre::make_frame(depth(0.0F), view, sigma), view, nacre::Pose::Identity(), 0.0023, 0);
  const nacre::Frame frame = nacre::make_frame(depth(0.02F), view, sigma);
  const nacre::Pose pose(Eigen::Translation3d(0.02, 0, 0));
  for (auto _ : state) {
    state.PauseTiming();
    nacre::PointModel model = first;
    state.ResumeTiming();
    nacre::fuse(model, frame, view, pose, 0.0023, 1, {}, nacre::Colors(), threads);
    benchmark::DoNotOptimize(model);
  }
}

void add_frame(State& state) {
  nacre::ModelOptions options;
  options.num_threads = static_cast<int>(state.range(0));
  nacre::Model model(camera(), options);
  const nacre::DepthImage frames[] = {depth(0.0F), depth(0.01F)};
  model.add_frame(frames[0]);
  std::size_t turn = 0;
  for (auto _ : state) benchmark::DoNotOptimize(model.add_frame(frames[++turn % 2]));
}

void sizes(benchmark::internal::Benchmark* kernel) {
  kernel->ArgsProduct({{10000, 100000, 1000000}, {1, 2}})->Unit(benchmark::kMillisecond)->UseRealTime();
}

void cloud_of_100k(benchmark::internal::Benchmark* kernel) {
  kernel->ArgsProduct({{100000}, {1, 2}})->Unit(benchmark::kMillisecond)->UseRealTime();
}

void threads(benchmark::internal::Benchmark* kernel) {
  kernel->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();
}

BENCHMARK(KdTree_build)->Apply(sizes);
BENCHMARK_CAPTURE(KdTree_query, 16_of_itself, 16, false)->Apply(sizes);
BENCHMARK_CAPTURE(KdTree_query, 1_of_another, 1, true)->Apply(sizes);
BENCHMARK(KdTree_nearest)->Arg(10000)->Arg(100000)->Arg(1000000);
BENCHMARK(estimate_normals)->Apply(sizes);
BENCHMARK(align)->Apply(cloud_of_100k);
BENCHMARK_CAPTURE(consolidate, wlop, nacre::ConsolidationMethod::wlop)->Apply(cloud_of_100k);
BENCHMARK_CAPTURE(consolidate, wlop_plus, nacre::ConsolidationMethod::wlop_plus)->Apply(cloud_of_100k);
BENCHMARK_CAPTURE(consolidate, cgal, nacre::ConsolidationMethod::cgal)->Apply(cloud_of_100k);
BENCHMARK(preprocess_depth)->Apply(threads);
BENCHMARK(make_frame)->Apply(threads);
BENCHMARK(fuse)->Apply(threads);
BENCHMARK(add_frame)->Apply(threads);

}  // namespace
