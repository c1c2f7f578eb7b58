// Two rows of a window of eight pixels are a vector of 16 lanes, or one row of a wider one, or the part of it that the
// window fills; sums are kept lane by lane, so that every instruction set gives the same bits. About 45 operations a
// vector.
#include "simd/fusion_window.hpp"

#include "simd/vec.hpp"

namespace nacre::simd::NACRE_ISA {
namespace {

constexpr int parts = 16 / lanes;

struct Point {
  F32 x, y, z, normal_x, normal_y, normal_z, ray_x, ray_y, ray_z;
  F32 squared_radius, inverse_squared_radius, largest_offset, least_cosine;
};

struct Cover {
  F32 squared_spacing, largest_offset, least_cosine;
};

template <bool with_colors>
struct Sums {
  F32 weight[parts], offset[parts], normal_x[parts], normal_y[parts], normal_z[parts];
  F32 red[with_colors ? parts : 1], green[with_colors ? parts : 1], blue[with_colors ? parts : 1];
};

// Pixels of a window, a lane each: of one row,
struct OneRow {
  int64_t start;
  Mask in_window;

  NACRE_INLINE F32 operator()(const float* plane) const { return load(plane + start); }
  NACRE_INLINE Mask within(Mask pixels) const { return pixels & in_window; }
};

// or part of two rows of eight.
struct TwoRows {
  int64_t start, stride;
  int part;

