#include "depth/pixel_binning.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <vector>

#include "base/parallel.hpp"
#include "depth/coarse_depth.hpp"
#include "depth/inverse_depth_image.hpp"
#include "depth/limits.hpp"

namespace nacre {
namespace {

// From one measured pixel of a row or column to the next, what a third of these distances do not exceed: 1 but where an
// image was spread over more pixels than its camera has, as those of another one.
int pixels_apart(const DepthRef& depth, Eigen::Index step_along, Eigen::Index step_across) {
  const bool is_row = step_along == 1;
  const Eigen::Index length = is_row ? depth.cols() : depth.rows(), lines = is_row ? depth.rows() : depth.cols();
  std::array<std::int64_t, depth_limits::farthest_pixels + 1> counts{};
  std::int64_t num_steps = 0;
  for (Eigen::Index line = 0; line < lines; line += depth_limits::probed_rows) {
    const float* const first = depth.data() + line * step_across;
    Eigen::Index last = -1;
    for (Eigen::Index i = 0; i < length; ++i) {
      if (!is_measurement(first[i * step_along])) continue;
      if (last >= 0 && i - last <= depth_limits::farthest_pixels) {
        ++counts[static_cast<std::size_t>(i - last)];
        ++num_steps;
      }
      last = i;
    }
  }
  int apart = 1;
  for (std::int64_t sum = counts[1]; 3 * sum < num_steps; sum += counts[static_cast<std::size_t>(apart)]) ++apart;
  return apart;
}

// For pixels of which nearly all are measured, or between which gaps are one wide, and will be filled.
int least_binning(const DepthRef& depth) {
  const int along = pixels_apart(depth, 1, depth.outerStride()), down = pixels_apart(depth, depth.outerStride(), 1);
  return std::max(std::min(along, down), (std::max(along, down) + 1) / 2);
}

}  // namespace

int binning_for(const DepthRef& depth, const MaskRef& mask, const Camera& camera) {
  require_camera_size("depth", depth.rows(), depth.cols(), camera);
  if (mask.size() > 0) require_camera_size("mask", mask.rows(), mask.cols(), camera);
  if (camera.model() != Camera::Model::pinhole) return 1;
  std::vector<float> measured;
  for (Eigen::Index v = 0; v < depth.rows(); ++v) {
    for (Eigen::Index u = 0; u < depth.cols(); ++u) {
      const bool is_inside = mask.size() == 0 || mask(v, u) != 0;
      if (is_inside && is_measurement(depth(v, u))) measured.push_back(depth(v, u));
    }
  }
  const std::size_t count = measured.empty() ? static_cast<std::size_t>(depth.size()) : measured.size();
  const double wanted = std::ceil(std::sqrt(static_cast<double>(count) / depth_limits::most_worked_on));
  const int factor =
      std::min({std::max(least_binning(depth), static_cast<int>(wanted)), camera.width(), camera.height()});
  if (factor == 1 || measured.empty()) return factor;
  const auto middle = measured.begin() + static_cast<std::ptrdiff_t>(measured.size() / 2);
  std::nth_element(measured.begin(), middle, measured.end());
  const double depth_of_middle = static_cast<double>(*middle);
  return coarse_unit(depth).at(depth_of_middle) > factor * camera.footprint(depth_of_middle) ? 1 : factor;
}

PixelBinning::PixelBinning(const DepthRef& depth, const Camera& camera, int factor, int num_threads)
    : depth_(depth),
      gate_slope_(depth_limits::gate_slope * static_cast<float>(camera.footprint(1.0) * 0.5 * factor)),
      factor_(factor),
      num_threads_(num_threads),
      binned_(depth.rows() / factor, depth.cols() / factor),
      usual_count_(usual_count()) {
  parallel_blocks(binned_.rows(), rows_per_block(depth_.cols()), num_threads_,
                  [&](std::int64_t, std::int64_t begin, std::int64_t end) {
                    std::vector<float> values;
                    for (Eigen::Index row = begin; row < end; ++row) {
                      for (Eigen::Index col = 0; col < binned_.cols(); ++col) {
                        binned_(row, col) = mean_depth(row, col, values);
                      }
                    }
                  });
}

template <class Visit>
void PixelBinning::for_each_pixel(Eigen::Index row, Eigen::Index col, Visit&& visit) const {
  for (Eigen::Index v = row * factor_; v < (row + 1) * factor_; ++v) {
    const float* const pixels = depth_.data() + v * depth_.outerStride() + col * factor_;
    for (int u = 0; u < factor_; ++u) visit(pixels[u]);
  }
}

// The measured pixels of a block that has any, the median.
int PixelBinning::usual_count() const {
  std::vector<std::int64_t> blocks(static_cast<std::size_t>(factor_ * factor_ + 1), 0);
  std::int64_t num_blocks = 0;
  for (Eigen::Index row = 0; row < binned_.rows(); row += depth_limits::probed_rows) {
    for (Eigen::Index col = 0; col < binned_.cols(); ++col) {
      std::size_t count = 0;
      for_each_pixel(row, col, [&](float z) { count += is_measurement(z); });
      if (count == 0) continue;
      ++blocks[count];
      ++num_blocks;
    }
  }
  int usual = 0;
  for (std::int64_t sum = 0; 2 * sum < num_blocks; sum += blocks[static_cast<std::size_t>(usual)]) ++usual;
  return usual;
}

// Where the pixels differ by more than noise, of those around their median.
float PixelBinning::mean_depth(Eigen::Index row, Eigen::Index col, std::vector<float>& values) const {
  float nearest = std::numeric_limits<float>::infinity(), farthest = 0.0F, sum = 0.0F;
  int count = 0;
  for_each_pixel(row, col, [&](float z) {
    if (!is_measurement(z)) return;
    nearest = std::min(nearest, z);
    farthest = std::max(farthest, z);
    sum += 1.0F / z;
    ++count;
  });
  if (count == 0 || 2 * count < usual_count_) return std::numeric_limits<float>::quiet_NaN();
  if (!(farthest - nearest > gate_slope_ * nearest)) return static_cast<float>(count) / sum;

  values.clear();
  for_each_pixel(row, col, [&](float z) {
    if (is_measurement(z)) values.push_back(z);
  });
  std::sort(values.begin(), values.end());
  const float median = 0.5F * (values[(values.size() - 1) / 2] + values[values.size() / 2]);
  sum = 0.0F;
  count = 0;
  for_each_pixel(row, col, [&](float z) {
    if (!is_measurement(z) || std::abs(z - median) > gate_slope_ * median) return;
    sum += 1.0F / z;
    ++count;
  });
  return count == 0 || 2 * count < usual_count_ ? std::numeric_limits<float>::quiet_NaN()
                                                : static_cast<float>(count) / sum;
}

template <class Visit>
void PixelBinning::for_each_taken(Eigen::Index row, Eigen::Index col, Visit&& visit) const {
  const float mean = binned_(row, col), gate = gate_slope_ * mean;
  for (Eigen::Index v = row * factor_; v < (row + 1) * factor_; ++v) {
    for (Eigen::Index u = col * factor_; u < (col + 1) * factor_; ++u) {
      if (std::abs(depth_(v, u) - mean) <= gate) visit(v, u);
    }
  }
}

// Where no depth was taken, it may yet be filled in: there, of all pixels.
Colors PixelBinning::mean(const Colors& colors) const {
  Colors result = Colors::Zero(binned_.size(), 3);
  parallel_for(binned_.rows(), rows_per_block(depth_.cols()), num_threads_, [&](Eigen::Index row) {
    for (Eigen::Index col = 0; col < binned_.cols(); ++col) {
      std::array<int, 3> sum{};
      int count = 0;
      const auto add = [&](Eigen::Index v, Eigen::Index u) {
        const std::uint8_t* color = colors.data() + 3 * (v * depth_.cols() + u);
        for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += color[k];
        ++count;
      };
      for_each_taken(row, col, add);
      if (count == 0) {
        for (int pixel = 0; pixel < factor_ * factor_; ++pixel) {
          add(row * factor_ + pixel / factor_, col * factor_ + pixel % factor_);
        }
      }
      for (int k = 0; k < 3; ++k) {
        result(row * binned_.cols() + col, k) =
            static_cast<std::uint8_t>((sum[static_cast<std::size_t>(k)] + count / 2) / count);
      }
    }
  });
  return result;
}

Attributes PixelBinning::mean(const Attributes& values) const {
  Attributes result(binned_.size(), values.cols());
  parallel_for(binned_.rows(), rows_per_block(depth_.cols()), num_threads_, [&](Eigen::Index row) {
    for (Eigen::Index col = 0; col < binned_.cols(); ++col) {
      for (Eigen::Index channel = 0; channel < values.cols(); ++channel) {
        float sum = 0.0F, count = 0.0F;
        for_each_taken(row, col, [&](Eigen::Index v, Eigen::Index u) {
          const float value = values(v * depth_.cols() + u, channel);
          if (!std::isfinite(value)) return;
          sum += value;
          count += 1.0F;
        });
        result(row * binned_.cols() + col, channel) = sum / count;  // NaN where there is none
      }
    }
  });
  return result;
}

MaskImage PixelBinning::commonest(const MaskImage& levels) const {
  MaskImage result = MaskImage::Zero(binned_.rows(), binned_.cols());
  parallel_for(binned_.rows(), rows_per_block(depth_.cols()), num_threads_, [&](Eigen::Index row) {
    for (Eigen::Index col = 0; col < binned_.cols(); ++col) {
      std::array<int, 256> counts{};
      int most = 0;
      for_each_taken(row, col, [&](Eigen::Index v, Eigen::Index u) {
        const std::uint8_t level = levels(v, u);
        if (++counts[level] <= most) return;
        most = counts[level];
        result(row, col) = level;
      });
    }
  });
  return result;
}

MaskImage PixelBinning::majority(const MaskImage& mask) const {
  MaskImage result(binned_.rows(), binned_.cols());
  for (Eigen::Index row = 0; row < result.rows(); ++row) {
    for (Eigen::Index col = 0; col < result.cols(); ++col) {
      const auto block = mask.block(row * factor_, col * factor_, factor_, factor_);
      result(row, col) = 2 * (block != 0).count() >= block.size() ? 1 : 0;
    }
  }
  return result;
}

}  // namespace nacre
