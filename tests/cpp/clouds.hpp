// Clouds on surfaces that are known by formula.
#pragma once

#include <cstdint>

#include "base/random.hpp"
#include "nacre/types.hpp"

struct OrientedCloud {
  nacre::Points points, normals;
};

inline Eigen::Vector3d random_direction(std::uint64_t seed, std::uint64_t i) {
  return Eigen::Vector3d(nacre::random_normal(seed, 3 * i), nacre::random_normal(seed, 3 * i + 1),
                         nacre::random_normal(seed, 3 * i + 2))
      .normalized();
}

// A closed surface without symmetry about the origin, some 0.2 m wide; another seed gives other points of it.
inline OrientedCloud asymmetric_cloud(int count, std::uint64_t seed) {
  OrientedCloud cloud{nacre::Points(count, 3), nacre::Points(count, 3)};
  const Eigen::Vector3d a(0.7, 0.2, -0.4), b(-0.2, 0.8, 0.5), c(0.5, -0.4, 0.7), d(0.1, -0.6, -0.8);
  const auto radius = [&](const Eigen::Vector3d& u) {
    return 0.1 * (1.0 + 0.25 * a.dot(u) + 0.4 * b.dot(u) * c.dot(u) + 0.3 * std::sin(4.0 * c.dot(u) + d.dot(u)) +
                  0.25 * std::cos(5.0 * d.dot(u) - 2.0 * b.dot(u)));
  };
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d u = random_direction(seed, static_cast<std::uint64_t>(i));
    // The normal of |p| = r(p / |p|), by differences.
    constexpr double step = 1e-5;
    const auto level = [&](const Eigen::Vector3d& p) { return p.norm() - radius(p.normalized()); };
    const Eigen::Vector3d p = radius(u) * u;
    Eigen::Vector3d gradient;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d shift = step * Eigen::Vector3d::Unit(axis);
      gradient[axis] = level(p + shift) - level(p - shift);
    }
    cloud.points.row(i) = p.cast<float>().transpose();
    cloud.normals.row(i) = gradient.normalized().cast<float>().transpose();
  }
  return cloud;
}

inline OrientedCloud sphere_cloud(int count, std::uint64_t seed) {
  OrientedCloud cloud{nacre::Points(count, 3), nacre::Points(count, 3)};
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d u = random_direction(seed, static_cast<std::uint64_t>(i));
    cloud.points.row(i) = (0.1 * u).cast<float>().transpose();
    cloud.normals.row(i) = u.cast<float>().transpose();
  }
  return cloud;
}

inline OrientedCloud moved(const OrientedCloud& cloud, const nacre::Pose& pose) {
  OrientedCloud result = cloud;
  const Eigen::Matrix3f rotation = pose.linear().cast<float>();
  for (Eigen::Index i = 0; i < cloud.points.rows(); ++i) {
    result.points.row(i) = (pose * cloud.points.row(i).transpose().cast<double>()).cast<float>().transpose();
    result.normals.row(i) = cloud.normals.row(i) * rotation.transpose();
  }
  return result;
}

// Those of the points that face a viewpoint.
inline OrientedCloud facing(const OrientedCloud& cloud, const Eigen::Vector3d& viewpoint) {
  OrientedCloud seen = cloud;
  Eigen::Index count = 0;
  for (Eigen::Index i = 0; i < cloud.points.rows(); ++i) {
    const Eigen::Vector3f ray = viewpoint.cast<float>() - cloud.points.row(i).transpose();
    if (cloud.normals.row(i).dot(ray) < 0.2F * ray.norm()) continue;
    seen.points.row(count) = cloud.points.row(i);
    seen.normals.row(count++) = cloud.normals.row(i);
  }
  seen.points.conservativeResize(count, 3);
  seen.normals.conservativeResize(count, 3);
  return seen;
}
