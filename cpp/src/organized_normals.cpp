// Points and normals of a depth image: each normal is one linear fit over a window of the planar image.
#include <algorithm>
#include <cmath>
#include <utility>

#include "parallel.hpp"
#include "planar_image.hpp"

namespace nacre {
namespace {

constexpr int kMinRadius = 2, kMaxRadius = 5;
constexpr float kSlopeSigma = 0.07F;  // the window grows until the fitted slope is this certain
constexpr float kMinFilled = 0.4F;    // of the window
constexpr float kMinSpread = 0.02F;   // of the squared spread of a full window, in its two directions together
constexpr float kGateSlope = 5.67F;   // neighbours belong to the surface up to a slant of 80 degrees
constexpr float kGateSigmas = 4.0F;

constexpr int kChunk = 64;  // pixels of a row that are fitted together

// Sums over the members of each pixel's window, du and dv from the pixel, w the value minus the pixel's own.
struct Moments {
  float n[kChunk], u[kChunk], v[kChunk], uu[kChunk], uv[kChunk], vv[kChunk], w[kChunk], uw[kChunk], vw[kChunk];
};

struct Gate {
  float base[kChunk], slope[kChunk];
};

constexpr int full_window(int radius) { return (2 * radius + 1) * (2 * radius + 1); }
// Sum of du^2 over a full window.
constexpr float full_spread(int radius) {
  return static_cast<float>(full_window(radius) * radius * (radius + 1)) / 3.0F;
}

// One row of the windows, at dv; the taps du are unrolled so that the loop over pixels vectorizes.
template <int Radius, int... Tap>
void sum_window_row(const float* row, const float* centre, int dv, int count, const Gate& gate, Moments& m,
                    std::integer_sequence<int, Tap...>) {
  const auto v = static_cast<float>(dv);
  for (int i = 0; i < count; ++i) {
    float n = 0, u = 0, uu = 0, w = 0, uw = 0;
    const float own = centre[i], base = gate.base[i], slope = gate.slope[i];
    const auto add = [&](int du) {
      const float difference = row[i + du] - own;
      const auto distance = static_cast<float>(std::max(std::abs(du), std::abs(dv)));
      // False where either is missing (NaN).
      const bool member = std::abs(difference) <= base + distance * slope;
      const float one = member ? 1.0F : 0.0F, value = member ? difference : 0.0F;
      n += one;
      u += static_cast<float>(du) * one;
      uu += static_cast<float>(du * du) * one;
      w += value;
      uw += static_cast<float>(du) * value;
    };
    (add(Tap - Radius), ...);
    m.n[i] += n;
    m.u[i] += u;
    m.v[i] += v * n;
    m.uu[i] += uu;
    m.uv[i] += v * u;
    m.vv[i] += v * v * n;
    m.w[i] += w;
    m.uw[i] += uw;
    m.vw[i] += v * w;
  }
}

template <int Radius>
void sum_windows(const float* centre, std::ptrdiff_t stride, int count, const Gate& gate, Moments& m) {
  m = {};
  for (int dv = -Radius; dv <= Radius; ++dv) {
    sum_window_row<Radius>(centre + dv * stride, centre, dv, count, gate, m,
                           std::make_integer_sequence<int, 2 * Radius + 1>());
  }
}

void sum_windows(int radius, const float* centre, std::ptrdiff_t stride, int count, const Gate& gate, Moments& m) {
  switch (radius) {
    case 2:
      return sum_windows<2>(centre, stride, count, gate, m);
    case 3:
      return sum_windows<3>(centre, stride, count, gate, m);
    case 4:
      return sum_windows<4>(centre, stride, count, gate, m);
    default:
      return sum_windows<5>(centre, stride, count, gate, m);
  }
}

// value = w + du * at_u + dv * at_v; NaN where the members are too few or in a line.
struct Planes {
  float w[kChunk], at_u[kChunk], at_v[kChunk];
};

void fit_planes(int radius, int count, const Moments& m, Planes& planes) {
  const float min_count = kMinFilled * static_cast<float>(full_window(radius));
  const float min_determinant = kMinSpread * full_spread(radius) * full_spread(radius);
  for (int i = 0; i < count; ++i) {
    const float mean_u = m.u[i] / m.n[i], mean_v = m.v[i] / m.n[i], mean_w = m.w[i] / m.n[i];
    const float uu = m.uu[i] - mean_u * m.u[i], uv = m.uv[i] - mean_u * m.v[i], vv = m.vv[i] - mean_v * m.v[i];
    const float uw = m.uw[i] - mean_u * m.w[i], vw = m.vw[i] - mean_v * m.w[i];
    const float determinant = uu * vv - uv * uv;
    const bool usable = m.n[i] >= min_count && determinant >= min_determinant;
    const float scale = usable ? 1.0F / determinant : std::numeric_limits<float>::quiet_NaN();
    planes.at_u[i] = (vv * uw - uv * vw) * scale;
    planes.at_v[i] = (uu * vw - uv * uw) * scale;
    planes.w[i] = mean_w - mean_u * planes.at_u[i] - mean_v * planes.at_v[i];
  }
}

// The window radius that a pixel needs: the slope of a fit over a full window has the standard deviation
// sigma / unit_slope / sqrt(full_spread).
int window_radius(float sigma, float unit_slope) {
  int radius = kMinRadius;
  while (radius < kMaxRadius && sigma > kSlopeSigma * unit_slope * std::sqrt(full_spread(radius))) ++radius;
  return radius;
}

// From the change of the planar image per pixel to the plane's normal, towards the camera.
class NormalOf {
 public:
  explicit NormalOf(const Camera& camera)
      : camera_(camera),
        pinhole_(camera.model() == Camera::Model::pinhole),
        regular_(camera.distortion() == Camera::Distortion{}),
        fx_(static_cast<float>(camera.fx())),
        fy_(static_cast<float>(camera.fy())) {}

