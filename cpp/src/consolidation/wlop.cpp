// WLOP: Huang, Li, Zhang, Ascher, Cohen-Or, "Consolidation of unorganized point clouds for surface reconstruction",
// ACM TOG 28(5), 2009, after Lipman, Cohen-Or, Levin, Tal-Ezer, "Parameterization-free projection for geometry
// reconstruction", ACM TOG 26(3), 2007. In its notation x are samples, p points, h the support radius.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "base/check.hpp"
#include "base/numbers.hpp"
#include "base/parallel.hpp"
#include "consolidation/limits.hpp"
#include "consolidation/point_blocks.hpp"
#include "nacre/consolidation.hpp"
#include "spatial/subset.hpp"

namespace nacre {
namespace {

// What makes a method, in the unit of length in which theta(r) = 2^(-r^2).
struct Form {
  double scale = 1.0;                   // units a metre
  simd::PairKernel density{};           // theta, for v_j and w_i
  simd::PairKernel first_attraction{};  // alpha of the first iteration
  simd::PairKernel attraction{};        // alpha
  simd::PairKernel repulsion{};         // beta
  bool point_densities = true;          // whether the mass of a point is divided by its density v_j
  float lone_density = 1.0F;            // w_i of a sample that has no neighbours
  float least_neighbors = 0.0F;         // fewer do not repel
  bool tangential = false;              // whether samples repel each other along the surface only
  float least_repulsion = 0.0F;         // lower bound of the sum that the repulsion is divided by
  float longest_step = infinity<float>;
};

Form form_of(const ConsolidateOptions& options) {
  constexpr double log2_e = 1.4426950408889634;
  const double h = options.radius;
  double rate = options.theta == Theta::huang ? 16.0 / (h * h) : 4.0 / h;
  if (options.method == ConsolidationMethod::cgal) rate = 4.0 / (h * h);

  Form form;
  form.scale = std::sqrt(rate * log2_e);
  const double reach = h * form.scale;
  simd::PairKernel theta{};
  theta.decay = 0;
  theta.reach2 = static_cast<float>(std::min(reach * reach, consolidation_limits::most_reach2));
  theta.skip2 = -1.0F;
  form.density = form.first_attraction = form.attraction = form.repulsion = theta;
  form.attraction.decay = form.repulsion.decay = 1;
  form.attraction.softening2 = static_cast<float>(consolidation_limits::same_place2 * reach * reach);
  form.repulsion.skip2 = static_cast<float>(consolidation_limits::least_repelling2 * reach * reach);
  if (options.method == ConsolidationMethod::wlop_plus) {
    form.attraction.softening2 = form.repulsion.softening2 =
        static_cast<float>(consolidation_limits::softening2 * reach * reach);
    form.tangential = true;
    form.least_repulsion = static_cast<float>(consolidation_limits::least_repulsion / reach);
    form.longest_step = static_cast<float>(consolidation_limits::longest_step * reach);
  } else if (options.method == ConsolidationMethod::cgal) {
    // As CGAL 5.5 behaves: a point does not attract a sample at its place, a sample counts itself twice, and one
    // neighbour alone does not repel.
    form.attraction.decay = 0;
    form.attraction.skip2 = form.repulsion.skip2;
    form.first_attraction = form.attraction;
    form.repulsion.decay = 2;
    form.point_densities = false;
    form.lone_density = 2.0F;
    form.least_neighbors = 2.0F;
  }
  return form;
}

// The direction in which points with these weighted moments spread least.
Eigen::Vector3f thinnest_direction(double mass, const Eigen::Vector3d& first, const Eigen::Matrix3d& second) {
  const Eigen::Vector3d mean = first / mass;
  const Eigen::Matrix3d covariance = second / mass - mean * mean.transpose();
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>().computeDirect(covariance).eigenvectors().col(0).cast<float>();
}

// Attributes of the points, and the means of them that the samples take along.
struct Cargo {
  const AttributesRef& of_points;
  Attributes& of_samples;
};

// Moves samples among points that stay.
class Projection {
 public:
  Projection(PointBlocks& samples, const PointBlocks& points, const ConsolidateOptions& options, const Form& form,
             const ProjectionHints& hints)
      : options_(options), form_(form), hints_(hints), samples_(samples), points_(points) {
    counts_ = Values::Ones(points.num_readable());
    if (hints.point_weights.size() > 0) {
      // Only their ratios matter: sums of them stay within single precision, and keep their bits.
      const float heaviest = hints.point_weights.maxCoeff();
      const int exponent = heaviest > 0.0F ? std::ilogb(heaviest) : 0;
      for (std::int64_t j = 0; j < points.num_points(); ++j) {
        counts_[j] = std::scalbn(hints.point_weights[points.row(j)], -exponent);
      }
    }
    point_mass_ = counts_;
    sample_mass_.setZero(samples.num_readable());
    neighbors_.setZero(samples.num_points());
    if (form.point_densities) {
      is_near_.reset(new std::atomic<bool>[as_size(points.num_blocks())]());
      has_density_.assign(as_size(points.num_blocks()), 0);
    }
    if (form.tangential) {
      normals_ = Points::Constant(samples.num_points(), 3, std::numeric_limits<float>::quiet_NaN());
      if (hints.sample_normals.rows() > 0) {
        for (std::int64_t i = 0; i < samples.num_points(); ++i) {
          const Eigen::RowVector3f normal = hints.sample_normals.row(samples.row(i));
          normals_.row(i) = normal / normal.norm();  // 0 / 0: a normal without direction is unknown
        }
      }
    }
    for (int axis = 0; axis < 3; ++axis) moved_[axis] = samples.axis(axis);
  }

