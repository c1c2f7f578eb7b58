#include "simulation/box_sums.hpp"

#include <algorithm>

#include "base/numbers.hpp"
#include "base/parallel.hpp"

namespace nacre {
namespace {

constexpr std::int64_t block_size = 16;

void sum_line(PixelSums& image, std::size_t first, std::size_t step, PixelSums& line, std::int64_t radius) {
  const auto count = static_cast<std::int64_t>(line.size());
  for (std::size_t i = 0; i < line.size(); ++i) line[i] = image[first + i * step];
  PixelSum sum = PixelSum::Zero();
  for (std::int64_t i = 0; i < std::min(radius, count); ++i) sum += line[as_size(i)];
  for (std::int64_t i = 0; i < count; ++i) {
    if (i + radius < count) sum += line[as_size(i + radius)];
    if (i - radius > 0) sum -= line[as_size(i - radius - 1)];
    image[first + as_size(i) * step] = sum;
  }
}

}  // namespace

void sum_boxes(PixelSums& image, std::int64_t width, std::int64_t radius, int num_threads) {
  const std::int64_t height = static_cast<std::int64_t>(image.size()) / width;
  parallel_blocks(height, block_size, num_threads, [&](std::int64_t, std::int64_t begin, std::int64_t end) {
    PixelSums line(as_size(width));
    for (std::int64_t v = begin; v < end; ++v) sum_line(image, as_size(v * width), 1, line, radius);
  });
  parallel_blocks(width, block_size, num_threads, [&](std::int64_t, std::int64_t begin, std::int64_t end) {
    PixelSums line(as_size(height));
    for (std::int64_t u = begin; u < end; ++u) sum_line(image, as_size(u), as_size(width), line, radius);
  });
}

}  // namespace nacre
