#include "tracking/frame_samples.hpp"

#include <algorithm>
#include <cmath>

#include "base/parallel.hpp"
#include "base/random.hpp"
#include "depth/systematic_error.hpp"
#include "tracking/limits.hpp"

namespace nacre {

FrameSamples sample_frame(const Frame& frame, const SurfaceObserver& observer, const TrackingOptions& options) {
  const std::int64_t count =
      options.registration.max_samples > 0
          ? std::min<std::int64_t>(options.registration.max_samples, static_cast<std::int64_t>(frame.valid.size()))
          : static_cast<std::int64_t>(frame.valid.size());
  FrameSamples samples{Points(count, 3), Points(count, 3), Values(count), Values(count)};
  const double stride = static_cast<double>(frame.valid.size()) / static_cast<double>(std::max<std::int64_t>(count, 1));
  parallel_blocks(count, ObservationBlock::capacity, options.num_threads, [&](auto, auto begin, auto end) {
    ObservationBlock block;
    for (std::int64_t i = begin; i < end; ++i) {
      // One of every `stride` pixels.
      const double place =
          (static_cast<double>(i) + random_uniform(options.registration.seed, static_cast<std::uint64_t>(i))) * stride;
      const std::int32_t row = frame.valid[std::min(frame.valid.size() - 1, static_cast<std::size_t>(place))];
      samples.points.row(i) = frame.points.row(row);
      samples.normals.row(i) = frame.normals.row(row);
      samples.noise[i] = frame.sigma[row];
      samples.sigma[i] = std::hypot(frame.sigma[row], systematic_error(frame.points(row, 2)));
      observer.add(block, samples.points.row(i).transpose(), samples.normals.row(i).transpose(), row, frame.sigma[row]);
    }
    if (!options.denoise_samples) return;
    observer.observe(block);
    for (std::int64_t i = begin; i < end; ++i) {
      const Observation seen = block[static_cast<int>(i - begin)];
      if (!(seen.weight > 0.0F)) continue;
      samples.points.row(i) += seen.offset * block.ray(static_cast<int>(i - begin)).transpose();
      samples.normals.row(i) = seen.normal.normalized().transpose();
    }
  });
  return samples;
}

BrightCloud bright_cloud(const Frame& frame, const SurfaceObserver& observer) {
  const std::size_t most = tracking_limits::most_bright_points;
  const std::size_t step = std::max<std::size_t>(1, (frame.valid.size() + most - 1) / most);
  const auto count = static_cast<Eigen::Index>(frame.valid.size() / step);
  Points points(count, 3);
  Values brightness(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const std::size_t place = static_cast<std::size_t>(i) * step;
    const std::int32_t row = frame.valid[place + random_bits(0, place) % step];
    points.row(i) = frame.points.row(row);
    brightness[i] = luma(observer.color(row % frame.width, row / frame.width));
  }
  return BrightCloud(points, brightness);
}

}  // namespace nacre
