// nanoflann: build, and k nearest neighbours of every query, from C arrays to C arrays.
#include <chrono>
#include <cstdint>
#include <nanoflann.hpp>

namespace {

struct Cloud {
  const float* xyz;
  std::size_t size;
  std::size_t kdtree_get_point_count() const { return size; }
  float kdtree_get_pt(std::size_t i, std::size_t axis) const { return xyz[3 * i + axis]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Cloud>, Cloud, 3, std::uint32_t>;

}  // namespace

extern "C" const char* version() {
  static char text[16];
  std::snprintf(text, sizeof text, "%x.%x.%x", NANOFLANN_VERSION >> 8, (NANOFLANN_VERSION >> 4) & 15,
                NANOFLANN_VERSION & 15);
  return text;
}

extern "C" double knn(const float* points, std::int64_t size, const float* queries, std::int64_t num_queries, int k,
                      int threads, float* squared_distances, std::uint32_t* indices) {
  const auto start = std::chrono::steady_clock::now();
  const Cloud cloud{points, static_cast<std::size_t>(size)};
#if NANOFLANN_VERSION >= 0x150
  const Tree tree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(10, {}, threads));
#else
  const Tree tree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(10));
#endif
  const auto built = std::chrono::steady_clock::now();
#pragma omp parallel for schedule(dynamic, 256) num_threads(threads)
  for (std::int64_t q = 0; q < num_queries; ++q) {
    tree.knnSearch(queries + 3 * q, static_cast<std::size_t>(k), indices + k * q, squared_distances + k * q);
  }
  return std::chrono::duration<double>(built - start).count();
}
