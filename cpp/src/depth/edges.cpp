// Which pixels at the edges of a depth image are noise.
#include "depth/edges.hpp"

#include <algorithm>
#include <cmath>

#include "base/limits.hpp"
#include "base/numbers.hpp"
#include "base/parallel.hpp"
#include "camera/limits.hpp"
#include "depth/limits.hpp"
#include "simd/depth_edges.hpp"
#include "simd/depth_planar_edges.hpp"

namespace nacre {
namespace {

simd::EdgeLimits edge_limits(const PlanarImage& image, const NoiseModel& noise, const DepthOptions& options) {
  const Quadratic sigma = image.sigma(noise.local()), unit_slope = image.unit_slope();
  const auto bend_sigmas = static_cast<float>(options.edge_sigmas * std::sqrt(6.0));
  const float step_sigmas = base_limits::noise_sigmas * std::sqrt(2.0F);
  return {sigma * bend_sigmas,
          unit_slope * static_cast<float>(camera_limits::steepest),
          sigma * step_sigmas,
          unit_slope * static_cast<float>(std::tan(options.max_slant)),
          bend_sigmas * depth_limits::lateral_sigma,
          step_sigmas * depth_limits::lateral_sigma};
}

// The slopes of the surface at the pixels of image rows: each the least of the nearest window and the eight around it,
// since an edge can only make a slope larger. 0 where no window says.
class SlopeRows {
 public:
  SlopeRows(const WindowFits& fits, int width, int height)
      : fits_(fits),
        around_(static_cast<std::size_t>(fits.cols + 2)),
        slopes_(padded(width)),
        at_rim_(padded(width)),
        width_(width),
        height_(height) {}

  // Beyond the image, other than beside pixels that miss in it, the surface goes on.
  simd::SlopeRow row(int v) {
    if (fits_.rows == 0 || fits_.cols == 0) return {slopes_.data(), slopes_.data()};
    const int row = nearest(v, fits_.rows);
    if (row != current_) fill(row);
    current_ = row;
    const bool is_outermost = v == 0 || v == height_ - 1;
    return {slopes_.data(), is_outermost ? slopes_.data() : at_rim_.data()};
  }

 private:
  static std::size_t padded(int width) { return static_cast<std::size_t>(width) + PlanarImage::kOverhang; }
  static int nearest(int pixel, int count) {
    return std::clamp((pixel - WindowFits::kRadius + WindowFits::kStep / 2) / WindowFits::kStep, 0, count - 1);
  }

  void fill(int row) {
    constexpr float none = infinity<float>;
    const auto cols = static_cast<std::size_t>(fits_.cols);
    std::fill(around_.begin(), around_.end(), none);
    for (int r = std::max(row - 1, 0); r <= std::min(row + 1, fits_.rows - 1); ++r) {
      const float* const slope = fits_.slope.data() + static_cast<std::size_t>(r) * cols;
      for (std::size_t c = 0; c < cols; ++c) around_[c + 1] = slope[c] < around_[c + 1] ? slope[c] : around_[c + 1];
    }
    for (std::size_t c = 0; c < cols; ++c) {
      const float least = std::min({around_[c], around_[c + 1], around_[c + 2]});
      const float value = least < none ? least : 0.0F;
      const int centre = WindowFits::centre(static_cast<int>(c)), reach = WindowFits::kStep / 2;
      const int begin = c == 0 ? 0 : centre - reach, end = c + 1 == cols ? width_ : centre + reach + 1;
      std::fill(slopes_.begin() + begin, slopes_.begin() + end, value);
    }
    const auto last = static_cast<std::size_t>(width_ - 1);
    at_rim_[0] = slopes_[0];
    at_rim_[last] = slopes_[last];
  }

