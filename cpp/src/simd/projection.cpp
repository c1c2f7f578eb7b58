// One pass over coordinates that lie point after point; the compiler makes vectors of it. About 2 ns a point.
#include "simd/projection.hpp"

#include "simd/vec.hpp"

namespace nacre::simd::NACRE_ISA {
namespace {

template <bool orthographic>
NACRE_INLINE void project(const View& view, const float* __restrict points, const float* __restrict normals, int count,
                          const ProjectedPoints& out) {
  const View c = view;
  float* __restrict x = out.x, * __restrict y = out.y, * __restrict z = out.z;
  float* __restrict nx = out.normal_x, * __restrict ny = out.normal_y, * __restrict nz = out.normal_z;
  float* __restrict u = out.u, * __restrict v = out.v, * __restrict facing = out.facing;
  const float* r = c.rotation;
  for (int i = 0; i < count; ++i) {
    const float px = points[3 * i], py = points[3 * i + 1], pz = points[3 * i + 2];
    const float mx = normals[3 * i], my = normals[3 * i + 1], mz = normals[3 * i + 2];
    x[i] = r[0] * px + r[1] * py + r[2] * pz + c.translation[0];
    y[i] = r[3] * px + r[4] * py + r[5] * pz + c.translation[1];
    z[i] = r[6] * px + r[7] * py + r[8] * pz + c.translation[2];
    nx[i] = r[0] * mx + r[1] * my + r[2] * mz;
    ny[i] = r[3] * mx + r[4] * my + r[5] * mz;
    nz[i] = r[6] * mx + r[7] * my + r[8] * mz;
  }
  for (int i = 0; i < count; ++i) {
    if (orthographic) {
      u[i] = x[i] * c.fx + c.cx;
      v[i] = y[i] * c.fy + c.cy;
      facing[i] = -nz[i];
    } else {
      const float inverse_z = 1.0F / z[i];
      u[i] = x[i] * inverse_z * c.fx + c.cx;
      v[i] = y[i] * inverse_z * c.fy + c.cy;
      facing[i] = -(nx[i] * x[i] + ny[i] * y[i] + nz[i] * z[i]) / ::sqrtf(x[i] * x[i] + y[i] * y[i] + z[i] * z[i]);
    }
  }
}

}  // namespace

void nearest_pixels(const float* __restrict u, const float* __restrict v, int count, int width, int height,
                    int32_t* __restrict pixel, int32_t* __restrict inside) {
  const float right = static_cast<float>(width) - 1.0F, bottom = static_cast<float>(height) - 1.0F;
  for (int i = 0; i < count; ++i) {
    const bool is_inside = (u[i] > -0.5F) & (v[i] > -0.5F) & (u[i] < right + 0.5F) & (v[i] < bottom + 0.5F);
    const float column = u[i] > 0.0F ? (u[i] < right ? u[i] : right) : 0.0F;
    const float row = v[i] > 0.0F ? (v[i] < bottom ? v[i] : bottom) : 0.0F;
    // NOLINTNEXTLINE(bugprone-incorrect-roundings): half-way between two pixels either will do
    const int32_t nearest = static_cast<int32_t>(row + 0.5F) * width + static_cast<int32_t>(column + 0.5F);
    pixel[i] = u[i] == u[i] ? nearest : -1;
    inside[i] = is_inside;
  }
}

void project_points(const View& view, const float* points, const float* normals, int count,
                    const ProjectedPoints& out) {
  view.orthographic ? project<true>(view, points, normals, count, out)
                    : project<false>(view, points, normals, count, out);
}

}  // namespace nacre::simd::NACRE_ISA
