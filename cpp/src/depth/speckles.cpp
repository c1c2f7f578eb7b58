// Pixels of a cleaned depth image that too few others support.
#include "depth/speckles.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "base/limits.hpp"
#include "base/parallel.hpp"
#include "simd/depth_keep.hpp"

#ifdef _MSC_VER
#include <intrin.h>
#endif

namespace nacre {
namespace {

using Word = std::uint64_t;
constexpr int kWordBits = 64;

int lowest_bit(Word word) {
#ifdef _MSC_VER
  unsigned long index;
  _BitScanForward64(&index, word);
  return static_cast<int>(index);
#else
  return __builtin_ctzll(word);
#endif
}

// visit(index) for each bit that is set, ascending; word k of the bits is word_at(k).
template <class WordAt, class Visit>
void for_each_bit(std::size_t num_words, WordAt&& word_at, Visit&& visit) {
  for (std::size_t k = 0; k < num_words; ++k) {
    for (Word word = word_at(k); word != 0; word &= word - 1) {
      visit(static_cast<std::int32_t>(k) * kWordBits + lowest_bit(word));
    }
  }
}

// Connected pixels of one row.
struct Run {
  std::int32_t first, last;
  std::int32_t parent;  // the run's own index where it stands for a component
  std::int32_t size;    // of the component
};

// How the pixels of an image are connected, row by row: see simd::Links.
class PixelLinks {
 public:
  PixelLinks(int width, int height)
      : num_words_(static_cast<std::size_t>((width + kWordBits - 1) / kWordBits)),
        words_(3 * num_words_ * static_cast<std::size_t>(height)) {}

  std::size_t num_words() const { return num_words_; }
  simd::Links row(std::int64_t v) {
    Word* const first = words_.data() + 3 * static_cast<std::size_t>(v) * num_words_;
    return {first, first + num_words_, first + 2 * num_words_};
  }

 private:
  std::size_t num_words_;
  Scratch<Word> words_;
};

class Components {
 public:
  void add_row(const simd::Links& row, const simd::Links* above, std::size_t num_words) {
    const std::size_t first_above = first_of_row_, first = runs_.size();
    first_of_row_ = first;
    row_begin_.push_back(first);
    // A run starts where there is no link to the left, and ends where the next pixel has none.
    for_each_bit(
        num_words, [&](std::size_t k) { return row.kept[k] & ~row.left[k]; },
        [&](std::int32_t u) { runs_.push_back({u, u, static_cast<std::int32_t>(runs_.size()), 0}); });
    std::size_t run = first;
    for_each_bit(
        num_words,
        [&](std::size_t k) {
          const Word next = k + 1 < num_words ? row.left[k + 1] << (kWordBits - 1) : 0;
          return row.kept[k] & ~(row.left[k] >> 1 | next);
        },
        [&](std::int32_t u) { runs_[run++].last = u; });
    if (above == nullptr) return;
    // One link between two runs is enough: those whose left neighbour links the same two say nothing new.
    std::size_t here = first, there = first_above;
    for_each_bit(
        num_words,
        [&](std::size_t k) {
          const Word before = row.above[k] << 1 | (k > 0 ? row.above[k - 1] >> (kWordBits - 1) : 0);
          return row.above[k] & ~(before & row.left[k] & above->left[k]);
        },
        [&](std::int32_t u) {
          while (runs_[here].last < u) ++here;
          while (runs_[there].last < u) ++there;
          unite(static_cast<std::int32_t>(here), static_cast<std::int32_t>(there));
        });
  }

