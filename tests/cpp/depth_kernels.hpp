// The kernels of the depth images for every instruction set of this processor, and images for them.
#pragma once

#include <array>
#include <vector>

#include "depth_images.hpp"
#include "simd/depth_edges.hpp"
#include "simd/depth_keep.hpp"
#include "simd/depth_normals.hpp"
#include "simd/depth_points.hpp"
#include "simd/depth_windows.hpp"

namespace nacre_test {

namespace simd = nacre::simd;

struct Kernels {
  const char* name;
  simd::FitNormals* fit_normals;
  simd::MarkEdges* mark_edges;
  simd::MarkGradients* mark_gradients;
  simd::DilateMarks* dilate_marks;
  simd::FitWindows* fit_windows;
  simd::KeepPixels* keep_pixels;
  simd::RemoveIsolated* remove_isolated;
  simd::SelectKept* select_kept;
  simd::LinkPixels* link_pixels;
  simd::FillDepthRow* fill_depth_row;
  simd::FillPlanarRow* fill_planar_row;
  simd::FillPointRow* fill_point_row;
  simd::CountPoints* count_points;
  simd::GatherPoints* gather_points;
};

#define KERNELS_OF(isa)                                                                                           \
  Kernels {                                                                                                       \
    #isa, simd::isa::fit_normals, simd::isa::mark_edges, simd::isa::mark_gradients, simd::isa::dilate_marks,      \
        simd::isa::fit_windows, simd::isa::keep_pixels, simd::isa::remove_isolated, simd::isa::select_kept,       \
        simd::isa::link_pixels, simd::isa::fill_depth_row, simd::isa::fill_planar_row, simd::isa::fill_point_row, \
        simd::isa::count_points, simd::isa::gather_points                                                         \
  }

inline std::vector<Kernels> all_kernels() {
  std::vector<Kernels> kernels = {KERNELS_OF(baseline)};
#ifdef NACRE_SIMD_X86
  if (simd::active_isa() != simd::Isa::baseline) kernels.push_back(KERNELS_OF(avx2));
  if (simd::active_isa() == simd::Isa::avx512) kernels.push_back(KERNELS_OF(avx512));
#endif
  return kernels;
}

#undef KERNELS_OF

inline constexpr std::array<int, 8> widths = {1, 7, 15, 16, 17, 64, 70, 133};
inline constexpr int rows = 40;

inline std::vector<Camera> cameras(int w) {
  return {Camera::pinhole(w, rows, 90.0, 94.0, w / 2.0, 18.0),
          Camera::pinhole(w, rows, 90.0, 94.0, w / 2.0, 18.0, {}, DepthKind::radial),
          Camera::pinhole(w, rows, 90.0, 94.0, w / 2.0, 18.0, lens), Camera::orthographic(w, rows, 0.01)};
}

// A waved surface before another, with noise, outliers, holes and codes for "no measurement".
inline DepthImage scene(int w, double noise, std::uint64_t seed) {
  DepthImage depth(rows, w);
  for (int v = 0; v < rows; ++v) {
    for (int u = 0; u < w; ++u) {
      const auto pixel = static_cast<std::uint64_t>(v * w + u);
      const double near = u > w / 2 && v > 10 ? 0.3 : 0.0;
      double z = 1.4 + 0.1 * std::sin(0.13 * u) * std::cos(0.11 * v) - near + noise * random_normal(seed, pixel);
      const double chance = random_uniform(seed + 1, pixel);
      if (chance < 0.02 || (u > 20 && u < 24 && v > 5 && v < 30)) z = missing;
      if (chance > 0.02 && chance < 0.026) z += chance < 0.023 ? 0.7 : -0.5;
      if (chance > 0.995) z = chance > 0.9975 ? -1.0 : std::numeric_limits<double>::infinity();
      depth(v, u) = static_cast<float>(z);
    }
  }
  return depth;
}

}  // namespace nacre_test
