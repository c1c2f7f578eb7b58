// The built-in object: a snail with the ears of a rabbit, as the zero level of a sum of simple shapes. Lengths in this
// file are millimetres.
#include <algorithm>
#include <array>
#include <cmath>

#include "base/numbers.hpp"
#include "mesh/surface_nets.hpp"
#include "nacre/mesh.hpp"

namespace nacre {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// The union of two shapes with a fillet of about radius k (Quilez, polynomial smooth minimum).
double join(double a, double b, double k) {
  const double h = std::max(k - std::abs(a - b), 0.0) / k;
  return std::min(a, b) - 0.25 * h * h * k;
}
// What is left of a when b is taken away, its rim rounded.
double carve(double a, double b, double k) { return -join(-a, b, k); }

double sphere(const Vector3d& p, const Vector3d& center, double radius) { return (p - center).norm() - radius; }

// A rod whose radius changes from end to end.
template <class Vector>
double rod(const Vector& p, const Vector& a, const Vector& b, double radius_a, double radius_b) {
  const Vector axis = b - a;
  const double along = std::clamp((p - a).dot(axis) / axis.squaredNorm(), 0.0, 1.0);
  return (p - a - along * axis).norm() - (radius_a + along * (radius_b - radius_a));
}

struct Node {
  Vector3d center;
  double radius;
};

// From the tail to the neck.
const std::array<Node, 7> body_line = {{{{-69.0, 6.5, 30.0}, 3.5},
                                        {{-57.0, 7.5, 19.0}, 6.5},
                                        {{-36.0, 12.0, 4.0}, 12.0},
                                        {{-8.0, 15.0, -6.0}, 17.0},
                                        {{24.0, 15.0, -2.0}, 16.0},
                                        {{44.0, 26.0, 11.0}, 13.0},
                                        {{49.0, 46.0, 17.0}, 11.0}}};

double body(const Vector3d& p) {
  double f = 1e9;
  for (std::size_t i = 0; i + 1 < body_line.size(); ++i) {
    const Node &a = body_line[i], &b = body_line[i + 1];
    f = join(f, rod(p, a.center, b.center, a.radius, b.radius), 5.0);
  }
  return carve(f, p.y() - 0.8, 2.0);
}

// A wavy sheet around the body, on the ground.
double hem(const Vector3d& p) {
  const Vector2d q(p.x(), p.z());
  double outline = 1e9;
  for (std::size_t i = 0; i + 2 < body_line.size(); ++i) {
    const Node &a = body_line[i], &b = body_line[i + 1];
    outline = join(outline,
                   rod(q, Vector2d(a.center.x(), a.center.z()), Vector2d(b.center.x(), b.center.z()),
                       4.0 + 1.25 * a.radius, 4.0 + 1.25 * b.radius),
                   6.0);
  }
  outline += 1.3 * std::sin(0.21 * p.x() + 0.09 * p.z()) + 0.8 * std::sin(0.37 * p.x() - 1.0);
  const double lift = 1.9 + 0.9 * (1.0 + std::sin(0.13 * p.x() + 0.06 * p.z() + 0.8));
  const Vector2d outside(std::max(outline + 1.4, 0.0), std::max(std::abs(p.y() - lift) - 0.2, 0.0));
  return outside.norm() + std::min(std::max(outline + 1.4, std::abs(p.y() - lift) - 0.2), 0.0) - 1.4;
}

// A cupped leaf, 3 mm thick: it starts at the origin and grows along y, faces z, and bends towards z.
double leaf(const Vector3d& p, double length, double width, double cup, double bend) {
  const double along = p.y() / length;
  const Vector2d half_axes(width * (1.0 - 0.25 * (along - 0.5)), 0.5 * length);
  const Vector2d scaled = Vector2d(p.x(), p.y() - half_axes.y()).cwiseQuotient(half_axes);
  const double outline = scaled.norm() * (scaled.norm() - 1.0) / (scaled.cwiseQuotient(half_axes).norm() + 1e-9);
  const Vector2d slope(2.0 * cup * p.x() / width, 2.0 * bend * along / length);
  const double across =
      (p.z() - bend * along * along - cup * p.x() * p.x() / width) / std::sqrt(1.0 + slope.squaredNorm());
  constexpr double half_thickness = 1.5;
  return Vector2d(std::max(outline + half_thickness, 0.0), across).norm() - half_thickness;
}

// Into a frame at `origin` whose y axis points along `up` and whose z axis is turned about it by `turn`.
Vector3d to_frame(const Vector3d& p, const Vector3d& origin, const Vector3d& up, double turn) {
  const Vector3d y = up.normalized();
  const Vector3d x0 = Vector3d(0.0, 0.0, 1.0).cross(y).normalized() * -1.0;
  const Vector3d z0 = x0.cross(y);
  const Vector3d x = std::cos(turn) * x0 + std::sin(turn) * z0;
  const Vector3d z = x.cross(y);
  const Vector3d d = p - origin;
  return {x.dot(d), y.dot(d), z.dot(d)};
}

double head(const Vector3d& world) {
  constexpr double yaw = 0.55;  // it looks aside
  const Vector3d d = world - Vector3d(51.0, 60.0, 18.0);
  const Vector3d p(55.0 + std::cos(yaw) * d.x() + std::sin(yaw) * d.z(), 60.0 + d.y(),
                   9.0 + std::cos(yaw) * d.z() - std::sin(yaw) * d.x());
  double f = sphere(p, {55.0, 60.0, 9.0}, 15.0);
  f = join(f, sphere(p, {67.0, 55.0, 11.0}, 9.5), 7.0);
  for (const double side : {-1.0, 1.0}) f = join(f, sphere(p, {64.0, 66.0, 10.0 + 9.0 * side}, 3.8), 0.8);
  f = carve(f, rod(p, Vector3d(76.5, 50.5, 7.0), Vector3d(76.0, 50.5, 17.0), 1.8, 1.8), 1.0);
  const double straight = leaf(to_frame(p, {50.0, 69.0, 2.0}, {-0.25, 1.0, -0.3}, 1.2), 50.0, 10.5, 0.3, 3.0);
  const double floppy = leaf(to_frame(p, {50.0, 69.0, 16.0}, {-0.1, 1.0, 0.4}, 1.9), 46.0, 11.0, 0.33, 20.0);
  return join(f, std::min(straight, floppy), 4.0);
}

// A tube along a conical spiral that shrinks as it turns, with a hollow where it opens.
class Shell {
 public:
  double operator()(const Vector3d& world) const {
    const Vector3d p = to_local(world);
    const double angle = std::atan2(p.y(), p.x()), from_axis = std::hypot(p.x(), p.y());
    // How far the tube has come, from its opening inwards, when it first passes through the half plane of p.
    const double way = opening - angle;
    const double on_tube = std::max(way, -0.6), in_hollow = std::clamp(way, -0.8, 1.5);
    const double tube = distance(p, on_tube) - radius(on_tube);
    const double outer = carve(tube, way * from_axis, 2.0);  // cut at the opening
    const double hollow = distance(p, in_hollow) - (radius(in_hollow) - wall);
    double whorls = rod(p, Vector3d(0.0, 0.0, height(22.0)), Vector3d(0.0, 0.0, height(0.0) - 4.0), 14.0, 2.0);
    for (int turn = 1; turn <= 3; ++turn) {
      const double on_whorl = std::min(way + 2.0 * pi * turn, last);
      whorls = join(whorls, distance(p, on_whorl) - radius(on_whorl), 2.2);
    }
    return join(whorls, carve(outer, hollow, 1.5), 2.2);
  }