  // One iteration; cargo, if any, is weighted as the attraction is.
  void move(bool first, const Cargo* cargo) {
    if (form_.point_densities) weigh_points();
    weigh_samples();
    const simd::PairKernel& attraction = first ? form_.first_attraction : form_.attraction;
    for_blocks(samples_.num_blocks(), [&](std::int64_t block) {
      if (!is_live(block)) return;
      move_block(block, attraction);
      if (cargo) load(*cargo, block, attraction);
    });
    for (int axis = 0; axis < 3; ++axis) samples_.axis(axis).swap(moved_[axis]);
    samples_.refit(options_.num_threads);
  }

 private:
  static constexpr std::int64_t size = PointBlocks::size;

  bool is_frozen(std::int64_t i) const {
    return !hints_.frozen.empty() && hints_.frozen[as_size(samples_.row(i))] != 0;
  }

  bool is_live(std::int64_t block) const {
    for (std::int64_t i = samples_.begin(block); i < samples_.end(block); ++i) {
      if (!is_frozen(i)) return true;
    }
    return false;
  }

  // body(block) for each of so many blocks.
  template <class Body>
  void for_blocks(std::int64_t count, Body&& body) const {
    parallel_for(count, std::clamp<std::int64_t>(count / 64, 1, 64), options_.num_threads, body);
  }

  // Divides the mass of each point that is near a sample by its density v_j.
  void weigh_points() {
    if (num_weighed_ == points_.num_blocks()) return;
    for_blocks(samples_.num_blocks(), [&](std::int64_t block) {
      if (!is_live(block)) return;
      const auto mark = [](void* is_near, std::int32_t near_block) {
        static_cast<std::atomic<bool>*>(is_near)[near_block].store(true, std::memory_order_relaxed);
      };
      simd::visit_blocks()(consolidation_limits::box_rounding * form_.density.reach2, samples_.block(block),
                           points_.view(nullptr).tree, mark, is_near_.get());
    });
    std::vector<std::int64_t> fresh;
    for (std::int64_t block = 0; block < points_.num_blocks(); ++block) {
      if (has_density_[as_size(block)] != 0 || !is_near_[as_size(block)].load(std::memory_order_relaxed)) continue;
      has_density_[as_size(block)] = 1;
      fresh.push_back(block);
    }
    num_weighed_ += static_cast<std::int64_t>(fresh.size());
    const bool weighted = hints_.point_weights.size() > 0;
    for_blocks(static_cast<std::int64_t>(fresh.size()), [&](std::int64_t k) {
      const std::int64_t block = fresh[as_size(k)];
      float densities[size];
      simd::sum_pairs()(form_.density, simd::PairSums::mass, points_.block(block),
                        points_.view(weighted ? counts_.data() : nullptr), densities);
      for (std::int64_t j = points_.begin(block); j < points_.end(block); ++j) {
        point_mass_[j] = counts_[j] > 0.0F ? counts_[j] / densities[j - points_.begin(block)] : 0.0F;
      }
    });
  }

