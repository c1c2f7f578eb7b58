// Cameras that triangulate: two eyes, or an eye and a projector. They err in disparity, alike where they match alike.
#include <Eigen/Core>
#include <cmath>

#include "base/random.hpp"
#include "simulation/limits.hpp"
#include "simulation/reflectance.hpp"
#include "simulation/sensors.hpp"
#include "simulation/smooth_noise.hpp"

namespace nacre {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
namespace limits = simulation_limits;

struct Matcher {
  double baseline;            // [m]
  double step;                // of disparity [pixels]
  double window;              // over which matching errs alike [pixels]
  double jitter;              // [pixels]
  double rough, fine, broad;  // standard deviations of disparity: of a pixel, a window, a broad patch [pixels]
  double fixed;               // part of the variance of windows and patches that is the same in all images
  double ripple;              // amplitude of the error that repeats with each pixel of disparity [pixels]
  double range;               // where the signal has halved [m]
  double least_signal;        // of a surface of mean brightness, seen from the front and near
};

bool is_hidden(const View& view, const Vector3d& point, const Vector3d& from) {
  const MeshTree::Hit hit = view.cast({from, point - from});
  return hit.triangle >= 0 && hit.distance < 1.0 - limits::hidden_margin;
}

Depths triangulate(const View& view, const Matcher& matcher, const Seeds& seeds, int num_threads) {
  const std::uint64_t across = stream_of(seeds.image, 0), down = stream_of(seeds.image, 1),
                      alone = stream_of(seeds.image, 2);
  const Vector3d second_eye = view.beside(matcher.baseline);
  const double focal_baseline = view.focal_length() * matcher.baseline;
  return depths_of(view, num_threads, [&](std::int64_t i, double u, double v) {
    const Vector2d pixel(u, v), window = pixel / matcher.window, patch = pixel / limits::broad_patch;
    const std::optional<Sight> sight = view.see(view.ray(u + matcher.jitter * smooth_noise<2>(across, window),
                                                         v + matcher.jitter * smooth_noise<2>(down, window)));
    if (!sight || is_hidden(view, sight->point, second_eye)) return not_measured;
    const double ratio = sight->z / matcher.range;
    const double signal = reflectance(sight->point) * sight->cosine / (1.0 + ratio * ratio);
    if (signal < matcher.least_signal) return not_measured;
    const double error = matcher.rough * random_normal(alone, static_cast<std::uint64_t>(i)) +
                         matcher.fine * partly_fixed(seeds, 3, matcher.fixed, window) +
                         matcher.broad * partly_fixed(seeds, 4, matcher.fixed, patch);
    double disparity = focal_baseline / sight->z + error / std::sqrt(signal);
    disparity += matcher.ripple * std::sin(2.0 * pi * disparity);
    disparity = std::round(disparity / matcher.step) * matcher.step;
    return view.depth_of(i, focal_baseline / disparity);
  });
}

}  // namespace

Depths sense_stereo(const View& view, const Seeds& seeds, int num_threads) {
  static constexpr Matcher matcher = {limits::stereo_baseline, limits::stereo_step,        limits::stereo_window,
                                      limits::stereo_jitter,   limits::stereo_rough,       limits::stereo_fine,
                                      limits::stereo_broad,    limits::stereo_fixed,       limits::stereo_ripple,
                                      limits::stereo_range,    limits::stereo_least_signal};
  return triangulate(view, matcher, seeds, num_threads);
}

Depths sense_structured_light(const View& view, const Seeds& seeds, int num_threads) {
  static constexpr Matcher matcher = {limits::light_baseline, limits::light_step,        limits::light_window,
                                      limits::light_jitter,   limits::light_rough,       limits::light_fine,
                                      limits::light_broad,    limits::light_fixed,       limits::light_ripple,
                                      limits::light_range,    limits::light_least_signal};
  return triangulate(view, matcher, seeds, num_threads);
}

}  // namespace nacre
