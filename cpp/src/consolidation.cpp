// WLOP: Huang, Li, Zhang, Ascher, Cohen-Or, "Consolidation of unorganized point clouds for surface reconstruction",
// ACM TOG 28(5), 2009, after Lipman, Cohen-Or, Levin, Tal-Ezer, "Parameterization-free projection for geometry
// reconstruction", ACM TOG 26(3), 2007. In its notation x are samples, p points, h the support radius.
#include "nacre/consolidation.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <unordered_set>
#include <utility>

#include "cell_grid.hpp"
#include "check.hpp"
#include "pair_kernel.hpp"
#include "parallel.hpp"
#include "random.hpp"

namespace nacre {
namespace {

using Decay = PairKernel::Decay;

constexpr std::int64_t cells_per_block = 8;

// The weights of one method.
struct Form {
  PairKernel density;           // theta, for v_j and w_i
  PairKernel first_attraction;  // alpha of the first iteration
  PairKernel attraction;        // alpha
  PairKernel repulsion;         // beta
  bool point_densities;         // whether the points' weights are divided by v_j
  float least_repulsion;        // lower bound of the sum that the repulsion is divided by
  float longest_step;
};

Form form_of(const ConsolidateOptions& options) {
  constexpr double log2_e = 1.4426950408889634;
  const double h = options.radius;
  double exponent = options.theta == Theta::huang ? -16.0 / (h * h) : -4.0 / h;
  if (options.method == ConsolidationMethod::cgal) exponent = -4.0 / (h * h);

  PairKernel theta{};
  theta.decay = Decay::none;
  theta.exponent = static_cast<float>(exponent * log2_e);
  theta.reach2 = static_cast<float>(h * h);
  theta.skip2 = -1.0F;
  // 1 / r has no value at r = 0: such pairs are left out.
  PairKernel theta_over_r = theta;
  theta_over_r.decay = Decay::distance;
  theta_over_r.skip2 = static_cast<float>(1e-12 * h * h);

  Form form{theta, theta, theta_over_r, theta_over_r, true, 0.0F, std::numeric_limits<float>::infinity()};
  if (options.method == ConsolidationMethod::wlop_plus) {
    form.attraction.softening2 = form.repulsion.softening2 = static_cast<float>(4e-4 * h * h);
    form.attraction.skip2 = -1.0F;
    form.least_repulsion = static_cast<float>(0.1 / h);
    form.longest_step = static_cast<float>(0.25 * h);
  } else if (options.method == ConsolidationMethod::cgal) {
    form.attraction = theta;
    form.repulsion.decay = Decay::squared_distance;
    form.point_densities = false;
  }
  return form;
}

std::vector<std::int64_t> finite_rows(const PointsRef& points) {
  std::vector<std::int64_t> rows;
  rows.reserve(static_cast<std::size_t>(points.rows()));
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    if (points.row(i).allFinite()) rows.push_back(i);
  }
  return rows;
}

// The direction in which weighted points with these moments spread least.
Eigen::Vector3f thinnest_direction(const PairSums<2>& sums) {
  const Eigen::Vector3d mean = sums.first().cast<double>() / sums.mass();
  const Eigen::Matrix3d covariance = sums.second().cast<double>() / sums.mass() - mean * mean.transpose();
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
  Projection(const Points& samples, const PointsRef& points, const ConsolidateOptions& options,
             const ProjectionHints& hints)
      : options_(options),
        form_(form_of(options)),
        hints_(hints),
        samples_(samples),
        point_grid_(origin(points), edge(options)),
        sample_grid_(origin(points), edge(options)),
        sample_order_(finite_rows(samples)) {
    point_grid_.build(points, finite_rows(points));
    counts_.assign(point_grid_.padded_size(), 1.0F);
    if (hints.point_weights.size() > 0) {
      for (std::int64_t j = 0; j < point_grid_.size(); ++j) {
        counts_[static_cast<std::size_t>(j)] = hints.point_weights[point_grid_.rows()[static_cast<std::size_t>(j)]];
      }
    }
    point_mass_ = counts_;
    has_density_.assign(static_cast<std::size_t>(point_grid_.num_cells()), 0);
  }

  // One iteration; cargo, if any, is weighted as the attraction is.
  void move(bool first, const Cargo* cargo) {
    sample_grid_.build(samples_, sample_order_);
    sample_order_ = sample_grid_.rows();
    if (form_.point_densities) weigh_points();
    weigh_samples();
    const PairKernel& attraction = first ? form_.first_attraction : form_.attraction;
    Points moved = samples_;
    for_each_live_cell([&](std::int64_t cell, const Runs& point_runs) {
      const Runs sample_runs = runs_around(sample_grid_, sample_grid_.key(cell));
      for (std::int64_t s = sample_grid_.begin(cell); s < sample_grid_.begin(cell + 1); ++s) {
        const std::int64_t row = sample_grid_.rows()[static_cast<std::size_t>(s)];
        if (is_frozen(row)) continue;
        const Eigen::Vector3f place = sample_grid_.point(s);
        moved.row(row) += step(place, row, attraction, point_runs, sample_runs).transpose();
        if (cargo) load(*cargo, row, place, attraction, point_runs);
      }
    });
    samples_ = std::move(moved);
  }

  const Points& samples() const { return samples_; }

 private:
  using Runs = std::vector<std::pair<std::int64_t, std::int64_t>>;

  // A little more than the radius, so that rounding never puts a pair within it two cells apart.
  static double edge(const ConsolidateOptions& options) { return 1.000001 * options.radius; }

  static Eigen::Vector3d origin(const PointsRef& points) {
    for (Eigen::Index i = 0; i < points.rows(); ++i) {
      if (points.row(i).allFinite()) return points.row(i).cast<double>().transpose();
    }
    return Eigen::Vector3d::Zero();
  }

  static Runs runs_around(const CellGrid& grid, CellGrid::Key key) {
    Runs runs;
    runs.reserve(9);
    grid.for_each_run(
        key, [&](std::int64_t first, std::int64_t last) { runs.emplace_back(grid.begin(first), grid.begin(last)); });
    return runs;
  }

  bool is_frozen(std::int64_t row) const {
    return !hints_.frozen.empty() && hints_.frozen[static_cast<std::size_t>(row)] != 0;
  }

  bool is_live(std::int64_t cell) const {
    for (std::int64_t s = sample_grid_.begin(cell); s < sample_grid_.begin(cell + 1); ++s) {
      if (!is_frozen(sample_grid_.rows()[static_cast<std::size_t>(s)])) return true;
    }
    return false;
  }

  // body(cell, runs of points around it) for each cell with a sample that may move.
  template <class Body>
  void for_each_live_cell(Body&& body) const {
    parallel_for(sample_grid_.num_cells(), cells_per_block, options_.num_threads, [&](std::int64_t cell) {
      if (!is_live(cell)) return;
      const Runs runs = runs_around(point_grid_, sample_grid_.key(cell));
      if (!runs.empty()) body(cell, runs);
    });
  }

  // v_j = 1 + sum over j' of theta (Huang 2009, eq. 4), for the points that samples have come near to. A point of
  // weight c counts as c points at one place.
  void weigh_points() {
    std::vector<std::int64_t> cells;
    for (std::int64_t cell = 0; cell < sample_grid_.num_cells(); ++cell) {
      if (!is_live(cell)) continue;
      point_grid_.for_each_run(sample_grid_.key(cell), [&](std::int64_t first, std::int64_t last) {
        for (std::int64_t c = first; c < last; ++c) {
          if (std::exchange(has_density_[static_cast<std::size_t>(c)], 1) == 0) cells.push_back(c);
        }
      });
    }
    const PairPoints counted = point_grid_.with_mass(counts_);
    parallel_for(static_cast<std::int64_t>(cells.size()), cells_per_block, options_.num_threads, [&](std::int64_t i) {
      const std::int64_t cell = cells[static_cast<std::size_t>(i)];
      const Runs runs = runs_around(point_grid_, point_grid_.key(cell));
      for (std::int64_t j = point_grid_.begin(cell); j < point_grid_.begin(cell + 1); ++j) {
        PairSums<0> sums;
        for (const auto& [begin, end] : runs) sums.add(form_.density, counted, begin, end, point_grid_.point(j));
        const auto k = static_cast<std::size_t>(j);
        point_mass_[k] = counts_[k] > 0.0F ? counts_[k] / sums.mass() : 0.0F;
      }
    });
  }

  // w_i = 1 + sum over i' of theta (Huang 2009, eq. 4).
  void weigh_samples() {
    sample_mass_.assign(sample_grid_.padded_size(), 0.0F);
    const std::vector<float> ones(sample_grid_.padded_size(), 1.0F);
    const PairPoints counted = sample_grid_.with_mass(ones);
    parallel_for(sample_grid_.num_cells(), cells_per_block, options_.num_threads, [&](std::int64_t cell) {
      const Runs runs = runs_around(sample_grid_, sample_grid_.key(cell));
      for (std::int64_t s = sample_grid_.begin(cell); s < sample_grid_.begin(cell + 1); ++s) {
        PairSums<0> sums;
        for (const auto& [begin, end] : runs) sums.add(form_.density, counted, begin, end, sample_grid_.point(s));
        sample_mass_[static_cast<std::size_t>(s)] = sums.mass();
      }
    });
  }

  // Attraction plus mu times repulsion (Huang 2009, eq. 3); zero where there are no points.
  Eigen::Vector3f step(const Eigen::Vector3f& place, std::int64_t row, const PairKernel& attraction,
                       const Runs& point_runs, const Runs& sample_runs) const {
    PairSums<1> attracting;
    const PairPoints points = point_grid_.with_mass(point_mass_);
    for (const auto& [begin, end] : point_runs) attracting.add(attraction, points, begin, end, place);
    if (!(attracting.mass() > 0.0F)) return Eigen::Vector3f::Zero();
    Eigen::Vector3f step = attracting.first() / attracting.mass();

    PairSums<1> repelling;
    const PairPoints others = sample_grid_.with_mass(sample_mass_);
    for (const auto& [begin, end] : sample_runs) repelling.add(form_.repulsion, others, begin, end, place);
    if (repelling.mass() > 0.0F) {
      Eigen::Vector3f away = -repelling.first() / std::max(repelling.mass(), form_.least_repulsion);
      if (options_.method == ConsolidationMethod::wlop_plus) {
        const Eigen::Vector3f normal = normal_at(place, row, point_runs);
        away -= normal.dot(away) * normal;
      }
      step += static_cast<float>(options_.mu) * away;
    }
    const float length = step.norm();
    return length > form_.longest_step ? Eigen::Vector3f(step * (form_.longest_step / length)) : step;
  }

  Eigen::Vector3f normal_at(const Eigen::Vector3f& place, std::int64_t row, const Runs& point_runs) const {
    if (hints_.sample_normals.rows() > 0 && hints_.sample_normals.row(row).allFinite()) {
      return hints_.sample_normals.row(row).transpose().normalized();
    }
    PairSums<2> sums;
    const PairPoints points = point_grid_.with_mass(point_mass_);
    for (const auto& [begin, end] : point_runs) sums.add(form_.density, points, begin, end, place);
    return thinnest_direction(sums);
  }

  void load(const Cargo& cargo, std::int64_t row, const Eigen::Vector3f& place, const PairKernel& attraction,
            const Runs& point_runs) const {
    using Row = Eigen::Array<double, 1, Eigen::Dynamic>;
    const Eigen::Index size = cargo.of_points.cols();
    Row sums = Row::Zero(size), masses = Row::Zero(size);
    for (const auto& [begin, end] : point_runs) {
      for (std::int64_t j = begin; j < end; ++j) {
        const auto k = static_cast<std::size_t>(j);
        const float weight = pair_weight(attraction, (point_grid_.point(j) - place).squaredNorm()) * point_mass_[k];
        if (!(weight > 0.0F)) continue;
        const auto values = cargo.of_points.row(point_grid_.rows()[k]);
        for (Eigen::Index a = 0; a < size; ++a) {
          if (!std::isfinite(values[a])) continue;
          sums[a] += static_cast<double>(weight) * static_cast<double>(values[a]);
          masses[a] += static_cast<double>(weight);
        }
      }
    }
    for (Eigen::Index a = 0; a < size; ++a) {
      if (masses[a] > 0.0) cargo.of_samples(row, a) = static_cast<float>(sums[a] / masses[a]);
    }
  }

  const ConsolidateOptions& options_;
  const Form form_;
  const ProjectionHints& hints_;
  Points samples_;
  CellGrid point_grid_, sample_grid_;
  std::vector<std::int64_t> sample_order_;
  // In the order of the grids, padded as they are.
  std::vector<float> counts_, point_mass_, sample_mass_;
  std::vector<std::uint8_t> has_density_;  // one a cell of points
};

Points project(const Points& samples, const PointsRef& points, const ConsolidateOptions& options,
               const ProjectionHints& hints, const Cargo* cargo) {
  Projection projection(samples, points, options, hints);
  for (int iteration = 0; iteration < options.iterations; ++iteration) {
    projection.move(iteration == 0, iteration + 1 == options.iterations ? cargo : nullptr);
  }
  return projection.samples();
}

// count of the rows that are finite, without replacement, in ascending order; a place that several points share is
// taken again only when every place is taken, since samples at one place never part.
std::vector<std::int64_t> choose(const PointsRef& points, int count, std::uint64_t seed) {
  using Ticket = std::pair<std::uint64_t, std::int64_t>;
  std::vector<Ticket> drawn;
  for (const std::int64_t row : finite_rows(points)) {
    drawn.emplace_back(random_bits(seed, static_cast<std::uint64_t>(row)), row);
  }
  std::priority_queue<Ticket, std::vector<Ticket>, std::greater<>> tickets(std::greater<>(), std::move(drawn));

  const auto hash = [&](std::int64_t row) {
    std::uint64_t bits = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const float coordinate = points(row, axis) + 0.0F;  // -0 becomes 0
      std::uint32_t word;
      std::memcpy(&word, &coordinate, sizeof word);
      bits = mix64(bits ^ word);
    }
    return static_cast<std::size_t>(bits);
  };
  const auto same_place = [&](std::int64_t a, std::int64_t b) { return points.row(a) == points.row(b); };
  std::unordered_set<std::int64_t, decltype(hash), decltype(same_place)> taken(16, hash, same_place);