  // The mass of a sample is its density w_i: 1 + the sum of theta over the other samples (Huang 2009, section 3).
  void weigh_samples() {
    const simd::PairPoints others = samples_.view(nullptr);
    const bool counted = form_.least_neighbors > 0.0F;
    for_blocks(samples_.num_blocks(), [&](std::int64_t block) {
      float sums[2 * size];
      simd::sum_pairs()(form_.density, counted ? simd::PairSums::mass_and_count : simd::PairSums::mass,
                        samples_.block(block), others, sums);
      for (std::int64_t i = samples_.begin(block), k = 0; i < samples_.end(block); ++i, ++k) {
        sample_mass_[i] = sums[k] + (form_.lone_density - 1.0F);
        if (counted) neighbors_[i] = sums[size + k] - 1.0F;
      }
    });
  }

  // Attraction plus mu times repulsion (Huang 2009, section 3); zero where there are no points.
  void move_block(std::int64_t block, const simd::PairKernel& attraction) {
    const simd::PairTargets targets = samples_.block(block);
    const simd::PairPoints points = points_.view(form_.point_densities ? point_mass_.data() : nullptr);
    const bool finds_normals =
        form_.tangential && !normals_.middleRows(samples_.begin(block), targets.count).allFinite();
    float attracting[10 * size], repelling[4 * size];
    simd::sum_pairs()(attraction, finds_normals ? simd::PairSums::second : simd::PairSums::first, targets, points,
                      attracting);
    simd::sum_pairs()(form_.repulsion, simd::PairSums::first, targets, samples_.view(sample_mass_.data()), repelling);
    if (finds_normals) find_normals(block, attracting);
    float reached[size];
    const bool all_attracted = std::all_of(attracting, attracting + targets.count, [](float m) { return m > 0.0F; });
    if (!all_attracted) simd::sum_pairs()(form_.density, simd::PairSums::mass, targets, points, reached);

    for (std::int64_t k = 0; k < targets.count; ++k) {
      const std::int64_t i = samples_.begin(block) + k;
      const auto mean = [&](const float* sums, float mass) -> Eigen::Vector3f {
        return Eigen::Vector3f(sums[size + k], sums[2 * size + k], sums[3 * size + k]) / mass;
      };
      Eigen::Vector3f step = Eigen::Vector3f::Zero();
      const bool is_attracted = attracting[k] > 0.0F;
      if (is_attracted) step = mean(attracting, attracting[k]);
      const bool is_isolated = !is_attracted && !(reached[k] > 0.0F);
      if (repelling[k] > 0.0F && !(neighbors_[i] < form_.least_neighbors)) {
        Eigen::Vector3f away = -mean(repelling, std::max(repelling[k], form_.least_repulsion));
        if (form_.tangential) away -= normals_.row(i).dot(away) * normals_.row(i).transpose();
        step += static_cast<float>(options_.mu) * away;
      }
      const float length = step.norm();
      if (length > form_.longest_step) step *= form_.longest_step / length;
      if (is_isolated || is_frozen(i)) step.setZero();
      for (int axis = 0; axis < 3; ++axis) moved_[axis][as_size(i)] = samples_.axis(axis)[as_size(i)] + step[axis];
    }
  }

  // The unknown normals of a block, from the second moments of the points.
  void find_normals(std::int64_t block, const float* sums) {
    for (std::int64_t k = 0; k < samples_.end(block) - samples_.begin(block); ++k) {
      auto normal = normals_.row(samples_.begin(block) + k);
      if (normal.allFinite() || !(sums[k] > 0.0F)) continue;
      const auto sum = [&](int s) { return static_cast<double>(sums[s * size + k]); };
      Eigen::Matrix3d second;
      second << sum(4), sum(5), sum(6), sum(5), sum(7), sum(8), sum(6), sum(8), sum(9);
      normal = thinnest_direction(sum(0), {sum(1), sum(2), sum(3)}, second).transpose();
    }
  }

