// From depth images to points, and from raw integers to depth.
#include <numeric>

#include "base/check.hpp"
#include "base/parallel.hpp"
#include "camera/ray_table.hpp"
#include "depth/inverse_depth_image.hpp"
#include "nacre/depth.hpp"
#include "simd/depth_points.hpp"

namespace nacre {

DepthImage depth_from_raw(
    const Eigen::Ref<const Eigen::Array<std::uint16_t, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>& raw,
    double depth_scale) {
  require(std::isfinite(depth_scale) && depth_scale > 0.0, "depth_scale", "a positive number of stored units per metre",
          depth_scale);
  DepthImage depth(raw.rows(), raw.cols());
  if (raw.size() == 0) return depth;
  const auto fill_row = simd::fill_depth_row();
  for (Eigen::Index v = 0; v < raw.rows(); ++v) {
    fill_row(&raw.coeffRef(v, 0), static_cast<float>(depth_scale), static_cast<int>(raw.cols()), &depth(v, 0));
  }
  return depth;
}

Points back_project(const DepthRef& depth, const Camera& camera, int num_threads) {
  require_camera_size("depth", depth.rows(), depth.cols(), camera);
  const std::int64_t height = camera.height(), block_size = rows_per_block(camera.width());
  const auto ray_row = [&](std::int64_t v) { return camera.ray_table().row(static_cast<int>(v)); };
  std::vector<std::int64_t> first(static_cast<std::size_t>(height) + 1);
  const auto count = simd::count_points();
  parallel_for(height, block_size, num_threads, [&](std::int64_t v) {
    first[static_cast<std::size_t>(v) + 1] = count(&depth.coeffRef(v, 0), ray_row(v), camera.width());
  });
  std::partial_sum(first.begin(), first.end(), first.begin());
  Points points(first.back(), 3);
  const auto gather = simd::gather_points();
  parallel_for(height, block_size, num_threads, [&](std::int64_t v) {
    const std::int64_t begin = first[static_cast<std::size_t>(v)], end = first[static_cast<std::size_t>(v) + 1];
    gather(&depth.coeffRef(v, 0), ray_row(v), camera.width(), points.data() + 3 * begin, static_cast<int>(end - begin));
  });
  return points;
}

}  // namespace nacre
