#include <cmath>
#include <limits>
#include <vector>

#include "base/random.hpp"
#include "consolidation/point_blocks.hpp"
#include "doctest/doctest.h"
#include "nacre/types.hpp"
#include "simd/wlop_pair_sums.hpp"

using namespace nacre;
using simd::PairSums;

namespace {

struct InstructionSet {
  const char* name;
  simd::SumPairs* sum_pairs;
  simd::WeighPairs* weigh_pairs;
  simd::VisitBlocks* visit_blocks;
};

std::vector<InstructionSet> instruction_sets() {
  std::vector<InstructionSet> sets = {
      {"baseline", simd::baseline::sum_pairs, simd::baseline::weigh_pairs, simd::baseline::visit_blocks}};
#ifdef NACRE_SIMD_X86
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
    sets.push_back({"avx2", simd::avx2::sum_pairs, simd::avx2::weigh_pairs, simd::avx2::visit_blocks});
  }
  if (__builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq")) {
    sets.push_back({"avx512", simd::avx512::sum_pairs, simd::avx512::weigh_pairs, simd::avx512::visit_blocks});
  }
#endif
  return sets;
}

PointsDouble noisy_sheet(int count, std::uint64_t seed) {
  PointsDouble points(count, 3);
  for (int i = 0; i < count; ++i) {
    const auto counter = static_cast<std::uint64_t>(3 * i);
    points.row(i) << 20.0 * random_uniform(seed, counter), 20.0 * random_uniform(seed, counter + 1),
        0.3 * random_uniform(seed, counter + 2);
  }
  points.row(0) << 1e7, 0.0, 0.0;  // a stray
  points.row(1) = points.row(2);
  return points;
}

// Targets and points in blocks, as they are consolidated; all of the plain sums in double precision.
struct Scene {
  PointsDouble targets, points;
  std::vector<float> mass;
  PointBlocks target_blocks, point_blocks;

  Scene(int num_targets, int num_points, double longest)
      : targets(noisy_sheet(num_targets, 1)),
        points(noisy_sheet(num_points, 2)),
        target_blocks(make_blocks(targets, longest)),
        point_blocks(make_blocks(points, longest)) {
    mass.resize(static_cast<std::size_t>(point_blocks.num_readable()));
    for (std::size_t j = 0; j < mass.size(); ++j) mass[j] = static_cast<float>(0.5 + random_uniform(3, j));
  }

  static PointBlocks make_blocks(const PointsDouble& cloud, double longest) {
    const Rows<double> rows(cloud);
    return {rows, block_rows(rows, longest, false, 1), Scaling{Eigen::Vector3d(10.0, 10.0, 0.0), 1.0}, 1};
  }

  double weight(const simd::PairKernel& kernel, double r2, std::int64_t place, bool with_mass) const {
    if (!(r2 < static_cast<double>(kernel.reach2)) || r2 <= static_cast<double>(kernel.skip2)) return 0.0;
    double w = std::exp2(-r2) * (with_mass ? static_cast<double>(mass[static_cast<std::size_t>(place)]) : 1.0);
    if (kernel.decay == 1) w /= std::sqrt(r2 + static_cast<double>(kernel.softening2));
    if (kernel.decay == 2) w /= r2;
    return w;
  }

  template <class Visit>  // visit(place, offset) for each point
  void for_points(Visit&& visit) const {
    for (std::int64_t j = 0; j < point_blocks.num_points(); ++j) visit(j);
  }
};

const simd::PairKernel kernels[] = {{0, 9.0F, -1.0F, 0.0F},
                                    {0, 9.0F, 1e-8F, 0.0F},
                                    {1, 12.0F, -1.0F, 1e-3F},
                                    {2, 6.0F, 1e-8F, 0.0F},
                                    {0, 126.0F, -1.0F, 0.0F}};

}  // namespace