  // A plane a x + b y + c z = 1 is 1/z = a x/z + b y/z + c: its normal, away from the camera, is (a, b, c). The plane
  // z = a x + b y + c of an orthographic camera has the normal (a, b, -1), towards it.
  Eigen::Vector3f operator()(int u, int v, float value, float at_u, float at_v) const {
    if (!pinhole_) return Eigen::Vector3f(at_u * fx_, at_v * fy_, -1.0F).normalized();
    const Eigen::Vector2f xy = normalised(u, v);
    Eigen::Vector2f ab(at_u * fx_, at_v * fy_);
    if (!regular_) {
      Eigen::Matrix2f pixel_from_xy_inverse;  // d(x, y) / d(u, v), central differences
      const int l = std::max(u - 1, 0), r = std::min(u + 1, camera_.width() - 1);
      const int t = std::max(v - 1, 0), b = std::min(v + 1, camera_.height() - 1);
      pixel_from_xy_inverse.col(0) = (normalised(r, v) - normalised(l, v)) / static_cast<float>(std::max(r - l, 1));
      pixel_from_xy_inverse.col(1) = (normalised(u, b) - normalised(u, t)) / static_cast<float>(std::max(b - t, 1));
      ab = pixel_from_xy_inverse.inverse().transpose() * Eigen::Vector2f(at_u, at_v);
    }
    return -Eigen::Vector3f(ab.x(), ab.y(), value - ab.dot(xy)).normalized();
  }

 private:
  Eigen::Vector2f normalised(int u, int v) const {
    const Ray& ray = camera_.rays()[static_cast<std::size_t>(v) * static_cast<std::size_t>(camera_.width()) +
                                    static_cast<std::size_t>(u)];
    return Eigen::Vector2f(ray.direction_x, ray.direction_y) / ray.direction_z;
  }

  const Camera& camera_;
  bool pinhole_, regular_;
  float fx_, fy_;
};

}  // namespace

Frame make_frame(const DepthRef& depth, const Camera& camera, const NoiseModel& noise, int num_threads) {
  noise.check();
  const PlanarImage image(depth, camera, num_threads);
  const Quadratic sigma_of = image.sigma(noise), slope_of = image.unit_slope();
  const Quadratic gate_base = sigma_of * (kGateSigmas * std::sqrt(2.0F)), gate_slope = slope_of * kGateSlope;
  const NormalOf normal_of(camera);
  const int width = camera.width(), height = camera.height();
  const Eigen::Index size = depth.size();

  Frame frame;
  frame.width = width;
  frame.height = height;
  frame.points.resize(size, 3);
  frame.normals.setConstant(size, 3, std::numeric_limits<float>::quiet_NaN());
  frame.sigma.resize(size);

  parallel_for(height, rows_per_block(width), num_threads, [&](std::int64_t row) {
    const int v = static_cast<int>(row);
    const Ray* const rays = camera.rays().data() + row * width;
    for (int u = 0; u < width; ++u) {
      const float z = is_measurement(depth(row, u)) ? depth(row, u) : std::numeric_limits<float>::quiet_NaN();
      frame.points.row(row * width + u) << rays[u].origin_x + z * rays[u].direction_x,
          rays[u].origin_y + z * rays[u].direction_y, z * rays[u].direction_z;
      frame.sigma[row * width + u] = static_cast<float>(noise.sigma(z));
    }
    Gate gate;
    Moments moments;
    Planes planes;
    std::int8_t radius[kChunk];
    for (int begin = 0; begin < width; begin += kChunk) {
      const int count = std::min(kChunk, width - begin);
      const float* const centre = image.row(v) + begin;
      unsigned radii = 0;
      for (int i = 0; i < count; ++i) {
        gate.base[i] = gate_base(centre[i]);
        gate.slope[i] = gate_slope(centre[i]);
        radius[i] = 0;
        if (centre[i] != centre[i]) continue;
        radius[i] = static_cast<std::int8_t>(window_radius(sigma_of(centre[i]), slope_of(centre[i])));
        radii |= 1U << radius[i];
      }
      for (int r = kMinRadius; r <= kMaxRadius; ++r) {
        if ((radii & 1U << r) == 0) continue;
        sum_windows(r, centre, image.stride(), count, gate, moments);
        fit_planes(r, count, moments, planes);
        for (int i = 0; i < count; ++i) {
          if (radius[i] != r || planes.w[i] != planes.w[i]) continue;
          frame.normals.row(row * width + begin + i) =
              normal_of(begin + i, v, centre[i] + planes.w[i], planes.at_u[i], planes.at_v[i]).transpose();
        }
      }
    }
  });

  for (Eigen::Index i = 0; i < size; ++i) {
    if (frame.normals(i, 0) == frame.normals(i, 0)) frame.valid.push_back(static_cast<std::int32_t>(i));
  }
  return frame;
}

}  // namespace nacre