  const WindowFits& fits_;
  std::vector<float> around_, slopes_, at_rim_;
  int width_, height_, current_ = -1;
};

ByteImage copy(const ByteImage& image) {
  ByteImage other(image.width(), image.height());
  std::copy(image.row(0), image.row(image.height()), other.row(0));
  return other;
}

}  // namespace

ByteImage mark_planar_edges(const PlanarImage& image, const WindowFits& fits, const NoiseModel& noise,
                            const DepthOptions& options, int num_threads) {
  const simd::EdgeLimits limits = edge_limits(image, noise, options);
  ByteImage marks(image.width(), image.height());
  const auto mark_edges = simd::mark_edges();
  parallel_blocks(image.height(), rows_per_block(image.width()), num_threads,
                  [&](std::int64_t, std::int64_t begin, std::int64_t end) {
                    SlopeRows slopes(fits, image.width(), image.height());
                    for (auto v = static_cast<int>(begin); v < end; ++v) {
                      mark_edges(image.planar_row(v), limits, slopes.row(v), marks.row(v));
                    }
                  });
  return marks;
}

ByteImage mark_gradient_edges(const DepthRef& measured, const DepthOptions& options, int num_threads) {
  const std::int64_t width = measured.cols(), height = measured.rows();
  // A copy of the outer pixels on either side, and room for vectors beyond.
  const std::int64_t stride = 1 + width + 16;
  const Scratch<float> depth(static_cast<std::size_t>(height * stride));
  const auto row = [&](std::int64_t v) { return depth.data() + v * stride + 1; };
  parallel_for(height, rows_per_block(width), num_threads, [&](std::int64_t v) {
    const float* const source = &measured.coeffRef(v, 0);
    float* const target = row(v);
    for (std::int64_t u = 0; u < width; ++u) {
      target[u] = is_measurement(source[u]) ? source[u] : std::numeric_limits<float>::quiet_NaN();
    }
    target[-1] = target[0];
    std::fill(target + width, target + width + 16, target[width - 1]);
  });
  const auto limit = static_cast<float>(8.0 * options.gradient_threshold);
  ByteImage marks(static_cast<int>(width), static_cast<int>(height));
  const auto mark_gradients = simd::mark_gradients();
  parallel_for(height, rows_per_block(width), num_threads, [&](std::int64_t v) {
    mark_gradients(
        {row(std::max<std::int64_t>(v - 1, 0)), row(v), row(std::min(v + 1, height - 1)), static_cast<int>(width)},
        limit * limit, marks.row(v));
  });
  return marks;
}

ByteImage dilated(const ByteImage& first_marks, int radius, int num_threads) {
  ByteImage marks = copy(first_marks);
  const auto dilate_marks = simd::dilate_marks();
  for (int step = 0; step < radius; ++step) {
    ByteImage grown(marks.width(), marks.height());
    parallel_for(marks.height(), rows_per_block(marks.width()), num_threads,
                 [&](std::int64_t v) { dilate_marks(marks.row(v), marks.stride(), marks.width(), grown.row(v)); });
    marks = std::move(grown);
  }
  return marks;
}

void keep_planar(const PlanarImage& image, const ByteImage& first_marks, const NoiseModel& noise,
                 const DepthOptions& options, int num_threads, ByteImage& marks) {
  if (!(options.planar_keep_sigmas > 0.0)) return;
  static_assert(ByteImage::kBorder >= simd::side_depth && PlanarImage::kBorder >= simd::side_depth);
  const simd::PlanarRule rule = {image.sigma(noise.local()),
                                 image.unit_slope() * static_cast<float>(std::tan(options.max_slant)),
                                 static_cast<float>(options.planar_keep_sigmas * options.planar_keep_sigmas)};
  const auto keep_planar_pixels = simd::keep_planar_pixels();
  for (int step = 0; step <= options.edge_dilation; ++step) {
    ByteImage left_marked(marks.width(), marks.height());
    parallel_for(marks.height(), rows_per_block(marks.width()), num_threads, [&](std::int64_t v) {
      keep_planar_pixels(image.planar_row(static_cast<int>(v)), rule,
                         {marks.row(v), first_marks.row(v), marks.stride()}, left_marked.row(v));
    });
    marks = std::move(left_marked);
  }
}

}  // namespace nacre
