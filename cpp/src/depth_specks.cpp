// Pixels of a cleaned depth image that too few others support.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "depth_cleaning.hpp"
#include "parallel.hpp"

namespace nacre {
namespace {

std::int32_t find_root(std::vector<std::int32_t>& parent, std::int32_t i) {
  while (parent[static_cast<std::size_t>(i)] != i) {
    std::int32_t& up = parent[static_cast<std::size_t>(i)];
    up = parent[static_cast<std::size_t>(up)];
    i = up;
  }
  return i;
}

}  // namespace

Marks mark_lonely(int width, int height, const Marks& keep, double max_missing, int num_threads) {
  constexpr int radius = 2;
  Marks marks(keep.size());
  const auto pixel = [width](std::int64_t v, std::int64_t u) { return static_cast<std::size_t>(v * width + u); };
  parallel_blocks(height, rows_per_block(width), num_threads, [&](std::int64_t, std::int64_t begin, std::int64_t end) {
    std::vector<int> column(static_cast<std::size_t>(width + 2 * radius));
    for (std::int64_t v = begin; v < end; ++v) {
      const std::int64_t top = std::max<std::int64_t>(v - radius, 0);
      const std::int64_t bottom = std::min<std::int64_t>(v + radius, height - 1);
      std::fill(column.begin(), column.end(), 0);
      for (std::int64_t row = top; row <= bottom; ++row) {
        for (int u = 0; u < width; ++u) column[static_cast<std::size_t>(u + radius)] += keep[pixel(row, u)];
      }
      for (int u = 0; u < width; ++u) {
        const int columns = std::min(u + radius, width - 1) - std::max(u - radius, 0) + 1;
        const int neighbours = columns * static_cast<int>(bottom - top + 1) - 1;
        const int* const window = column.data() + u;
        const int present = window[0] + window[1] + window[2] + window[3] + window[4] - 1;
        marks[pixel(v, u)] = keep[pixel(v, u)] & (neighbours - present > max_missing * neighbours);
      }
    }
  });
  return marks;
}

Marks mark_specks(const PlanarImage& image, const NoiseModel& noise, const DepthOptions& options, const Marks& keep) {
  const int width = image.width(), height = image.height();
  const Quadratic step_noise = image.sigma(noise) * (3.0F * std::sqrt(2.0F));
  const Quadratic step_slant = image.unit_slope() * static_cast<float>(std::tan(options.max_slant));
  const auto connected = [&](float a, float b) { return std::abs(a - b) <= step_noise(a) + step_slant(a); };

  // Runs of connected pixels along the rows, joined across rows.
  std::vector<std::int32_t> run_of(keep.size(), -1), parent, run_size;
  for (int v = 0; v < height; ++v) {
    const float* const row = image.row(v);
    const float* const above = row - image.stride();
    const std::size_t first = static_cast<std::size_t>(v) * static_cast<std::size_t>(width);
    for (int u = 0; u < width; ++u) {
      const std::size_t i = first + static_cast<std::size_t>(u);
      if (!keep[i]) continue;
      if (u > 0 && keep[i - 1] && connected(row[u], row[u - 1])) {
        run_of[i] = run_of[i - 1];
      } else {
        run_of[i] = static_cast<std::int32_t>(parent.size());
        parent.push_back(run_of[i]);
        run_size.push_back(0);
      }
      ++run_size[static_cast<std::size_t>(run_of[i])];
      if (v == 0) continue;
      const std::size_t up = i - static_cast<std::size_t>(width);
      if (!keep[up] || parent[static_cast<std::size_t>(run_of[up])] == parent[static_cast<std::size_t>(run_of[i])])
        continue;
      if (!connected(row[u], above[u])) continue;
      const std::int32_t a = find_root(parent, run_of[up]), b = find_root(parent, run_of[i]);
      parent[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    }
  }
  std::vector<std::int64_t> size(parent.size(), 0);
  for (std::size_t run = 0; run < parent.size(); ++run) {
    parent[run] = find_root(parent, static_cast<std::int32_t>(run));
    size[static_cast<std::size_t>(parent[run])] += run_size[run];
  }
  Marks marks(keep.size());
  for (std::size_t i = 0; i < keep.size(); ++i) {
    marks[i] =
        keep[i] && size[static_cast<std::size_t>(parent[static_cast<std::size_t>(run_of[i])])] < options.min_component;
  }
  return marks;
}

}  // namespace nacre
