#include "fusion/observer.hpp"

#include <algorithm>
#include <cmath>

#include "base/limits.hpp"
#include "base/parallel.hpp"
#include "base/statistics.hpp"
#include "camera/ray_table.hpp"
#include "depth/depth_view.hpp"
#include "fusion/limits.hpp"

namespace nacre {
namespace {

constexpr int border = simd::largest_window;

}  // namespace

float median_sigma(const Frame& frame) {
  if (frame.valid.empty()) return 0.0F;
  const std::size_t step = std::max<std::size_t>(1, frame.valid.size() / fusion_limits::sigma_probes);
  std::vector<float> values;
  for (std::size_t i = 0; i < frame.valid.size(); i += step) values.push_back(frame.sigma[frame.valid[i]]);
  return median_of(std::move(values));
}

SurfaceObserver::SurfaceObserver(const Camera& camera, const FusionOptions& options)
    : camera_(camera),
      options_(options),
      width_(camera.width()),
      height_(camera.height()),
      tiles_across_((camera.width() + tile_size - 1) / tile_size),
      least_cosine_(static_cast<float>(std::cos(options.max_angle))) {}

void SurfaceObserver::look_at(const Frame& frame, const ColorsRef& colors, int num_threads) {
  constexpr int right_border = border + tile_size + 2;
  const std::int64_t stride = border + width_ + right_border, rows = height_ + 2 * border;
  const int num_planes = colors.rows() > 0 ? 10 : 7;
  // The borders are zeros from the first frame on.
  planes_.resize(static_cast<std::size_t>(num_planes * rows * stride), 0.0F);
  const auto plane = [&](int index) { return planes_.data() + (index * rows + border) * stride + border; };
  const simd::SurfaceRow out = {plane(0), plane(1), plane(2), plane(3), plane(4), plane(5), plane(6)};
  image_ = {out.x,      out.y,   out.z,   out.normal_x, out.normal_y, out.normal_z,
            out.weight, nullptr, nullptr, nullptr,      stride};
  if (colors.rows() > 0) {
    image_.red = plane(7);
    image_.green = plane(8);
    image_.blue = plane(9);
  }

  reference_sigma_ =
      options_.reference_sigma > 0.0 ? static_cast<float>(options_.reference_sigma) : median_sigma(frame);
  const auto fill_row = simd::fill_surface_row();
  parallel_for(height_, 16, num_threads, [&](std::int64_t v) {
    const std::int64_t first = v * width_, to = v * stride;
    fill_row(
        {width_, frame.points.data() + 3 * first, frame.normals.data() + 3 * first, frame.sigma.data() + first},
        reference_sigma_, camera_.model() == Camera::Model::orthographic,
        {out.x + to, out.y + to, out.z + to, out.normal_x + to, out.normal_y + to, out.normal_z + to, out.weight + to});
    if (colors.rows() == 0) return;
    for (std::int64_t u = 0; u < width_; ++u) {
      for (int channel = 0; channel < 3; ++channel) plane(7 + channel)[to + u] = colors(first + u, channel);
    }
  });
  summarise(num_threads);
}

void SurfaceObserver::summarise(int num_threads) {
  const int tiles_down = (height_ + tile_size - 1) / tile_size;
  tiles_.resize(static_cast<std::size_t>(tiles_across_ * tiles_down));
  parallel_for(tiles_down, 1, num_threads, [&](std::int64_t row) {
    for (int column = 0; column < tiles_across_; ++column) {
      Tile& tile = tiles_[static_cast<std::size_t>(row * tiles_across_ + column)];
      const int first_u = column * tile_size - border, first_v = static_cast<int>(row) * tile_size - border;
      const int last_v = std::min(first_v + tile_size + 2 * border, height_ + border);
      simd::summarise_pixels()(image_, first_v * image_.stride + first_u, tile_size + 2 * border, last_v - first_v,
                               &tile.nearest, &tile.farthest, &tile.largest_weight);
    }
  });
}

bool SurfaceObserver::may_observe(const Eigen::Vector3f& point, std::int32_t pixel, float sigma,
                                  float least_weight) const {
  const Tile& tile =
      tiles_[static_cast<std::size_t>(pixel / width_ / tile_size * tiles_across_ + pixel % width_ / tile_size)];
  const float radius = support(sigma, static_cast<float>(camera_.footprint(point.z())));
  const float reach = radius + std::max(radius, base_limits::noise_sigmas * sigma);
  const bool is_in_range = point.z() > tile.nearest - reach && point.z() < tile.farthest + reach;
  const float largest_sum = static_cast<float>(PixelWindow::size * PixelWindow::size) * tile.largest_weight;
  return is_in_range && largest_sum > least_weight;
}

Eigen::Vector3f SurfaceObserver::towards_camera(const Eigen::Vector3f& point) const {
  if (camera_.model() == Camera::Model::orthographic) return {0.0F, 0.0F, -1.0F};
  return -point.normalized();
}

float SurfaceObserver::support(float sigma, float footprint) const {
  if (options_.support > 0.0) return static_cast<float>(options_.support);
  return std::clamp(fusion_limits::support_sigmas * sigma, fusion_limits::least_support * footprint,
                    fusion_limits::largest_support * footprint);
}

void SurfaceObserver::add(ObservationBlock& block, const Eigen::Vector3f& point, const Eigen::Vector3f& normal,
                          std::int32_t pixel, float sigma, float spacing) const {
  const auto footprint = static_cast<float>(camera_.footprint(point.z()));
  const float radius = support(sigma, footprint), reach = std::max(radius, spacing);
  const int i = block.count_++;
  block.x_[i] = point.x();
  block.y_[i] = point.y();
  block.z_[i] = point.z();
  block.normal_x_[i] = normal.x();
  block.normal_y_[i] = normal.y();
  block.normal_z_[i] = normal.z();
  const Eigen::Vector3f back = towards_camera(point);
  const Eigen::Vector3f ray = back / std::max(normal.dot(back), fusion_limits::least_facing);
  block.ray_x_[i] = ray.x();
  block.ray_y_[i] = ray.y();
  block.ray_z_[i] = ray.z();
  block.sigma_[i] = sigma;
  block.radius_[i] = radius;
  block.largest_offset_[i] = std::max(radius, base_limits::noise_sigmas * sigma);
  block.spacing_[i] = spacing;
  constexpr auto least = static_cast<float>(simd::paired_window), largest = static_cast<float>(simd::largest_window);
  const int window = static_cast<int>(std::ceil(std::clamp(reach / footprint, least, largest)));
  // As many pixels on each side of the point, which is beside the middle of its own.
  const int u = pixel % width_, v = pixel / width_;
  const simd::RayRow rays = camera_.ray_table().row(v);
  const float ray_y = rays.y ? rays.y[u] : rays.row_y, depth = point.z() / rays.z[u];
  const bool is_left = point.x() < rays.origin_x[u] + depth * rays.x[u];
  const bool is_above = point.y() < rays.origin_y + depth * ray_y;
  block.first_u_[i] = u - window + (is_left ? 0 : 1);
  block.first_v_[i] = v - window + (is_above ? 0 : 1);
  block.window_[i] = window;
}

PixelWindow ObservationBlock::cover(int i) const {
  PixelWindow window{first_u_[i], first_v_[i], 2 * window_[i], {}};
  std::copy_n(cover_rows_ + PixelWindow::size * i, window.num_rows, window.rows);
  return window;
}

void SurfaceObserver::observe(ObservationBlock& block) const {
  float* const colors[3] = {block.red_, block.green_, block.blue_};
  observe(block, image_, colors, nullptr);
}

void SurfaceObserver::observe_and_cover(ObservationBlock& block, float least_cosine) const {
  for (int i = 0; i < block.count_; ++i) {
    block.cover_offset_[i] = std::max(block.spacing_[i], base_limits::noise_sigmas * block.sigma_[i]);
  }
  const simd::WindowCover cover = {block.spacing_, block.cover_offset_, least_cosine, block.cover_rows_};
  float* const colors[3] = {block.red_, block.green_, block.blue_};
  observe(block, image_, colors, &cover);
}

void SurfaceObserver::observe_planes(ObservationBlock& block, const float* planes, float* average) const {
  const std::int64_t first = plane_offset(0, 0);
  simd::SurfaceImage image = image_;
  image.red = planes + first;
  image.green = image.red + plane_size();
  image.blue = image.green + plane_size();
  constexpr int capacity = ObservationBlock::capacity;
  float* const channels[3] = {average, average + capacity, average + 2 * capacity};
  observe(block, image, channels, nullptr);
}

void SurfaceObserver::observe(ObservationBlock& b, const simd::SurfaceImage& image, float* const channels[3],
                              const simd::WindowCover* cover) const {
  if (image.red == nullptr) {
    for (int c = 0; c < 3; ++c) std::fill_n(channels[c], b.count_, 0.0F);
  }
  simd::observe_windows()(image,
                          {b.count_, b.x_, b.y_, b.z_, b.normal_x_, b.normal_y_, b.normal_z_, b.ray_x_, b.ray_y_,
                           b.ray_z_, b.first_u_, b.first_v_, b.window_, b.radius_, b.largest_offset_},
                          least_cosine_,
                          {b.weight_, b.offset_, b.seen_normal_x_, b.seen_normal_y_, b.seen_normal_z_, channels[0],
                           channels[1], channels[2]},
                          cover);
  for (int i = 0; i < b.count_; ++i) {  // what overflows says nothing
    if (!std::isfinite(b.offset_[i])) b.weight_[i] = b.offset_[i] = 0.0F;
  }
}

bool SurfaceObserver::sees_through(const Eigen::Vector3f& point, std::int32_t pixel, float margin) const {
  const int u = pixel % width_, v = pixel / width_;
  if (u < 1 || v < 1 || u + 1 >= width_ || v + 1 >= height_) return false;
  for (int y = v - 1; y <= v + 1; ++y) {
    for (int x = u - 1; x <= u + 1; ++x) {
      const float behind = image_.z[y * image_.stride + x] - point.z();
      if (visibility(behind, margin) != Visibility::seen_through) return false;
    }
  }
  return true;
}

}  // namespace nacre