  // The means of attributes around the samples of a block.
  void load(const Cargo& cargo, std::int64_t block, const simd::PairKernel& attraction) const {
    using Row = Eigen::Array<double, 1, Eigen::Dynamic>;
    const simd::PairTargets targets = samples_.block(block);
    const simd::PairPoints points = points_.view(form_.point_densities ? point_mass_.data() : nullptr);
    std::vector<std::int32_t> near;
    const auto list = [](void* blocks, std::int32_t near_block) {
      static_cast<std::vector<std::int32_t>*>(blocks)->push_back(near_block);
    };
    simd::visit_blocks()(consolidation_limits::box_rounding * attraction.reach2, targets, points.tree, list, &near);
    std::vector<float> weights(near.size() * as_size(size));
    for (int k = 0; k < targets.count; ++k) {
      if (is_frozen(samples_.begin(block) + k)) continue;
      simd::weigh_pairs()(attraction, targets, k, points, near.data(), static_cast<std::int64_t>(near.size()),
                          weights.data());
      Row sums = Row::Zero(cargo.of_points.cols()), masses = sums;
      for (std::size_t j = 0; j < weights.size(); ++j) {
        if (!(weights[j] > 0.0F)) continue;
        const std::int64_t row =
            points_.row(points_.begin(near[j / as_size(size)]) + static_cast<std::int64_t>(j) % size);
        for (Eigen::Index a = 0; a < sums.size(); ++a) {
          const double value = cargo.of_points(row, a);
          if (!std::isfinite(value)) continue;
          sums[a] += static_cast<double>(weights[j]) * value;
          masses[a] += static_cast<double>(weights[j]);
        }
      }
      const std::int64_t row = samples_.row(samples_.begin(block) + k);
      for (Eigen::Index a = 0; a < sums.size(); ++a) {
        if (masses[a] > 0.0) cargo.of_samples(row, a) = static_cast<float>(sums[a] / masses[a]);
      }
    }
  }