  NACRE_INLINE F32 operator()(const float* plane) const { return load_halves(plane + start, stride, part); }
  NACRE_INLINE Mask within(Mask pixels) const { return pixels; }
};

// Returns which pixels show the point's own surface.
template <bool with_colors, class Pixels>
NACRE_INLINE Mask add_pixels(const SurfaceImage& image, const Pixels& of, const Point& p, const Cover& cover, int part,
                             Sums<with_colors>& sums) {
  const F32 dx = of(image.x) - p.x, dy = of(image.y) - p.y, dz = of(image.z) - p.z;
  const F32 nx = of(image.normal_x), ny = of(image.normal_y), nz = of(image.normal_z);
  const F32 pixel_weight = of(image.weight);

  const F32 along = dx * p.normal_x + dy * p.normal_y + dz * p.normal_z;
  // Where the pixel's ray meets the tangent plane, from the point: the pixel's own noise has no part in its weight.
  const F32 across_x = dx - along * p.ray_x, across_y = dy - along * p.ray_y, across_z = dz - along * p.ray_z;
  const F32 squared_across = across_x * across_x + across_y * across_y + across_z * across_z;
  const F32 cosine = nx * p.normal_x + ny * p.normal_y + nz * p.normal_z;
  const F32 offset = abs(along);
  const Mask measured = of.within(pixel_weight > broadcast(0.0F));
  const Mask counts =
      measured & (squared_across < p.squared_radius) & (offset < p.largest_offset) & (cosine > p.least_cosine);

  const F32 falloff = broadcast(1.0F) - squared_across * p.inverse_squared_radius;
  const F32 w = select(counts, pixel_weight * falloff * falloff, broadcast(0.0F));
  sums.weight[part] += w;
  sums.offset[part] += w * (along + (nx * dx + ny * dy + nz * dz));
  sums.normal_x[part] += w * nx;
  sums.normal_y[part] += w * ny;
  sums.normal_z[part] += w * nz;
  if constexpr (with_colors) {
    sums.red[part] += w * of(image.red);
    sums.green[part] += w * of(image.green);
    sums.blue[part] += w * of(image.blue);
  }
  return measured & (squared_across < cover.squared_spacing) & (offset < cover.largest_offset) &
         (cosine > cover.least_cosine);
}

template <bool with_colors>
void observe(const SurfaceImage& image, const WindowQueries& queries, float least_cosine, const WindowSums& out,
             const WindowCover* asked) {
  for (int i = 0; i < queries.count; ++i) {
    const float squared_radius = queries.radius[i] * queries.radius[i];
    const Point p = {
        broadcast(queries.x[i]),        broadcast(queries.y[i]),          broadcast(queries.z[i]),
        broadcast(queries.normal_x[i]), broadcast(queries.normal_y[i]),   broadcast(queries.normal_z[i]),
        broadcast(queries.ray_x[i]),    broadcast(queries.ray_y[i]),      broadcast(queries.ray_z[i]),
        broadcast(squared_radius),      broadcast(1.0F / squared_radius), broadcast(queries.largest_offset[i]),
        broadcast(least_cosine)};
    const Cover cover = {broadcast(asked ? asked->spacing[i] * asked->spacing[i] : 0.0F),
                         broadcast(asked ? asked->largest_offset[i] : 0.0F),
                         broadcast(asked ? asked->least_cosine : 0.0F)};
    Sums<with_colors> sums;
    memset(static_cast<void*>(&sums), 0, sizeof sums);
    const int width = 2 * queries.window[i];
    const int64_t first = queries.first_v[i] * image.stride + queries.first_u[i];
    uint16_t* const rows = asked ? asked->rows + 2 * largest_window * i : nullptr;
    if (width == 2 * paired_window) {
      for (int row = 0; row < width; row += 2) {
        unsigned covered = 0;
        for (int part = 0; part < parts; ++part) {
          const TwoRows pixels = {first + row * image.stride, image.stride, part};
          covered |= bits(add_pixels(image, pixels, p, cover, part, sums)) << (part * lanes);
        }
        if (asked) {
          rows[row] = static_cast<uint16_t>(covered & 255U);
          rows[row + 1] = static_cast<uint16_t>(covered >> 8U);
        }
      }
    } else {
      for (int row = 0; row < width; ++row) {
        unsigned covered = 0;
        for (int part = 0; part < parts && part * lanes < width; ++part) {
          const OneRow pixels = {first + row * image.stride + part * lanes, first_lanes(width - part * lanes)};
          covered |= bits(add_pixels(image, pixels, p, cover, part, sums)) << (part * lanes);
        }
        if (asked) rows[row] = static_cast<uint16_t>(covered);
      }
    }
    const float weight = sum_lanes(sums.weight);
    const float scale = weight > 0.0F ? 1.0F / weight : 0.0F;
    out.weight[i] = weight;
    out.offset[i] = 0.5F * sum_lanes(sums.offset) * scale;
    out.normal_x[i] = sum_lanes(sums.normal_x);
    out.normal_y[i] = sum_lanes(sums.normal_y);
    out.normal_z[i] = sum_lanes(sums.normal_z);
    if constexpr (with_colors) {
      out.red[i] = sum_lanes(sums.red) * scale;
      out.green[i] = sum_lanes(sums.green) * scale;
      out.blue[i] = sum_lanes(sums.blue) * scale;
    }
  }
}

}  // namespace

void fill_surface_row(const FrameRow& row, float reference_sigma, bool orthographic, const SurfaceRow& out) {
  for (int u = 0; u < row.width; ++u) {
    const float x = row.points[3 * u], y = row.points[3 * u + 1], z = row.points[3 * u + 2];
    const float nx = row.normals[3 * u], ny = row.normals[3 * u + 1], nz = row.normals[3 * u + 2];
    float ratio = reference_sigma / row.sigma[u];
    ratio = ratio < least_sigma_ratio ? least_sigma_ratio : ratio > largest_sigma_ratio ? largest_sigma_ratio : ratio;
    const float facing = orthographic ? -nz : -(nx * x + ny * y + nz * z) / ::sqrtf(x * x + y * y + z * z);
    const float weight = facing > 0.0F ? ratio * ratio : 0.0F;
    const bool counts = weight > 0.0F;  // not where a value is NaN
    out.x[u] = counts ? x : 0.0F;
    out.y[u] = counts ? y : 0.0F;
    out.z[u] = z > 0.0F ? z : 0.0F;
    out.normal_x[u] = counts ? nx : 0.0F;
    out.normal_y[u] = counts ? ny : 0.0F;
    out.normal_z[u] = counts ? nz : 0.0F;
    out.weight[u] = counts ? weight : 0.0F;
  }
}

void summarise_pixels(const SurfaceImage& image, int64_t start, int width, int rows, float* nearest, float* farthest,
                      float* largest_weight) {
  const F32 infinity = broadcast(HUGE_VALF), zero = broadcast(0.0F);
  F32 near = infinity, far = zero - infinity, weight = zero;
  for (int row = 0; row < rows; ++row) {
    for (int u = 0; u < width; u += lanes) {
      const int64_t pixel = start + row * image.stride + u;
      const F32 z = load(image.z + pixel), w = select(first_lanes(width - u), load(image.weight + pixel), zero);
      const Mask counts = w > zero;
      near = min(near, select(counts, z, infinity));
      far = max(far, select(counts, z, zero - infinity));
      weight = max(weight, w);
    }
  }
  float lane[3][lanes];
  store(lane[0], near);
  store(lane[1], far);
  store(lane[2], weight);
  for (int i = 1; i < lanes; ++i) {
    lane[0][0] = lane[0][i] < lane[0][0] ? lane[0][i] : lane[0][0];
    lane[1][0] = lane[1][i] > lane[1][0] ? lane[1][i] : lane[1][0];
    lane[2][0] = lane[2][i] > lane[2][0] ? lane[2][i] : lane[2][0];
  }
  *nearest = lane[0][0];
  *farthest = lane[1][0];
  *largest_weight = lane[2][0];
}

void observe_windows(const SurfaceImage& image, const WindowQueries& queries, float least_cosine,
                     const WindowSums& sums, const WindowCover* cover) {
  image.red ? observe<true>(image, queries, least_cosine, sums, cover)
            : observe<false>(image, queries, least_cosine, sums, cover);
}

}  // namespace nacre::simd::NACRE_ISA
