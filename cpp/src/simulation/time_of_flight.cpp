// A camera that times light: pixels at edges mix, corners throw light into each other, noise grows with the slant.
#include <Eigen/Core>
#include <cmath>

#include "base/random.hpp"
#include "nacre/depth.hpp"
#include "simulation/box_sums.hpp"
#include "simulation/limits.hpp"
#include "simulation/mixed_edges.hpp"
#include "simulation/reflectance.hpp"
#include "simulation/sensors.hpp"

namespace nacre {
namespace {

using Eigen::Vector3d;
namespace limits = simulation_limits;

// Nguyen, Izadi and Lovell 2012, section 3: how far pixels err to the side [pixels], and what slant adds in depth [m].
double lateral_sigma(double angle) {
  return limits::lateral_constant + limits::lateral_slant * angle / (pi / 2.0 - angle);
}
double slant_sigma(double z, double angle) {
  const double steep = angle / (pi / 2.0 - angle);
  return limits::axial_slant / std::sqrt(z) * steep * steep;
}

// What a point returns of light that came over other surfaces in view, once, scattered evenly (Fuchs 2010): the sum of
// half its detours [m], weighted by its part of the light that came straight; and the sum of all parts.
PixelSum bounced_light(const View& view, const Sight& sight, std::uint64_t seed, std::int64_t pixel) {
  const Vector3d eye = view.beside(0.0);
  const double distance = (sight.point - eye).norm(), direct = sight.cosine / (distance * distance);
  const Vector3d side = sight.normal.unitOrthogonal(), other = sight.normal.cross(side);
  const Vector3d start = sight.point + limits::bounce_gap * distance * sight.normal;
  PixelSum sum(0.0, 1.0);
  for (int k = 0; k < limits::num_bounces; ++k) {
    const auto counter = static_cast<std::uint64_t>(2 * (limits::num_bounces * pixel + k));
    // As many rays as the cosine: evenly over the disk below the hemisphere, a ring each.
    const double square = (k + random_uniform(seed, counter)) / limits::num_bounces;
    const double angle = 2.0 * pi * random_uniform(seed, counter + 1);
    const std::optional<Sight> lit =
        view.see({start, std::sqrt(square) * (std::cos(angle) * side + std::sin(angle) * other) +
                             std::sqrt(1.0 - square) * sight.normal});
    if (!lit || !view.shows(lit->point)) continue;
    const Vector3d from_eye = lit->point - eye;
    const double reach = from_eye.norm(), toward = -lit->normal.dot(from_eye) / reach;
    if (!(toward > 0.0)) continue;  // its other side is lit
    const double part = limits::albedo * toward / (reach * reach) / direct / limits::num_bounces;
    sum += PixelSum(part * 0.5 * (reach + (lit->point - sight.point).norm() - distance), part);
  }
  return sum;
}

// By how much [m] distances are too long, as the pixels around tell together.
PixelSums multipath(const View& view, const std::uint64_t seed, int num_threads) {
  PixelSums sums(as_size(view.num_pixels()), PixelSum::Zero());
  parallel_for(view.num_pixels(), 256, num_threads, [&](std::int64_t i) {
    if (const std::optional<Sight> sight = view.see(view.ray(i)))
      sums[as_size(i)] = bounced_light(view, *sight, seed, i);
  });
  sum_boxes(sums, view.width(), limits::bounce_blur, num_threads);
  return sums;
}

}  // namespace

Depths sense_time_of_flight(const View& view, const Seeds& seeds, double background, int num_threads) {
  const NoiseModel frontal = NoiseModel::time_of_flight();
  const Hits hits = cast_pixels(view, num_threads);
  background = background_of(view, hits, background);
  const std::vector<std::uint8_t> edges =
      find_edges(view, hits, limits::flying_radius + limits::flying_reach, num_threads);
  const std::uint64_t aside = stream_of(seeds.image, 0), axial = stream_of(seeds.image, 1);
  const PixelSums detours = multipath(view, stream_of(seeds.image, 2), num_threads);
  return depths_of(view, num_threads, [&](std::int64_t i, double u, double v) {
    const std::optional<Sight> straight = view.see(view.ray(i));
    const double angle = straight ? std::acos(std::min(1.0, straight->cosine)) : 0.0, sigma = lateral_sigma(angle);
    const auto counter = static_cast<std::uint64_t>(i);
    u += sigma * random_normal(aside, 2 * counter), v += sigma * random_normal(aside, 2 * counter + 1);
    const std::optional<Sight> sight = view.see(view.ray(u, v));
    const double depth = edges[as_size(i)] ? mixed_depth(view, u, v, limits::flying_radius, background)
                         : sight           ? sight->depth
                                           : not_measured;
    if (!sight) return depth;
    const double brightness = reflectance(sight->point), ratio = sight->z / limits::flight_range;
    if (brightness * sight->cosine / (1.0 + ratio * ratio) < limits::flight_least_signal) return not_measured;
    const double noise = std::hypot(frontal.sigma(sight->z), slant_sigma(sight->z, angle)) / std::sqrt(brightness);
    const double distance = (sight->point - view.beside(0.0)).norm();
    const double detour = straight ? detours[as_size(i)][0] / detours[as_size(i)][1] : 0.0;
    return depth * (1.0 + detour / distance) + noise * random_normal(axial, counter);
  });
}

}  // namespace nacre
