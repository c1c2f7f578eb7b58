// A telephone's LiDAR: few points, between which an image is filled in, guided by what a colour image shows of edges.
#include <Eigen/Core>
#include <Eigen/LU>
#include <cmath>

#include "base/random.hpp"
#include "simulation/box_sums.hpp"
#include "simulation/limits.hpp"
#include "simulation/sensors.hpp"
#include "simulation/smooth_noise.hpp"

namespace nacre {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
namespace limits = simulation_limits;

// The inverse depths around each pixel, blurred; how much of its surroundings shows something.
class Guide {
 public:
  Guide(const View& view, int num_threads) : view_(view), sums_(as_size(view.num_pixels()), PixelSum::Zero()) {
    parallel_for(view.num_pixels(), 1024, num_threads, [&](std::int64_t i) {
      if (const std::optional<Sight> sight = view.see(view.ray(i))) sums_[as_size(i)] = PixelSum(1.0 / sight->z, 1.0);
    });
    for (int pass = 0; pass < 2; ++pass) sum_boxes(sums_, view.width(), limits::guide_radius, num_threads);
  }

  double cover(std::int64_t pixel) const {
    constexpr int side = 2 * limits::guide_radius + 1;
    return sums_[as_size(pixel)][1] / (side * side * side * side);
  }
  double operator()(std::int64_t pixel) const { return sums_[as_size(pixel)][0] / sums_[as_size(pixel)][1]; }
  double operator()(const Vector2d& place) const {
    const auto u = std::lround(place.x()), v = std::lround(place.y());
    return (*this)(std::int64_t{v} * view_.width() + u);
  }

 private:
  const View& view_;
  PixelSums sums_;
};

struct Sample {
  Vector2d place = Vector2d::Zero();  // [pixels]
  double inverse_z = 0.0;             // 0: nothing was hit
  double guide = 0.0;
};

class Samples {
 public:
  Samples(const View& view, const Guide& guide, const Seeds& seeds, int num_threads)
      : spacing_(static_cast<double>(view.width()) / limits::lidar_points,
                 static_cast<double>(view.height()) / limits::lidar_points),
        samples_(as_size(limits::lidar_points * limits::lidar_points)) {
    parallel_for(static_cast<std::int64_t>(samples_.size()), 16, num_threads, [&](std::int64_t i) {
      Sample& sample = samples_[as_size(i)];
      const Vector2d place(static_cast<double>(i % limits::lidar_points),
                           static_cast<double>(i / limits::lidar_points));
      sample.place = ((place.array() + 0.5) * spacing_.array() - 0.5).matrix();
      const std::optional<Sight> sight = view.see(view.ray(sample.place.x(), sample.place.y()));
      if (!sight) return;
      const double error =
          limits::lidar_rough * partly_fixed(seeds, 0, limits::lidar_fixed, place / limits::lidar_alone) +
          limits::lidar_broad * partly_fixed(seeds, 1, limits::lidar_fixed, place / limits::lidar_patch);
      sample.inverse_z = (1.0 + error) / sight->z;
      sample.guide = guide(sample.place);
    });
  }

  // Inverse depth at a place: of the plane through the samples around it, weighted by how near they are and how like
  // their inverse depth is to `guide`; NaN without any.
  double inverse_z(const Vector2d& place, double guide) const {
    const Vector2d cell = ((place.array() + 0.5) / spacing_.array() - 0.5).floor();
    Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
    Vector3d right = Vector3d::Zero();
    for (int row = -limits::lidar_reach + 1; row <= limits::lidar_reach; ++row) {
      for (int column = -limits::lidar_reach + 1; column <= limits::lidar_reach; ++column) {
        const int x = static_cast<int>(cell.x()) + column, y = static_cast<int>(cell.y()) + row;
        if (x < 0 || y < 0 || x >= limits::lidar_points || y >= limits::lidar_points) continue;
        const Sample& sample = samples_[as_size(std::int64_t{y} * limits::lidar_points + x)];
        if (!(sample.inverse_z > 0.0)) continue;
        const Vector2d offset = ((sample.place - place).array() / spacing_.array()).matrix();
        const double unlike = (sample.guide - guide) / (limits::guide_tolerance * guide);
        const double weight = std::exp(-offset.squaredNorm() / limits::lidar_blur - 0.5 * unlike * unlike) +
                              limits::least_weight * std::exp(-offset.squaredNorm());
        const Vector3d terms(1.0, offset.x(), offset.y());
        matrix += weight * terms * terms.transpose();
        right += weight * sample.inverse_z * terms;
      }
    }
    // A plane that few samples hold stays level.
    const double total = matrix(0, 0);
    matrix.diagonal().tail<2>().array() += limits::level_weight * total;
    return total > 0.0 ? (matrix.inverse() * right)[0] : not_measured;
  }

 private:
  Vector2d spacing_;  // [pixels]
  std::vector<Sample> samples_;
};

}  // namespace

Depths sense_phone_lidar(const View& view, const Seeds& seeds, int num_threads) {
  const Guide guide(view, num_threads);
  const Samples samples(view, guide, seeds, num_threads);
  return depths_of(view, num_threads, [&](std::int64_t i, double u, double v) {
    if (guide.cover(i) < limits::least_cover) return not_measured;
    const Vector2d pixel(u, v);
    const double error = limits::lidar_fine * partly_fixed(seeds, 2, limits::lidar_fixed, pixel / limits::lidar_window);
    const double z = (1.0 + error) / samples.inverse_z(pixel, guide(i));
    const double step = std::ldexp(1.0, std::ilogb(z) - limits::lidar_bits);
    return view.depth_of(i, std::round(z / step) * step);
  });
}

}  // namespace nacre
