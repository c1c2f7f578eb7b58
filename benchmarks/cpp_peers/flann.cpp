// FLANN: its exact single k-d tree, from C arrays to C arrays.
#include <chrono>
#include <cstdint>
#include <flann/flann.hpp>

extern "C" const char* version() { return FLANN_VERSION_; }

extern "C" double knn(const float* points, std::int64_t size, const float* queries, std::int64_t num_queries, int k,
                      int threads, float* squared_distances, std::int32_t* indices) {
  const auto start = std::chrono::steady_clock::now();
  const flann::Matrix<float> rows(const_cast<float*>(points), static_cast<std::size_t>(size), 3);
  flann::Index<flann::L2_3D<float>> tree(rows, flann::KDTreeSingleIndexParams(15));
  tree.buildIndex();
  const auto built = std::chrono::steady_clock::now();
  const flann::Matrix<float> asked(const_cast<float*>(queries), static_cast<std::size_t>(num_queries), 3);
  flann::Matrix<float> distances(squared_distances, asked.rows, static_cast<std::size_t>(k));
  flann::Matrix<int> found(indices, asked.rows, static_cast<std::size_t>(k));
  flann::SearchParams parameters(flann::FLANN_CHECKS_UNLIMITED);
  parameters.cores = threads;
  tree.knnSearch(asked, found, distances, static_cast<std::size_t>(k), parameters);
  return std::chrono::duration<double>(built - start).count();
}
