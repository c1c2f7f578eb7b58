#include "keypoints/keypoints.hpp"

#include <algorithm>
#include <cmath>

#include "base/parallel.hpp"
#include "base/random.hpp"
#include "keypoints/limits.hpp"

namespace nacre {
namespace {

using namespace keypoints_limits;

// The smaller eigenvalue of the structure tensor of each pixel's window (Shi and Tomasi 1994).
Values corner_strength(const std::vector<std::uint8_t>& brightness, int width, int height, int num_threads) {
  const int r = tensor_radius;
  Values strength = Values::Zero(static_cast<Eigen::Index>(width) * height);
  if (std::min(width, height) < 2 * (r + 1)) return strength;
  parallel_blocks(height - 2 * (r + 1), 16, num_threads, [&](auto, std::int64_t begin, std::int64_t end) {
    const auto num_rows = static_cast<Eigen::Index>(end - begin) + 2 * r;
    // Products of gradients of the rows, then their sums over windows.
    Eigen::ArrayXXf xx = Eigen::ArrayXXf::Zero(width, num_rows), xy = xx, yy = xx;
    for (Eigen::Index row = 0; row < num_rows; ++row) {
      const std::uint8_t* here = brightness.data() + (begin + 1 + row) * width;
      for (int u = 1; u + 1 < width; ++u) {
        const auto x = static_cast<float>(here[u + 1] - here[u - 1]);
        const auto y = static_cast<float>(here[u + width] - here[u - width]);
        xx(u, row) = x * x;
        xy(u, row) = x * y;
        yy(u, row) = y * y;
      }
    }
    const int inside = width - 2 * r;
    const auto sum = [&](const Eigen::ArrayXXf& products, Eigen::Index row) {
      Eigen::ArrayXf down = products.middleCols(row, 2 * r + 1).rowwise().sum();
      Eigen::ArrayXf across = down.head(inside);
      for (int k = 1; k <= 2 * r; ++k) across += down.segment(k, inside);
      return across;
    };
    for (Eigen::Index row = 0; row < num_rows - 2 * r; ++row) {
      const Eigen::ArrayXf a = sum(xx, row), b = sum(xy, row), c = sum(yy, row);
      strength.segment((begin + row + r + 1) * width + r, inside) =
          0.5F * (a + c - ((a - c).square() + 4.0F * b.square()).sqrt());
    }
  });
  return strength;
}

// Whether none of the eight pixels around is as strong; of equals the first is.
bool is_peak(const Values& strength, std::int32_t pixel, int width) {
  for (const int offset : {-width - 1, -width, -width + 1, -1}) {
    if (strength[pixel + offset] >= strength[pixel] || strength[pixel - offset] > strength[pixel]) return false;
  }
  return true;
}

// The strongest peak of each cell that has a depth, strongest first.
std::vector<std::int32_t> strongest_pixels(const Values& strength, const DepthView& view, int width, int height) {
  std::vector<std::int32_t> pixels;
  float strongest = 0.0F;
  for (int top = 0; top < height; top += cell_size) {
    for (int left = 0; left < width; left += cell_size) {
      std::int32_t best = -1;
      for (int v = top; v < std::min(top + cell_size, height); ++v) {
        for (int u = left; u < std::min(left + cell_size, width); ++u) {
          const std::int32_t pixel = v * width + u;
          if (!(strength[pixel] > (best < 0 ? 0.0F : strength[best])) || !std::isfinite(view.depth[pixel])) continue;
          if (is_peak(strength, pixel, width)) best = pixel;
        }
      }
      if (best < 0) continue;
      pixels.push_back(best);
      strongest = std::max(strongest, strength[best]);
    }
  }
  const auto is_weak = [&](std::int32_t pixel) {
    return strength[pixel] < static_cast<float>(least_strength) * strongest;
  };
  pixels.erase(std::remove_if(pixels.begin(), pixels.end(), is_weak), pixels.end());
  std::stable_sort(pixels.begin(), pixels.end(),
                   [&](std::int32_t a, std::int32_t b) { return strength[a] > strength[b]; });
  if (pixels.size() > most_keypoints) pixels.resize(most_keypoints);
  return pixels;
}

// Of any rectangle, from the sums up to each pixel (Crow 1984).
class BrightnessSums {
 public:
  BrightnessSums(const std::vector<std::uint8_t>& brightness, int width, int height)
      : stride_(width + 1), sums_(static_cast<std::size_t>(stride_) * static_cast<std::size_t>(height + 1)) {
    for (int v = 0; v < height; ++v) {
      std::uint32_t row = 0;
      for (int u = 0; u < width; ++u) {
        row += brightness[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u)];
        sums_[at(u + 1, v + 1)] = sums_[at(u + 1, v)] + row;
      }
    }
  }
  // Of the square around a pixel; sums wrap, differences of them do not.
  std::uint32_t around(int u, int v, int radius) const {
    const int left = u - radius, right = u + radius + 1, top = v - radius, bottom = v + radius + 1;
    return sums_[at(right, bottom)] - sums_[at(left, bottom)] - sums_[at(right, top)] + sums_[at(left, top)];
  }