  // Clears the pixels of components with fewer than min_size.
  void drop_small(std::int32_t min_size, ByteImage& keep) {
    for (Run& run : runs_) {
      run.parent = root(run.parent);
      runs_[static_cast<std::size_t>(run.parent)].size += run.last - run.first + 1;
    }
    row_begin_.push_back(runs_.size());
    for (std::size_t v = 0; v + 1 < row_begin_.size(); ++v) {
      std::uint8_t* const row = keep.row(static_cast<std::int64_t>(v));
      for (std::size_t i = row_begin_[v]; i < row_begin_[v + 1]; ++i) {
        const Run& run = runs_[i];
        if (runs_[static_cast<std::size_t>(run.parent)].size >= min_size) continue;
        std::fill(row + run.first, row + run.last + 1, std::uint8_t{0});
      }
    }
  }

 private:
  std::int32_t root(std::int32_t i) {
    for (;;) {
      std::int32_t& parent = runs_[static_cast<std::size_t>(i)].parent;
      if (parent == i) return i;
      parent = runs_[static_cast<std::size_t>(parent)].parent;
      i = parent;
    }
  }

  void unite(std::int32_t a, std::int32_t b) {
    a = root(a);
    b = root(b);
    runs_[static_cast<std::size_t>(std::max(a, b))].parent = std::min(a, b);
  }

  std::vector<Run> runs_;
  std::vector<std::size_t> row_begin_;
  std::size_t first_of_row_ = 0;
};

// The kept pixels, itself included, that a pixel needs in its window, for windows of so many pixels.
std::uint8_t least_kept(int window, double max_missing) {
  const int neighbours = window - 1;
  int present = 0;
  while (neighbours - present > max_missing * neighbours) ++present;
  return static_cast<std::uint8_t>(present + 1);
}

}  // namespace

void remove_isolated(double max_missing, int num_threads, ByteImage& keep) {
  constexpr int radius = 2, side = 2 * radius + 1;
  const int width = keep.width(), height = keep.height();
  const auto span = [](std::int64_t i, int size) {
    return static_cast<int>(std::min<std::int64_t>(i + radius, size - 1) - std::max<std::int64_t>(i - radius, 0) + 1);
  };
  std::array<std::vector<std::uint8_t>, side + 1> least;  // of each column, by the number of the window's rows
  for (int rows = 1; rows <= side; ++rows) {
    std::vector<std::uint8_t>& columns = least[static_cast<std::size_t>(rows)];
    columns.assign(static_cast<std::size_t>(width), least_kept(rows * side, max_missing));
    for (int u = 0; u < width; ++u) {
      if (u >= radius && u + radius < width) u = width - radius;
      columns[static_cast<std::size_t>(u)] = least_kept(rows * span(u, width), max_missing);
    }
  }
  ByteImage still_kept(width, height);
  const auto drop_in_row = simd::remove_isolated();
  parallel_for(height, rows_per_block(width), num_threads, [&](std::int64_t v) {
    drop_in_row(keep.row(v), keep.stride(), least[static_cast<std::size_t>(span(v, height))].data(), width,
                still_kept.row(v));
  });
  keep = std::move(still_kept);
}

void remove_speckles(const PlanarImage& image, const NoiseModel& noise, const DepthOptions& options, int num_threads,
                     ByteImage& keep) {
  if (options.min_component <= 1) return;
  const simd::LinkRule rule = {image.sigma(noise.local()) * (base_limits::noise_sigmas * std::sqrt(2.0F)),
                               image.unit_slope() * static_cast<float>(std::tan(options.max_slant))};
  PixelLinks links(keep.width(), keep.height());
  const auto link_row = simd::link_pixels();
  parallel_for(keep.height(), rows_per_block(keep.width()), num_threads, [&](std::int64_t v) {
    link_row(image.planar_row(static_cast<int>(v)), rule, keep.row(v), keep.stride(), links.row(v));
  });

  Components components;
  for (int v = 0; v < keep.height(); ++v) {
    const simd::Links row = links.row(v), above = links.row(std::max(v - 1, 0));
    components.add_row(row, v > 0 ? &above : nullptr, links.num_words());
  }
  components.drop_small(options.min_component, keep);
}

}  // namespace nacre