TEST_CASE("sums over pairs equal the plain sums in double precision, on every instruction set") {
  // The last scene has more blocks around a target than are summed over at a time.
  for (const Scene& scene : {Scene(70, 900, 0.5), Scene(3, 40, 0.5), Scene(40, 6000, 4.0)}) {
    for (const InstructionSet& set : instruction_sets()) {
      CAPTURE(set.name);
      for (const simd::PairKernel& kernel : kernels) {
        for (const PairSums which : {PairSums::mass, PairSums::mass_and_count, PairSums::first, PairSums::second}) {
          const bool summable =
              which == PairSums::first || kernel.decay == 0 || (which == PairSums::second && kernel.decay == 1);
          if (!summable) continue;
          for (const bool with_mass : {false, true}) {
            for (std::int64_t block = 0; block < scene.target_blocks.num_blocks(); ++block) {
              float sums[160];
              set.sum_pairs(kernel, which, scene.target_blocks.block(block),
                            scene.point_blocks.view(with_mass ? scene.mass.data() : nullptr), sums);
              for (std::int64_t at = scene.target_blocks.begin(block); at < scene.target_blocks.end(block); ++at) {
                const std::int64_t i = at - scene.target_blocks.begin(block);
                const Eigen::RowVector3d target = scene.targets.row(scene.target_blocks.row(at));
                double truth[10] = {}, least_gap = 1.0;
                scene.for_points([&](std::int64_t j) {
                  const Eigen::RowVector3d d = scene.points.row(scene.point_blocks.row(j)) - target;
                  const double r2 = d.squaredNorm();
                  least_gap = std::min(least_gap, std::abs(r2 - static_cast<double>(kernel.reach2)));
                  const double w = scene.weight(kernel, r2, j, with_mass);
                  truth[0] += w;
                  if (which == PairSums::mass_and_count) truth[1] += w > 0.0 ? 1.0 : 0.0;
                  if (which != PairSums::first && which != PairSums::second) return;
                  for (int axis = 0; axis < 3; ++axis) truth[1 + axis] += w * d[axis];
                  if (which != PairSums::second) return;
                  truth[4] += w * d[0] * d[0];
                  truth[5] += w * d[0] * d[1];
                  truth[6] += w * d[0] * d[2];
                  truth[7] += w * d[1] * d[1];
                  truth[8] += w * d[1] * d[2];
                  truth[9] += w * d[2] * d[2];
                });
                if (least_gap < 1e-4) continue;  // rounding decides whether that pair counts
                const int num_sums = which == PairSums::mass             ? 1
                                     : which == PairSums::mass_and_count ? 2
                                     : which == PairSums::first          ? 4
                                                                         : 10;
                for (int s = 0; s < num_sums; ++s) {
                  const double size = 10.0 * std::abs(truth[0]) + 1e-30;
                  CHECK(std::abs(static_cast<double>(sums[16 * s + i]) - truth[s]) < 3e-6 * size);
                }
              }
            }
          }
        }
      }
    }
  }
}

TEST_CASE("AVX2 and AVX-512 give the same bits") {
  const std::vector<InstructionSet> sets = instruction_sets();
  if (sets.size() < 3) return;
  const Scene scene(70, 2000, 0.5);
  for (const simd::PairKernel& kernel : kernels) {
    for (std::int64_t block = 0; block < scene.target_blocks.num_blocks(); ++block) {
      float sums[2][64] = {};
      for (std::size_t k = 0; k < 2; ++k) {
        sets[k + 1].sum_pairs(kernel, PairSums::first, scene.target_blocks.block(block),
                              scene.point_blocks.view(scene.mass.data()), sums[k]);
      }
      CHECK(std::equal(sums[0], sums[0] + 64, sums[1]));
    }
  }
}

TEST_CASE("listed blocks hold all that is near, and the weights of pairs add up to their sum") {
  const Scene scene(40, 6000, 0.5);
  for (const InstructionSet& set : instruction_sets()) {
    CAPTURE(set.name);
    for (const simd::PairKernel& kernel : {kernels[0], kernels[2]}) {
      const simd::PairPoints points = scene.point_blocks.view(scene.mass.data());
      for (std::int64_t block = 0; block < scene.target_blocks.num_blocks(); ++block) {
        const simd::PairTargets targets = scene.target_blocks.block(block);
        std::vector<std::int32_t> near;
        set.visit_blocks(
            kernel.reach2, targets, points.tree,
            [](void* list, std::int32_t b) { static_cast<std::vector<std::int32_t>*>(list)->push_back(b); }, &near);
        CHECK(std::is_sorted(near.begin(), near.end()));
        std::vector<float> weights(16 * near.size());
        float sums[64];
        set.sum_pairs(kernel, PairSums::first, targets, points, sums);
        for (int i = 0; i < targets.count; ++i) {
          set.weigh_pairs(kernel, targets, i, points, near.data(), static_cast<std::int64_t>(near.size()),
                          weights.data());
          double total = 0.0;
          for (const float w : weights) total += static_cast<double>(w);
          CHECK(static_cast<double>(sums[i]) == doctest::Approx(total).epsilon(1e-5));
        }
      }
    }
  }
}

TEST_CASE("blocks follow their points") {
  Scene scene(300, 10, 0.5);
  for (float& x : scene.target_blocks.axis(0)) x += 0.25F;
  scene.target_blocks.refit(1);
  for (std::int64_t block = 0; block < scene.target_blocks.num_blocks(); ++block) {
    const simd::PairTargets targets = scene.target_blocks.block(block);
    for (int i = 0; i < targets.count; ++i) {
      const double x = targets.origin[0] + static_cast<double>(targets.x[i]);
      CHECK(x >= static_cast<double>(targets.lower[0]));
      CHECK(x <= static_cast<double>(targets.upper[0]));
      CHECK(std::abs(targets.x[i]) <= scene.target_blocks.view(nullptr).halves[3 * block]);
    }
  }
}