  std::vector<std::int64_t> chosen, repeated;
  const auto wanted = std::min(tickets.size(), static_cast<std::size_t>(count));
  for (; chosen.size() < wanted && !tickets.empty(); tickets.pop()) {
    const std::int64_t row = tickets.top().second;
    (taken.insert(row).second ? chosen : repeated).push_back(row);
  }
  chosen.insert(chosen.end(), repeated.begin(),
                repeated.begin() + static_cast<std::ptrdiff_t>(std::min(repeated.size(), wanted - chosen.size())));
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

}  // namespace

void ConsolidateOptions::check() const {
  require(std::isfinite(radius) && radius > 0.0, "radius", "a positive length", radius);
  require(num_points >= 1, "num_points", "at least 1", num_points);
  require(iterations >= 0, "iterations", "at least 0", iterations);
  require(mu >= 0.0 && mu <= 0.5, "mu", "from 0 to 0.5", mu);
  require(num_threads >= 0, "num_threads", "at least 0", num_threads);
}

Consolidated consolidate(const PointsRef& points, const ConsolidateOptions& options, const AttributesRef& attributes) {
  options.check();
  require(attributes.size() == 0 || attributes.rows() == points.rows(), "attributes",
          "one row per point (" + std::to_string(points.rows()) + ")", attributes.rows());
  Consolidated result;
  result.sources = choose(points, options.num_points, options.seed);
  const auto count = static_cast<Eigen::Index>(result.sources.size());
  Points samples(count, 3);
  result.attributes.resize(count, attributes.cols());
  for (Eigen::Index i = 0; i < count; ++i) {
    const std::int64_t source = result.sources[static_cast<std::size_t>(i)];
    samples.row(i) = points.row(source);
    if (attributes.cols() > 0) result.attributes.row(i) = attributes.row(source);
  }
  const Cargo cargo{attributes, result.attributes};
  result.points = project(samples, points, options, ProjectionHints(), attributes.cols() > 0 ? &cargo : nullptr);
  return result;
}

Points project_samples(const PointsRef& samples, const PointsRef& points, const ConsolidateOptions& options,
                       const ProjectionHints& hints) {
  options.check();
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
  return project(samples, points, options, hints, nullptr);
}

}  // namespace nacre
