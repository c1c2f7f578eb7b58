// Cameras and synthetic depth images for the tests.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>

#include "base/random.hpp"
#include "nacre/depth.hpp"

namespace nacre_test {

using namespace nacre;

inline constexpr float missing = std::numeric_limits<float>::quiet_NaN();
inline constexpr int width = 120, height = 90;
inline const Camera::Distortion lens{0.1, -0.05, 0.001, -0.001, 0.01};

inline const Camera pinhole = Camera::pinhole(width, height, 100.0, 104.0, 58.0, 47.0);
inline const Camera radial = Camera::pinhole(width, height, 100.0, 104.0, 58.0, 47.0, {}, DepthKind::radial);
inline const Camera distorted = Camera::pinhole(width, height, 100.0, 104.0, 58.0, 47.0, lens);
inline const Camera orthographic = Camera::orthographic(width, height, 0.002);

struct Plane {
  Eigen::Vector3d normal;
  double offset;  // normal . p = offset
};

// Through the optical axis at distance z, slanted against the camera about an axis in the image.
inline Plane slanted_plane(double z, double slant, double axis) {
  const Eigen::Vector3d normal(std::sin(slant) * std::cos(axis), std::sin(slant) * std::sin(axis), -std::cos(slant));
  return {normal, normal.z() * z};
}

inline Ray ray_of(const Camera& camera, Eigen::Index pixel) {
  return camera.ray(static_cast<int>(pixel % camera.width()), static_cast<int>(pixel / camera.width()));
}

// The depth of a plane in the camera's depth kind; missing where a ray does not meet it within 20 m.
inline DepthImage render(const Camera& camera, const Plane& plane) {
  DepthImage depth(camera.height(), camera.width());
  for (Eigen::Index i = 0; i < depth.size(); ++i) {
    const Ray ray = ray_of(camera, i);
    const double along = plane.normal.dot(Eigen::Vector3d(ray.direction_x, ray.direction_y, ray.direction_z));
    const double value = (plane.offset - plane.normal.x() * ray.origin_x - plane.normal.y() * ray.origin_y) / along;
    depth.data()[i] = value > 0.0 && value < 20.0 ? static_cast<float>(value) : missing;
  }
  return depth;
}

inline void add_noise(DepthImage& depth, const NoiseModel& noise, std::uint64_t seed) {
  for (Eigen::Index i = 0; i < depth.size(); ++i) {
    const double z = depth.data()[i];
    depth.data()[i] = static_cast<float>(z + noise.sigma(z) * random_normal(seed, static_cast<std::uint64_t>(i)));
  }
}

// How many pixels see the plane with an angle of at most 75 degrees between ray and normal.
inline std::int64_t num_facing(const Camera& camera, const Plane& plane, const DepthImage& depth) {
  std::int64_t count = 0;
  for (Eigen::Index i = 0; i < depth.size(); ++i) {
    const Ray ray = ray_of(camera, i);
    const Eigen::Vector3d direction(ray.direction_x, ray.direction_y, ray.direction_z);
    count += std::isfinite(depth.data()[i]) && -plane.normal.dot(direction.normalized()) > 0.2588;
  }
  return count;
}

inline std::int64_t num_valid(const DepthImage& depth) { return (depth == depth).count(); }

inline bool same_bits(const DepthImage& a, const DepthImage& b) {
  return a.size() == b.size() &&
         std::memcmp(a.data(), b.data(), static_cast<std::size_t>(a.size()) * sizeof(float)) == 0;
}

// A box in front of a wall; between the two a pixel wide band of mixtures.
struct BoxScene {
  DepthImage depth = DepthImage::Constant(height, width, 2.0F);
  MaskImage mixed = MaskImage::Zero(height, width);

  explicit BoxScene(float wall = 2.0F) {
    depth.setConstant(wall);
    for (int v = 29; v <= 60; ++v) {
      for (int u = 39; u <= 80; ++u) {
        const bool rim = v == 29 || v == 60 || u == 39 || u == 80;
        const auto part = static_cast<float>(
            0.1 + 0.8 * random_uniform(1, static_cast<std::uint64_t>(v) * 1000 + static_cast<std::uint64_t>(u)));
        depth(v, u) = rim ? part * wall + (1.0F - part) * 1.2F : 1.2F;
        mixed(v, u) = rim;
      }
    }
  }
};

inline std::string message_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

}  // namespace nacre_test