 private:
  static constexpr double opening = -0.75;  // the angle at which the tube opens
  static constexpr double last = 5.2 * pi;
  static constexpr double wall = 3.0;
  static constexpr double growth = 2.05;  // of the size in one turn

  static double size(double way) { return 33.0 * std::exp(-std::log(growth) / (2.0 * pi) * way); }
  static double height(double size) { return 31.0 - 0.95 * size; }  // along the axis
  static double radius(double way) {
    const double ribs = 0.035 * std::cos(7.0 * way) * std::exp(-0.12 * way);
    const double flare = 0.13 * std::exp(-std::pow((way + 0.1) / 0.3, 2));
    return size(way) * (0.54 + ribs + flare);
  }
  static double distance(const Vector3d& p, double way) {
    const double s = size(way), angle = opening - way;
    return (p - Vector3d(s * std::cos(angle), s * std::sin(angle), height(s))).norm();
  }
  static Vector3d to_local(const Vector3d& world) {
    const double yaw = 0.3, roll = 0.25;
    const Vector3d d = world - Vector3d(-13.0, 58.0, -8.0);
    const Vector3d a(std::cos(yaw) * d.x() - std::sin(yaw) * d.z(), d.y(),
                     std::sin(yaw) * d.x() + std::cos(yaw) * d.z());
    return {a.x(), std::cos(roll) * a.y() - std::sin(roll) * a.z(), std::sin(roll) * a.y() + std::cos(roll) * a.z()};
  }
};

// A shape that lies within a sphere; far from it, where no fillet reaches, the distance to the sphere does.
template <class Shape>
double within(const Vector3d& p, const Vector3d& center, double radius, Shape&& shape) {
  const double outside = sphere(p, center, radius);
  return outside > 10.0 ? outside : shape(p);
}

double snail(const Vector3d& p) {
  const double foot = join(body(p), hem(p), 4.0);
  return join(join(foot, within(p, {52.0, 80.0, 18.0}, 52.0, head), 6.0), within(p, {-10.0, 52.0, -2.0}, 60.0, Shell()),
              3.0);
}

}  // namespace

Mesh built_in_object() {
  const auto function = [](const Vector3d& p) { return snail(p); };
  Mesh mesh = SurfaceNets(function, Vector3d(-82.0, -4.0, -38.0), Vector3d(75.0, 120.0, 43.0), 1.3).mesh();
  mesh.vertices *= 0.001F;
  return mesh;
}

}  // namespace nacre
