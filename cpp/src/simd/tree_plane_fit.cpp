// Plain loops over 16 neighbourhoods side by side, which the compiler makes vectors of: C = sum of d d^T - (sum of d)
// (sum of d)^T / k over the steps d to the neighbours, and the eigenvector of its least eigenvalue. About 40 ns for 16
// neighbours.
#include "simd/tree_plane_fit.hpp"

#include <math.h>

#include "simd/vec.hpp"

namespace nacre::simd::NACRE_ISA {
namespace {

constexpr int fits = 16;  // neighbourhoods at once
constexpr int ranks_at_once = 16;

// A neighbourhood is a line where the sum of the products of its variances is below this share of their sum's square:
// about where the second variance is below this share of the first.
constexpr double line_share = 0.005;
// It fills space where the variance along the normal is above this share of the sum of the three (1/3 is isotropic;
// "surface variation", Pauly, Gross and Kobbelt 2002). Among 16 random points of a plane whose noise is half their
// spacing, one neighbourhood in a thousand is above; a limit on the ratio of the two smallest variances that refuses as
// few would let twice as many isotropic neighbourhoods through.
constexpr double space_share = 0.22;

// Sums over a neighbourhood of steps from the point itself, which keep their digits however far the origin is.
struct Sums {
  alignas(64) double x[fits], y[fits], z[fits], xx[fits], xy[fits], xz[fits], yy[fits], yz[fits], zz[fits];
};

template <class T>
NACRE_INLINE void add_steps(const BlockTreeView<T>& tree, const Neighborhoods& in, int first, int end, Sums& sums) {
  // Steps are taken one by one, and added when the last of them are in memory.
  alignas(64) T steps[ranks_at_once][3][fits];
  for (int i = 0; i < fits; ++i) {
    const T x = static_cast<T>(in.p[0][i]), y = static_cast<T>(in.p[1][i]), z = static_cast<T>(in.p[2][i]);
    const uint32_t* const slots = in.slots + static_cast<ptrdiff_t>(i) * in.stride;
    const int last = in.counts[i] < end ? in.counts[i] : end;
    int rank = first;
    for (; rank < last; ++rank) {
      const PointBlock<T>& block = tree.blocks[slots[rank] / block_points];
      const uint32_t lane = slots[rank] % block_points;
      T(*const step)[fits] = steps[rank - first];
      step[0][i] = block.p[0][lane] - x;
      step[1][i] = block.p[1][lane] - y;
      step[2][i] = block.p[2][lane] - z;
    }
    for (; rank < end; ++rank) {
      for (int axis = 0; axis < 3; ++axis) steps[rank - first][axis][i] = 0;
    }
  }
  for (int rank = 0; rank < end - first; ++rank) {
    for (int i = 0; i < fits; ++i) {
      const double x = steps[rank][0][i], y = steps[rank][1][i], z = steps[rank][2][i];
      sums.x[i] += x;
      sums.y[i] += y;
      sums.z[i] += z;
      sums.xx[i] += x * x;
      sums.xy[i] += x * y;
      sums.xz[i] += x * z;
      sums.yy[i] += y * y;
      sums.yz[i] += y * z;
      sums.zz[i] += z * z;
    }
  }
}

// Covariance matrices, divided by their traces, and what the least eigenvalue is computed from.
struct Shapes {
  alignas(64) double xx[fits], xy[fits], xz[fits], yy[fits], yz[fits], zz[fits];
  alignas(64) double minors[fits], determinant[fits], least[fits];
};

NACRE_INLINE void shapes_of(const Sums& s, const int (&counts)[fits], Shapes& out) {
  for (int i = 0; i < fits; ++i) {
    const double share = 1.0 / counts[i];
    const double xx = s.xx[i] - s.x[i] * s.x[i] * share, yy = s.yy[i] - s.y[i] * s.y[i] * share;
    const double zz = s.zz[i] - s.z[i] * s.z[i] * share;
    const double scale = 1.0 / (xx + yy + zz);
    const double a = xx * scale, d = yy * scale, f = zz * scale;
    const double b = (s.xy[i] - s.x[i] * s.y[i] * share) * scale, c = (s.xz[i] - s.x[i] * s.z[i] * share) * scale;
    const double e = (s.yz[i] - s.y[i] * s.z[i] * share) * scale;
    out.xx[i] = a, out.xy[i] = b, out.xz[i] = c, out.yy[i] = d, out.yz[i] = e, out.zz[i] = f;
    const double minor = d * f - e * e;
    out.minors[i] = minor + (a * f - c * c) + (a * d - b * b);
    out.determinant[i] = a * minor + b * (c * e - b * f) + c * (b * e - c * d);
  }
}

// The least variance is the first root of v^3 - v^2 + minors v - determinant; Newton's steps from 0 approach it from
// below, where the cubic has no extremum; towards a double root each halves the distance. A lane that has arrived stays
// where it is, whatever the others do.
NACRE_INLINE void find_least_variances(Shapes& s) {
  alignas(64) double v[fits] = {}, moves[fits];
  for (int i = 0; i < fits; ++i) moves[i] = 1;
  for (int pass = 0; pass < 50; ++pass) {
    for (int i = 0; i < fits; ++i) {
      const double slope = (3 * v[i] - 2) * v[i] + s.minors[i];
      const double step = (((v[i] - 1) * v[i] + s.minors[i]) * v[i] - s.determinant[i]) / slope;
      const double next = v[i] - step;
      v[i] = moves[i] > 0 ? next : v[i];
      moves[i] = fabs(step) >= 1e-15 && next <= space_share ? moves[i] : 0;
    }
    double any = 0;
    for (int i = 0; i < fits; ++i) any = moves[i] > any ? moves[i] : any;
    if (!(any > 0)) break;
  }
  for (int i = 0; i < fits; ++i) s.least[i] = v[i];
}

// c - v I has its eigenvector in its kernel, so that every column of its adjugate is a multiple of it.
NACRE_INLINE void normals_of(const Shapes& s, const int (&counts)[fits], double (&normals)[3][fits]) {
  for (int i = 0; i < fits; ++i) {
    const double a = s.xx[i] - s.least[i], d = s.yy[i] - s.least[i], f = s.zz[i] - s.least[i];
    const double b = s.xy[i], c = s.xz[i], e = s.yz[i];
    const double xx = d * f - e * e, yy = a * f - c * c, zz = a * d - b * b;
    const double xy = c * e - b * f, xz = b * e - c * d, yz = b * c - a * e;
    const bool by_x = xx >= yy && xx >= zz, by_y = yy >= zz;
    const double x = by_x ? xx : by_y ? xy : xz, y = by_x ? xy : by_y ? yy : yz, z = by_x ? xz : by_y ? yz : zz;
    const bool is_plane = counts[i] >= 3 && s.minors[i] > line_share && s.least[i] <= space_share;
    const double scale = is_plane ? 1 / ::sqrt(x * x + y * y + z * z) : static_cast<double>(NAN);
    normals[0][i] = x * scale;
    normals[1][i] = y * scale;
    normals[2][i] = z * scale;
  }
}

template <class T>
void fit_planes(const BlockTreeView<T>& tree, const Neighborhoods& in, double (&normals)[3][fits]) {
  int most = 0;
  for (const int count : in.counts) most = count > most ? count : most;
  Sums sums = {};
  for (int first = 0; first < most; first += ranks_at_once) {
    const int end = first + ranks_at_once;
    add_steps(tree, in, first, end < most ? end : most, sums);
  }
  Shapes shapes;
  shapes_of(sums, in.counts, shapes);
  find_least_variances(shapes);
  normals_of(shapes, in.counts, normals);
}

}  // namespace

void fit_planes_f32(const BlockTreeView<float>& tree, const Neighborhoods& in, double (&normals)[3][16]) {
  fit_planes(tree, in, normals);
}
void fit_planes_f64(const BlockTreeView<double>& tree, const Neighborhoods& in, double (&normals)[3][16]) {
  fit_planes(tree, in, normals);
}

}  // namespace nacre::simd::NACRE_ISA
