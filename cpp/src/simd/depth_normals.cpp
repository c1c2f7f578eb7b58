// Groups of 16 pixels. Where all their windows are complete, sums over columns and then over rows: about 14 (2 r + 1)
// operations a vector. Else the windows are looked at tap by tap: 7 operations a tap, 25 a row; again, in halves, where
// they are of no plane. Points and all, a 640 x 480 frame with windows of 5 x 5 takes one thread 2 ms with AVX-512, one
// with 11 x 11 and holes everywhere 8 ms.
#include "simd/depth_normals.hpp"

#include "simd/quadratic.hpp"
#include "simd/vec.hpp"

namespace nacre::simd::NACRE_ISA {
namespace {

constexpr int group = 16;  // pixels that go the same way, whatever the number of lanes
constexpr int parts = group / lanes;

constexpr float largest_plane_misfit = 2.0F;  // of a plane: squared residuals per degree of freedom, in variances

constexpr float full_window(int radius) { return static_cast<float>((2 * radius + 1) * (2 * radius + 1)); }
// Sum of du^2 over a full window.
constexpr float full_spread(int radius) {
  return static_cast<float>((2 * radius + 1) * (2 * radius + 1) * radius * (radius + 1)) / 3.0F;
}

struct Pixels {
  F32 value, gate_base, gate_slope, variance;
};

// Sums over the members of each pixel's window: du and dv from the pixel, w the value minus the pixel's own.
struct Moments {
  F32 n, u, v, uu, uv, vv, w, uw, vw, ww;
};

NACRE_INLINE Moments operator+(const Moments& a, const Moments& b) {
  return {a.n + b.n,   a.u + b.u, a.v + b.v,   a.uu + b.uu, a.uv + b.uv,
          a.vv + b.vv, a.w + b.w, a.uw + b.uw, a.vw + b.vw, a.ww + b.ww};
}
NACRE_INLINE Moments operator-(const Moments& a, const Moments& b) {
  return {a.n - b.n,   a.u - b.u, a.v - b.v,   a.uu - b.uu, a.uv - b.uv,
          a.vv - b.vv, a.w - b.w, a.uw - b.uw, a.vw - b.vw, a.ww - b.ww};
}

// The sums over the members in one row of the windows. Three counts are packed in one integer:
// n + 2^8 sum (du + radius) + 2^16 sum du^2.
struct RowSums {
  I32 counts;
  F32 w, ww;
};

template <int radius, int du, int last>
NACRE_INLINE void add_taps(const float* row, F32 own, const F32 (&limits)[radius + 1], RowSums& sums,
                           F32 (&odd_w)[radius]) {
  constexpr int distance = du < 0 ? -du : du;
  const F32 difference = load(row + du) - own;
  // False where either is missing (NaN).
  const Mask member = abs(difference) <= limits[distance];
  sums.counts = add_where(member, sums.counts, broadcast(1 + (du + radius) * (1 << 8) + du * du * (1 << 16)));
  sums.w = add_where(member, sums.w, difference);
  sums.ww = add_where(member, sums.ww, difference * difference);
  if constexpr (du < 0) odd_w[distance - 1] = sub_where(member, odd_w[distance - 1], difference);
  if constexpr (du > 0) odd_w[distance - 1] = add_where(member, odd_w[distance - 1], difference);
  if constexpr (du < last) add_taps<radius, du + 1, last>(row, own, limits, sums, odd_w);
}

// Over the columns from left to right and the rows from top to bottom.
template <int radius, int left, int right>
NACRE_INLINE Moments sum_members(const float* pixel, ptrdiff_t stride, const Pixels& p, int top, int bottom) {
  const F32 zero = broadcast(0.0F), shift = broadcast(static_cast<float>(radius));
  const I32 byte = broadcast(255);
  Moments m = {zero, zero, zero, zero, zero, zero, zero, zero, zero, zero};
  F32 odd_w[radius];  // sums of w at du minus w at -du
  for (F32& w : odd_w) w = zero;
  for (int dv = top; dv <= bottom; ++dv) {
    F32 limits[radius + 1];
    for (int du = 0; du <= radius; ++du) {
      const int distance = dv < 0 ? (-dv > du ? -dv : du) : (dv > du ? dv : du);
      limits[du] = p.gate_base + broadcast(static_cast<float>(distance)) * p.gate_slope;
    }
    RowSums row = {broadcast(0), zero, zero};
    add_taps<radius, left, right>(pixel + dv * stride, p.value, limits, row, odd_w);
    const F32 n = to_float(row.counts & byte), v = broadcast(static_cast<float>(dv));
    const F32 u = to_float(shift_right<8>(row.counts) & byte) - shift * n;
    m.n += n;
    m.u += u;
    m.v += v * n;
    m.uu += to_float(shift_right<16>(row.counts));
    m.uv += v * u;
    m.vv += v * v * n;
    m.w += row.w;
    m.ww += row.ww;
    m.vw += v * row.w;
  }
  for (int du = 1; du <= radius; ++du) m.uw += broadcast(static_cast<float>(du)) * odd_w[du - 1];
  return m;
}

// value = own + w + du at_u + dv at_v; NaN where there is no plane. Squared residuals per degree of freedom.
struct Planes {
  F32 w, at_u, at_v, misfit;
};

// The normal equations times the number of members, so that the matrix is of integers.
NACRE_INLINE Planes fit(const Moments& m, float min_count, float min_determinant) {
  const F32 uu = m.n * m.uu - m.u * m.u, uv = m.n * m.uv - m.u * m.v, vv = m.n * m.vv - m.v * m.v;
  const F32 uw = m.n * m.uw - m.u * m.w, vw = m.n * m.vw - m.v * m.w;
  const F32 determinant = uu * vv - uv * uv;
  const Mask found = (m.n >= broadcast(min_count)) & (determinant >= broadcast(min_determinant) * (m.n * m.n));
  const F32 inverse = broadcast(1.0F) / (determinant * m.n), scale = inverse * m.n;
  const F32 at_u = select(found, (vv * uw - uv * vw) * scale, broadcast(NAN)), at_v = (uu * vw - uv * uw) * scale;
  const F32 misfit = (m.n * m.ww - m.w * m.w - at_u * uw - at_v * vw) / (m.n * (m.n - broadcast(3.0F)));
  return {(m.w - m.u * at_u - m.v * at_v) * (inverse * determinant), at_u, at_v, misfit};
}

// Sums over the columns of the windows of a group, of the values about an origin; their least and largest.
template <int radius>
struct ColumnSums {
  static constexpr int columns = (group + 2 * radius + lanes - 1) / lanes * lanes;
  float w[columns], vw[columns], ww[columns], least[columns], most[columns];
};

template <int radius>
NACRE_INLINE void sum_columns(const float* pixel, ptrdiff_t stride, ColumnSums<radius>& sums) {
  const F32 origin = broadcast(pixel[group / 2]);
  for (int i = 0; i < ColumnSums<radius>::columns; i += lanes) {
    const float* const column = pixel - radius + i;
    const F32 centre = load(column) - origin;
    F32 w = centre, vw = broadcast(0.0F), ww = centre * centre, least = centre, most = centre;
    for (int dv = 1; dv <= radius; ++dv) {
      const F32 above = load(column - dv * stride) - origin, below = load(column + dv * stride) - origin;
      w += above + below;
      ww += above * above + below * below;
      vw += broadcast(static_cast<float>(dv)) * (below - above);
      least = min(least, min(above, below));
      most = max(most, max(above, below));
    }
    store(sums.w + i, w);
    store(sums.vw + i, vw);
    store(sums.ww + i, ww);
    store(sums.least + i, least);
    store(sums.most + i, most);
  }
}

struct Group {
  Pixels pixels[parts];
  F32 radius[parts];  // NaN where there is no measurement
  Planes planes[parts];
};

template <int radius>
NACRE_INLINE Mask has_radius(const Group& g, int part) {
  return g.radius[part] == broadcast(static_cast<float>(radius));
}

template <int radius>
NACRE_INLINE bool is_wanted(const Group& g) {
  for (int part = 0; part < parts; ++part) {
    if (any(has_radius<radius>(g, part))) return true;
  }
  return false;
}

// Whether the corners of the windows are members: most windows that are not complete lack one.
template <int radius>
NACRE_INLINE bool may_be_complete(const float* pixel, ptrdiff_t stride, const Group& g) {
  for (int part = 0; part < parts; ++part) {
    const Pixels& p = g.pixels[part];
    const F32 gate = p.gate_base + p.gate_slope;
    const auto is_member = [&](ptrdiff_t offset) { return abs(load(pixel + part * lanes + offset) - p.value) <= gate; };
    const ptrdiff_t down = radius * stride;
    const Mask members =
        is_member(-down - radius) & is_member(-down + radius) & is_member(down - radius) & is_member(down + radius);
    if (any(has_radius<radius>(g, part) & (!members))) return false;
  }
  return true;
}

// The planes of complete windows. False where one of the pixels with this radius has a window that is not: a member is
// missing, or might differ too much, or the plane is no plane; or where the origin lies too far off for exact sums.
template <int radius>
NACRE_INLINE bool fit_complete(const ColumnSums<radius>& columns, float group_origin, const Group& g,
                               Planes (&planes)[parts]) {
  constexpr float far_gates = 4.0F;
  const F32 origin = broadcast(group_origin);
  const F32 per_pixel = broadcast(1.0F / full_window(radius)), per_spread = broadcast(1.0F / full_spread(radius));
  for (int part = 0; part < parts; ++part) {
    const int middle = part * lanes + radius;
    const F32 own = g.pixels[part].value - origin, gate = g.pixels[part].gate_base + g.pixels[part].gate_slope;
    F32 w = load(columns.w + middle), uw = broadcast(0.0F), vw = load(columns.vw + middle);
    F32 ww = load(columns.ww + middle);
    F32 least = load(columns.least + middle), most = load(columns.most + middle);
    for (int du = 1; du <= radius; ++du) {
      const F32 left = load(columns.w + middle - du), right = load(columns.w + middle + du);
      w += left + right;
      ww += load(columns.ww + middle - du) + load(columns.ww + middle + du);
      uw += broadcast(static_cast<float>(du)) * (right - left);
      vw += load(columns.vw + middle - du) + load(columns.vw + middle + du);
      least = min(least, min(load(columns.least + middle - du), load(columns.least + middle + du)));
      most = max(most, max(load(columns.most + middle - du), load(columns.most + middle + du)));
    }
    // The sum is NaN where a member is missing.
    const Mask complete =
        (w == w) & (most - own <= gate) & (own - least <= gate) & (abs(own) <= gate * broadcast(far_gates));
    const F32 at_u = uw * per_spread, at_v = vw * per_spread;
    const F32 misfit =
        (ww - w * w * per_pixel - uw * at_u - vw * at_v) * broadcast(1.0F / (full_window(radius) - 3.0F));
    const Mask is_plane = misfit <= broadcast(largest_plane_misfit) * g.pixels[part].variance;
    if (any(has_radius<radius>(g, part) & (!(complete & is_plane)))) return false;
    planes[part] = {w * per_pixel - own, at_u, at_v, misfit};
  }
  return true;
}

NACRE_INLINE Planes chosen(Mask here, const Planes& a, const Planes& b) {
  return {select(here, a.w, b.w), select(here, a.at_u, b.at_u), select(here, a.at_v, b.at_v),
          select(here, a.misfit, b.misfit)};
}

// Where the members are of no plane, there may be a step among them: then those to one side of the pixel are better.
template <int radius>
NACRE_INLINE Planes fit_members(const float* pixel, ptrdiff_t stride, const Group& g, int part,
                                const NormalRule& rule) {
  constexpr float spread = full_spread(radius);
  const Pixels& p = g.pixels[part];
  const auto fitted = [&](const Moments& m) {
    return fit(m, rule.min_filled * full_window(radius), rule.min_spread * spread * spread);
  };
  const Moments above = sum_members<radius, -radius, radius>(pixel, stride, p, -radius, -1);
  const Moments level = sum_members<radius, -radius, radius>(pixel, stride, p, 0, 0);
  const Moments below = sum_members<radius, -radius, radius>(pixel, stride, p, 1, radius);
  const Moments all = above + level + below;
  Planes best = fitted(all);
  const Mask is_rough = has_radius<radius>(g, part) & (best.misfit > broadcast(largest_plane_misfit) * p.variance);
  if (!any(is_rough)) return best;
  const Moments left = sum_members<radius, -radius, -1>(pixel, stride, p, -radius, radius);
  const Moments column = sum_members<radius, 0, 0>(pixel, stride, p, -radius, radius);
  const Planes sides[] = {fitted(left + column), fitted(all - left), fitted(above + level), fitted(level + below)};
  for (const Planes& side : sides) {
    const Mask is_plane = side.misfit <= broadcast(largest_plane_misfit) * p.variance;
    best = chosen(is_rough & (side.at_u == side.at_u) & is_plane & (side.misfit < best.misfit), side, best);
  }
  return best;
}

template <int radius>
NACRE_INLINE void fit_windows_of(const PlanarRow& row, const NormalRule& rule, int begin, Group* groups,
                                 int num_groups) {
  ColumnSums<radius> columns[chunk / group];
  bool wanted[chunk / group], complete[chunk / group];
  for (int k = 0; k < num_groups; ++k) {
    const float* const pixel = row.values + begin + k * group;
    wanted[k] = is_wanted<radius>(groups[k]);
    complete[k] = wanted[k] && may_be_complete<radius>(pixel, row.stride, groups[k]);
    if (complete[k]) sum_columns<radius>(pixel, row.stride, columns[k]);
  }
  for (int k = 0; k < num_groups; ++k) {
    if (!wanted[k]) continue;
    Group& g = groups[k];
    const float* const pixel = row.values + begin + k * group;
    Planes planes[parts];
    if (!complete[k] || !fit_complete<radius>(columns[k], pixel[group / 2], g, planes)) {
      for (int part = 0; part < parts; ++part) {
        planes[part] = fit_members<radius>(pixel + part * lanes, row.stride, g, part, rule);
      }
    }
    for (int part = 0; part < parts; ++part) {
      const Mask here = has_radius<radius>(g, part);
      Planes& kept = g.planes[part];
      kept = chosen(here, planes[part], kept);
    }
  }
}

// The radius that each pixel needs: the slope of a fit over a full window has the standard deviation
// sigma / unit_slope / sqrt(full_spread). NaN where there is no measurement.
NACRE_INLINE F32 window_radius(const NormalRule& rule, F32 value) {
  const F32 sigma = evaluate(rule.sigma, value);
  const F32 slope = broadcast(rule.slope_sigma) * evaluate(rule.unit_slope, value);
  F32 radius = broadcast(static_cast<float>(least_normal_window)) + (value - value);
  for (int r = least_normal_window; r < largest_normal_window; ++r) {
    radius = select(sigma > slope * broadcast(::sqrtf(full_spread(r))), broadcast(static_cast<float>(r + 1)), radius);
  }
  return select(value == value, radius, value);
}

// [m]: points beyond have no normal, since squares of their inverse depth are no longer floats.
constexpr float farthest_point = 1e18F;

struct Normals {
  F32 x, y, z;
};

NACRE_INLINE Normals scaled(F32 x, F32 y, F32 z, float length) {
  const F32 scale = broadcast(length) * inverse_sqrt(x * x + (y * y + z * z));
  return {x * scale, y * scale, z * scale};
}

NACRE_INLINE Normals normals_of(const Planes& planes, F32 value, const NormalRule& rule, const RayRow& rays, int u,
                                bool is_inverse) {
  F32 a = planes.at_u * broadcast(rule.fx), b = planes.at_v * broadcast(rule.fy);
  if (!is_inverse) {
    return scaled(select(abs(value) < broadcast(farthest_point), a, broadcast(NAN)), b, broadcast(-1.0F), 1.0F);
  }
  if (rays.pixel_from_ray[0] != nullptr) {
    a = load(rays.pixel_from_ray[0] + u) * planes.at_u + load(rays.pixel_from_ray[2] + u) * planes.at_v;
    b = load(rays.pixel_from_ray[1] + u) * planes.at_u + load(rays.pixel_from_ray[3] + u) * planes.at_v;
  }
  F32 x = load(rays.x + u), y = broadcast(rays.row_y);
  if (rays.y != nullptr) {  // else z is 1
    const F32 z = load(rays.z + u);
    x = x / z;
    y = load(rays.y + u) / z;
  }
  const F32 farthest = broadcast(farthest_point) * value;
  const Mask is_point = (abs(x) < farthest) & (abs(y) < farthest) & (broadcast(1.0F) < farthest);
  return scaled(a, b, select(is_point, value, broadcast(NAN)) + planes.w - (a * x + b * y), -1.0F);
}

// The pixels that are set, of `count`; returns how many.
NACRE_INLINE int list_pixels(Mask set, int first, int count, int32_t* list) {
  unsigned left = bits(set & first_lanes(count));
  int number = 0;
  if (left == (1U << lanes) - 1U) {
    for (; number < lanes; ++number) list[number] = first + number;
  }
  for (int i = 0; number < lanes && left != 0; ++i, left >>= 1U) {
    if ((left & 1U) != 0) list[number++] = first + i;
  }
  return number;
}

}  // namespace

int fit_normals(const PlanarRow& row, const NormalRule& rule, const RayRow& rays, float* normals, int32_t first,
                int32_t* valid) {
  const F32 missing = broadcast(NAN);
  int num_valid = 0;
  for (int begin = 0; begin < row.width; begin += chunk) {
    const int count = row.width - begin < chunk ? row.width - begin : chunk;
    const int num_groups = (count + group - 1) / group;
    Group groups[chunk / group];
    for (int k = 0; k < num_groups; ++k) {
      for (int part = 0; part < parts; ++part) {
        const F32 value = load(row.values + begin + k * group + part * lanes);
        const F32 sigma = evaluate(rule.sigma, value);
        groups[k].pixels[part] = {value, evaluate(rule.gate_base, value), evaluate(rule.gate_slope, value),
                                  sigma * sigma};
        groups[k].radius[part] = window_radius(rule, value);
        groups[k].planes[part] = {missing, missing, missing, missing};
      }
    }
    fit_windows_of<2>(row, rule, begin, groups, num_groups);
    fit_windows_of<3>(row, rule, begin, groups, num_groups);
    fit_windows_of<4>(row, rule, begin, groups, num_groups);
    fit_windows_of<5>(row, rule, begin, groups, num_groups);
    for (int i = 0; i < count; i += lanes) {
      const Group& g = groups[i / group];
      const int part = i % group / lanes, u = begin + i, left = count - i;
      Normals n = normals_of(g.planes[part], g.pixels[part].value, rule, rays, u, row.is_inverse);
      // Values whose squares are no floats have no normal.
      const F32 squared_length = n.x * n.x + (n.y * n.y + n.z * n.z);
      const Mask found = (squared_length > broadcast(0.99F)) & (squared_length < broadcast(1.01F));
      n = {select(found, n.x, missing), select(found, n.y, missing), select(found, n.z, missing)};
      if (left >= lanes) {
        store_interleaved(normals + 3 * u, n.x, n.y, n.z);
      } else {
        float last[3 * lanes];
        store_interleaved(last, n.x, n.y, n.z);
        memcpy(normals + 3 * u, last, sizeof(float) * 3 * static_cast<size_t>(left));
      }
      if (valid != nullptr) num_valid += list_pixels(found, first + u, left, valid + num_valid);
    }
  }
  return num_valid;
}

}  // namespace nacre::simd::NACRE_ISA
