#include "tracking/residual_noise.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "depth/limits.hpp"
#include "tracking/limits.hpp"

namespace nacre {

using namespace tracking_limits;

void ResidualNoise::add(double residual_sigmas, bool tells) {
  ++num_frames_;
  if (!(residual_sigmas > 0.0) || (has_told_ && !tells)) return;
  if (tells && !std::exchange(has_told_, true)) count_ = 0.0;
  count_ = std::min(count_ + 1.0, depth_limits::most_frames);
  log_scale_ += (std::log(residual_sigmas) - log_scale_) / count_;
}

double ResidualNoise::factor() const {
  return count_ > 0.0 ? std::clamp(noise_per_residual * std::exp(log_scale_), 1.0, largest_noise_factor) : 1.0;
}

bool ResidualNoise::is_known() const { return has_told() && static_cast<double>(num_frames_) >= enough_frames; }

}  // namespace nacre
