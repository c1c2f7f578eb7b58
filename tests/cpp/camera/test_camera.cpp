#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>

#include "doctest/doctest.h"
#include "nacre/camera.hpp"

namespace {

using nacre::Camera;
using nacre::DepthKind;
using nacre::Ray;

constexpr double missing = std::numeric_limits<double>::quiet_NaN();
const Camera::Distortion barrel{-0.28, 0.07, 0.0002, 1.8e-05, 0.0};             // of a 70 degree lens
const Camera::Distortion pincushion{0.2624, -0.9531, -0.0054, 0.0026, 1.1633};  // Kinect v1, TUM fr1
const Camera::Distortion growing{0.9, 0.4, 0.01, -0.01, 0.1};

Eigen::Vector3d at(const Ray& ray, double depth) {
  return Eigen::Vector3d(ray.origin_x, ray.origin_y, 0.0) +
         depth * Eigen::Vector3d(ray.direction_x, ray.direction_y, ray.direction_z);
}

// Every pixel's ray is seen by that pixel, at the depth that was put in.
void check_rays(const Camera& camera, double pixel_tolerance) {
  for (int v = 0; v < camera.height(); ++v) {
    for (int u = 0; u < camera.width(); ++u) {
      const Eigen::Vector3d point = at(camera.ray(u, v), 1.7);
      CAPTURE(u);
      CAPTURE(v);
      REQUIRE((camera.project(point) - Eigen::Vector2d(u, v)).norm() < pixel_tolerance);
      REQUIRE(camera.depth_of(point) == doctest::Approx(1.7).epsilon(1e-6));
    }
  }
}

std::string message_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("rays and projection agree for every model") {
  for (const DepthKind kind : {DepthKind::z, DepthKind::radial}) {
    check_rays(Camera::pinhole(64, 48, 52.5, 50.0, 31.0, 24.5, {}, kind), 1e-4);
    for (const Camera::Distortion& distortion : {barrel, pincushion, growing}) {
      check_rays(Camera::pinhole(64, 48, 52.5, 50.0, 31.0, 24.5, distortion, kind), 1e-4);
    }
  }
  check_rays(Camera::pinhole(33, 21, 30.0, -30.0, 16.0, 10.0), 1e-4);  // ICL-NUIM's fy is negative
  check_rays(Camera::orthographic(31, 22, 0.001), 1e-3);
}

TEST_CASE("pixel centres are integers") {
  const Camera pinhole = Camera::pinhole(640, 480, 525.0, 525.0, 319.5, 239.5);
  CHECK((pinhole.project({0.0, 0.0, 2.0}) - Eigen::Vector2d(319.5, 239.5)).norm() < 1e-12);
  CHECK((pinhole.project({2.0 / 525.0, 0.0, 2.0}) - Eigen::Vector2d(320.5, 239.5)).norm() < 1e-9);
  const Camera flat = Camera::orthographic(4, 3, 0.5);
  CHECK(flat.ray(0, 0).origin_x == -0.75F);
  CHECK(flat.ray(0, 0).origin_y == -0.5F);
  CHECK(flat.project({-0.75, -0.5, 9.0}).norm() < 1e-12);
}

TEST_CASE("radial rays have unit length, z rays unit z") {
  const Camera radial = Camera::pinhole(64, 48, 30.0, 30.0, 31.5, 23.5, barrel, DepthKind::radial);
  const Camera straight = Camera::pinhole(64, 48, 30.0, 30.0, 31.5, 23.5, barrel, DepthKind::z);
  for (int i = 0; i < 64 * 48; ++i) {
    const Ray ray = radial.ray(i % 64, i / 64), other = straight.ray(i % 64, i / 64);
    REQUIRE(Eigen::Vector3f(ray.direction_x, ray.direction_y, ray.direction_z).norm() ==
            doctest::Approx(1.0F).epsilon(1e-6));
    REQUIRE(other.direction_z == 1.0F);
    REQUIRE(ray.direction_x / ray.direction_z == doctest::Approx(other.direction_x).epsilon(1e-5));
  }
  CHECK(radial.depth_of({3.0, 4.0, 12.0}) == doctest::Approx(13.0));
  CHECK(straight.depth_of({3.0, 4.0, 12.0}) == 12.0);
}

TEST_CASE("distortion follows Brown and Conrady") {
  const Camera camera = Camera::pinhole(64, 48, 1.0, 1.0, 0.0, 0.0, {0.1, 0.01, 0.002, 0.003, 0.001});
  // x = 0.5, y = -0.25, r2 = 0.3125: the terms by hand.
  const double radial = 1.0 + 0.1 * 0.3125 + 0.01 * 0.3125 * 0.3125 + 0.001 * 0.3125 * 0.3125 * 0.3125;
  const double u = 0.5 * radial + 2.0 * 0.002 * 0.5 * -0.25 + 0.003 * (0.3125 + 2.0 * 0.25);
  const double v = -0.25 * radial + 0.002 * (0.3125 + 2.0 * 0.0625) + 2.0 * 0.003 * 0.5 * -0.25;
  CHECK((camera.project({1.0, -0.5, 2.0}) - Eigen::Vector2d(u, v)).norm() < 1e-12);
}

TEST_CASE("a camera ends where its distortion turns back") {
  // r (1 - 0.3 r^2) grows up to r = 1.054 only: farther points must not come back into the image.
  const Camera camera = Camera::pinhole(200, 200, 100.0, 100.0, 99.5, 99.5, {-0.3, 0.0, 0.0, 0.0, 0.0});
  CHECK(camera.project({1.0, 0.0, 1.0}).allFinite());
  CHECK(!camera.project({1.1, 0.0, 1.0}).allFinite());
  CHECK(!camera.project({1.8, 0.0, 1.0}).allFinite());
  const Ray inside = camera.ray(160, 100);
  const Ray corner = camera.ray(0, 0);
  CHECK(std::isfinite(inside.direction_x));
  CHECK(std::isnan(corner.direction_x));
}

TEST_CASE("nothing is seen behind a pinhole camera") {
  const Camera camera = Camera::pinhole(64, 48, 50.0, 50.0, 31.5, 23.5);
  CHECK(!camera.project({0.0, 0.0, -1.0}).allFinite());
  CHECK(!camera.project({0.0, 0.0, 0.0}).allFinite());
  CHECK(!camera.project({missing, 0.0, 1.0}).allFinite());
  CHECK(!camera.project({0.0, 0.0, missing}).allFinite());
  CHECK(Camera::orthographic(8, 8, 1.0).project({0.0, 0.0, -1.0}).allFinite());
}

TEST_CASE("footprint is the side of a pixel") {
  CHECK(Camera::pinhole(64, 48, 50.0, 50.0, 31.5, 23.5).footprint(2.0) == doctest::Approx(0.04));
  CHECK(Camera::pinhole(64, 48, -50.0, 50.0, 31.5, 23.5).footprint(2.0) == doctest::Approx(0.04));
  CHECK(Camera::orthographic(64, 48, 0.003).footprint(2.0) == 0.003);
}

TEST_CASE("equality looks at every parameter") {
  const Camera camera = Camera::pinhole(64, 48, 50.0, 51.0, 31.5, 23.5, barrel);
  CHECK(camera == Camera::pinhole(64, 48, 50.0, 51.0, 31.5, 23.5, barrel));
  CHECK(camera != Camera::pinhole(64, 47, 50.0, 51.0, 31.5, 23.5, barrel));
  CHECK(camera != Camera::pinhole(64, 48, 50.0, 51.0, 31.0, 23.5, barrel));
  CHECK(camera != Camera::pinhole(64, 48, 50.0, 51.0, 31.5, 23.5));
  CHECK(camera != Camera::pinhole(64, 48, 50.0, 51.0, 31.5, 23.5, barrel, DepthKind::radial));
  CHECK(Camera::orthographic(64, 48, 0.1) != Camera::pinhole(64, 48, 10.0, 10.0, 31.5, 23.5));
}

TEST_CASE("wrong parameters are named") {
  const double inf = std::numeric_limits<double>::infinity();
  CHECK(message_of([] { Camera::pinhole(0, 48, 50, 50, 31, 23); }).find("width") == 0);
  CHECK(message_of([] { Camera::pinhole(64, -1, 50, 50, 31, 23); }).find("height") == 0);
  CHECK(message_of([] { Camera::pinhole(64, 48, 0, 50, 31, 23); }).find("fx") == 0);
  CHECK(message_of([] { Camera::pinhole(64, 48, 50, missing, 31, 23); }).find("fy") == 0);
  CHECK(message_of([&] { Camera::pinhole(64, 48, 50, 50, inf, 23); }).find("cx") == 0);
  CHECK(message_of([] { Camera::pinhole(64, 48, 50, 50, 31, missing); }).find("cy") == 0);
  CHECK(message_of([] { Camera::pinhole(64, 48, 50, 50, 31, 23, {missing, 0, 0, 0, 0}); }).find("distortion") == 0);
  CHECK(message_of([] { Camera::orthographic(64, 48, 0.0); }).find("pixel_size") == 0);
  CHECK(message_of([] { Camera::orthographic(1 << 20, 48, 1.0); }).find("width must be 1 to 65536") == 0);
}