 private:
  std::size_t at(int u, int v) const {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(stride_) + static_cast<std::size_t>(u);
  }
  int stride_;
  std::vector<std::uint32_t> sums_;
};

struct Window {
  int u, v;
  float radius;  // [pixel]

  // Of the squares whose brightness is compared.
  int blur() const { return std::max(1, static_cast<int>(radius / static_cast<float>(blur_parts))); }
  bool is_inside(int width, int height) const {
    const int reach = static_cast<int>(std::ceil(radius)) + blur() + 1;
    return u >= reach && v >= reach && u + reach < width && v + reach < height;
  }
  std::uint32_t brightness(const BrightnessSums& sums, const Eigen::Vector2f& place) const {
    const Eigen::Vector2f offset = radius * place;
    return sums.around(u + static_cast<int>(std::lround(offset.x())), v + static_cast<int>(std::lround(offset.y())),
                       blur());
  }
};

using PlacePairs = std::array<std::array<Eigen::Vector2f, 2>, 256>;

// Of places in a disk of radius 1.
PlacePairs random_pairs() {
  PlacePairs pairs;
  std::uint64_t counter = 0;
  for (auto& pair : pairs) {
    for (Eigen::Vector2f& place : pair) {
      do {
        place.x() = static_cast<float>(pair_spread * random_normal(0, counter++));
        place.y() = static_cast<float>(pair_spread * random_normal(0, counter++));
      } while (place.norm() > 1.0F);
    }
  }
  return pairs;
}

// Where the window is brighter, as a unit vector (Rosin 1999: the intensity centroid).
Eigen::Vector2f bright_side(const Window& window, const BrightnessSums& sums) {
  Eigen::Vector2f moment = Eigen::Vector2f::Zero();
  for (int i = -disk_steps; i <= disk_steps; ++i) {
    for (int j = -disk_steps; j <= disk_steps; ++j) {
      const Eigen::Vector2f place = Eigen::Vector2f(static_cast<float>(j), static_cast<float>(i)) / disk_steps;
      if (place.norm() <= 1.0F) moment += static_cast<float>(window.brightness(sums, place)) * place;
    }
  }
  return moment.norm() > 0.0F ? Eigen::Vector2f(moment.normalized()) : Eigen::Vector2f::UnitX();
}

Descriptor describe(const Window& window, const BrightnessSums& sums, const PlacePairs& pairs) {
  const Eigen::Vector2f x = bright_side(window, sums), y(-x.y(), x.x());
  Descriptor bits = {};
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto bright = [&](const Eigen::Vector2f& place) {
      return window.brightness(sums, place.x() * x + place.y() * y);
    };
    if (bright(pairs[i][0]) < bright(pairs[i][1])) bits[i / 64] |= std::uint64_t{1} << (i % 64);
  }
  return bits;
}

}  // namespace

int num_differing(const Descriptor& a, const Descriptor& b) {
  int count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) count += __builtin_popcountll(a[i] ^ b[i]);
  return count;
}

Keypoints find_keypoints(const DepthView& view, const Camera& camera, double usual_depth, int num_threads) {
  const int width = camera.width(), height = camera.height();
  Keypoints found;
  if (view.brightness.empty() || !(usual_depth > 0.0)) return found;
  const Values strength = corner_strength(view.brightness, width, height, num_threads);
  std::vector<Window> windows;
  for (const std::int32_t pixel : strongest_pixels(strength, view, width, height)) {
    const double zoom = std::clamp(usual_depth / view.depth[pixel], 1.0 / largest_zoom, largest_zoom);
    const Window window{pixel % width, pixel / width, static_cast<float>(window_radius * zoom)};
    if (window.is_inside(width, height)) windows.push_back(window);
  }
  static const PlacePairs pairs = random_pairs();
  const BrightnessSums sums(view.brightness, width, height);
  const auto count = static_cast<std::int64_t>(windows.size());
  found.points.resize(count, 3);
  found.descriptors.resize(windows.size());
  parallel_for(count, 16, num_threads, [&](std::int64_t i) {
    const Window& window = windows[static_cast<std::size_t>(i)];
    found.points.row(i) = point_at(view, camera, window.u, window.v);
    found.descriptors[static_cast<std::size_t>(i)] = describe(window, sums, pairs);
  });
  return found;
}

}  // namespace nacre