  const ConsolidateOptions& options_;
  const Form& form_;
  const ProjectionHints& hints_;
  PointBlocks& samples_;
  const PointBlocks& points_;
  std::vector<float> moved_[3];
  Values counts_, point_mass_, sample_mass_, neighbors_;
  Points normals_;
  std::unique_ptr<std::atomic<bool>[]> is_near_;  // one a block of points
  std::vector<std::uint8_t> has_density_;
  std::int64_t num_weighed_ = 0;  // blocks that have
};

template <class Cloud, class Matrix>
Matrix project(const Cloud& samples, const Cloud& points, const ConsolidateOptions& options,
               const ProjectionHints& hints, const Cargo* cargo, int* iterations) {
  const Form form = form_of(options);
  const Rows<typename Cloud::Scalar> point_rows(points), sample_rows(samples);
  const double longest = consolidation_limits::longest_block * options.radius;
  BlockRows of_points = block_rows(point_rows, longest, false, options.num_threads);
  Scaling scaling{Eigen::Vector3d::Zero(), form.scale};
  if (!of_points.rows.empty()) scaling.center = point_rows.position(of_points.rows[of_points.rows.size() / 2]);
  const PointBlocks point_blocks(point_rows, std::move(of_points), scaling, options.num_threads);
  PointBlocks blocks(sample_rows, block_rows(sample_rows, longest, true, options.num_threads), scaling,
                     options.num_threads);
  const int digits =
      static_cast<int>(std::floor(std::log10(consolidation_limits::most_distant / (options.radius * form.scale))));
  const double radii = std::max(point_blocks.reach(), blocks.reach()) / (options.radius * form.scale);
  require(radii < std::pow(10.0, digits), "points", "within 1e" + std::to_string(digits) + " radii of their middle",
          radii);
  const std::vector<float> first[3] = {blocks.axis(0), blocks.axis(1), blocks.axis(2)};
  Projection projection(blocks, point_blocks, options, form, hints);
  for (int iteration = 0; iteration < options.iterations; ++iteration) {
    projection.move(iteration == 0, iteration + 1 == options.iterations ? cargo : nullptr);
    if (iterations != nullptr) *iterations = iteration + 1;
    if (options.progress && !options.progress(iteration + 1, options.iterations)) break;
  }
  Matrix result = samples;
  parallel_for(blocks.num_points(), 16384, options.num_threads, [&](std::int64_t i) {
    for (int axis = 0; axis < 3; ++axis) {
      const double way = static_cast<double>(blocks.axis(axis)[as_size(i)]) - first[axis][as_size(i)];
      auto& coordinate = result(blocks.row(i), axis);
      coordinate = static_cast<typename Matrix::Scalar>(static_cast<double>(coordinate) + way / form.scale);
    }
  });
  return result;
}

template <class Matrix, class Cloud>
BasicConsolidated<Matrix> consolidate_cloud(const Cloud& points, const ConsolidateOptions& options,
                                            const AttributesRef& attributes) {
  options.check();
  require(points.rows() < (std::int64_t{1} << 31), "points", "fewer than 2^31 rows", points.rows());
  require(attributes.size() == 0 || attributes.rows() == points.rows(), "attributes",
          "one row per point (" + std::to_string(points.rows()) + ")", attributes.rows());
  BasicConsolidated<Matrix> result;
  result.sources = choose_rows(points, options.num_points, options.seed, options.num_threads);
  const auto count = static_cast<Eigen::Index>(result.sources.size());
  Matrix samples(count, 3);
  result.attributes.resize(count, attributes.cols());
  for (Eigen::Index i = 0; i < count; ++i) {
    const std::int64_t source = result.sources[as_size(i)];
    samples.row(i) = points.row(source);
    if (attributes.cols() > 0) result.attributes.row(i) = attributes.row(source);
  }
  const Cargo cargo{attributes, result.attributes};
  result.points = project<Cloud, Matrix>(samples, points, options, ProjectionHints(),
                                         attributes.cols() > 0 ? &cargo : nullptr, &result.iterations);
  return result;
}

template <class Matrix, class Cloud>
Matrix project_cloud(const Cloud& samples, const Cloud& points, const ConsolidateOptions& options,
                     const ProjectionHints& hints) {
  options.check();
  for (const Cloud* cloud : {&samples, &points}) {
    require(cloud->rows() < (std::int64_t{1} << 31), "points", "fewer than 2^31 rows", cloud->rows());
  }
  const bool hinted = hints.point_weights.size() > 0 || hints.sample_normals.rows() > 0 || !hints.frozen.empty();
  require(!hinted || options.method == ConsolidationMethod::wlop_plus, "hints", "empty unless the method is wlop_plus",
          "some");
  require(hints.point_weights.size() == 0 || hints.point_weights.size() == points.rows(), "point_weights",
          "one value per point (" + std::to_string(points.rows()) + ")", hints.point_weights.size());
  for (Eigen::Index j = 0; j < hints.point_weights.size(); ++j) {
    const float weight = hints.point_weights[j];
    require(std::isfinite(weight) && weight >= 0.0F, "point_weights", "finite and not negative", weight);
  }
  require(hints.sample_normals.rows() == 0 || hints.sample_normals.rows() == samples.rows(), "sample_normals",
          "one row per sample (" + std::to_string(samples.rows()) + ")", hints.sample_normals.rows());
  require(hints.frozen.empty() || static_cast<Eigen::Index>(hints.frozen.size()) == samples.rows(), "frozen",
          "one value per sample (" + std::to_string(samples.rows()) + ")", hints.frozen.size());
  return project<Cloud, Matrix>(samples, points, options, hints, nullptr, nullptr);
}

}  // namespace

void ConsolidateOptions::check() const {
  require(radius >= 1e-12 && radius <= 1e12, "radius", "a length from 1e-12 to 1e12", radius);
  require(num_points >= 1, "num_points", "at least 1", num_points);
  require(iterations >= 0, "iterations", "at least 0", iterations);
  require(mu >= 0.0 && mu <= 0.5, "mu", "from 0 to 0.5", mu);
  require(num_threads >= 0, "num_threads", "at least 0", num_threads);
}

Consolidated consolidate(const PointsRef& points, const ConsolidateOptions& options, const AttributesRef& attributes) {
  return consolidate_cloud<Points>(points, options, attributes);
}

ConsolidatedDouble consolidate(const PointsDoubleRef& points, const ConsolidateOptions& options,
                               const AttributesRef& attributes) {
  return consolidate_cloud<PointsDouble>(points, options, attributes);
}

Points project_samples(const PointsRef& samples, const PointsRef& points, const ConsolidateOptions& options,
                       const ProjectionHints& hints) {
  return project_cloud<Points>(samples, points, options, hints);
}

PointsDouble project_samples(const PointsDoubleRef& samples, const PointsDoubleRef& points,
                             const ConsolidateOptions& options, const ProjectionHints& hints) {
  return project_cloud<PointsDouble>(samples, points, options, hints);
}

}  // namespace nacre
