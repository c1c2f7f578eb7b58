// WLOP: Huang, Li, Zhang, Ascher, Cohen-Or, "Consolidation of unorganized point clouds for surface reconstruction",
// ACM TOG 28(5), 2009, after Lipman, Cohen-Or, Levin, Tal-Ezer, "Parameterization-free projection for geometry
// reconstruction", ACM TOG 26(3), 2007. In its notation x are samples, p points, h the support radius.
#include "nacre/consolidation.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
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

constexpr std::int64_t cells_per_block = 16;

// What makes a method.
struct Form {
  PairKernel density;            // theta, for v_j and w_i
  PairKernel first_attraction;   // alpha of the first iteration
  PairKernel attraction;         // alpha
  PairKernel repulsion;          // beta
  bool point_densities = true;   // whether the mass of a point is divided by its density v_j
  float lone_density = 1.0F;     // w_i of a sample that has no neighbours
  bool tangential = false;       // whether samples repel each other along the surface only
  float least_repulsion = 0.0F;  // lower bound of the sum that the repulsion is divided by
  float longest_step = std::numeric_limits<float>::infinity();
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
  PairKernel theta_over_r = theta;
  theta_over_r.decay = Decay::distance;
  theta_over_r.skip2 = static_cast<float>(1e-12 * h * h);  // 1 / r has no value at 0

  Form form;
  form.density = form.first_attraction = theta;
  form.attraction = form.repulsion = theta_over_r;
  if (options.method == ConsolidationMethod::wlop_plus) {
    form.attraction.softening2 = form.repulsion.softening2 = static_cast<float>(4e-4 * h * h);
    form.attraction.skip2 = -1.0F;
    form.tangential = true;
    form.least_repulsion = static_cast<float>(0.1 / h);
    form.longest_step = static_cast<float>(0.25 * h);
  } else if (options.method == ConsolidationMethod::cgal) {
    // As CGAL 5.5 behaves: a point does not attract a sample at its place, a sample counts itself twice.
    form.attraction.decay = Decay::none;
    form.first_attraction = form.attraction;
    form.repulsion.decay = Decay::squared_distance;
    form.point_densities = false;
    form.lone_density = 2.0F;
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
Eigen::Vector3f thinnest_direction(const PairSums& sums) {
  const Eigen::Vector3d mean = sums.first.cast<double>() / sums.mass;
  const Eigen::Matrix3d covariance = sums.second.cast<double>() / sums.mass - mean * mean.transpose();
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
  Projection(const PointsRef& samples, const PointsRef& points, const ConsolidateOptions& options,
             const ProjectionHints& hints)
      : options_(options),
        form_(form_of(options)),
        frozen_(hints.frozen),
        samples_(samples),
        normals_(hints.sample_normals),
        point_grid_(origin(points), edge(options)),
        sample_grid_(origin(points), edge(options)),
        sample_order_(finite_rows(samples)) {
    point_grid_.build(points, finite_rows(points));
    counts_.assign(point_grid_.padded_size(), 1.0F);
    if (hints.point_weights.size() > 0) {
      for (std::size_t j = 0; j < point_grid_.size(); ++j) counts_[j] = hints.point_weights[point_grid_.row(j)];
    }
    point_mass_ = counts_;
    has_density_.assign(point_grid_.num_cells(), 0);
    if (normals_.rows() == 0) normals_ = Points::Constant(samples.rows(), 3, unknown);
    const Values lengths = normals_.rowwise().norm();
    normals_.array().colwise() /= lengths.array();  // 0 / 0: a normal without direction is unknown
  }

  // One iteration; cargo, if any, is weighted as the attraction is.
  void move(bool first, const Cargo* cargo) {
    sample_grid_.build(samples_, sample_order_);
    sample_order_ = sample_grid_.rows();
    if (form_.point_densities) weigh_points();
    weigh_samples();
    const PairKernel& attraction = first ? form_.first_attraction : form_.attraction;
    Points moved = samples_;
    for_cells(sample_grid_.num_cells(), [&](std::size_t cell, CellWalk& among_samples, CellWalk& among_points) {
      if (!is_live(cell)) return;
      const PairRuns points = among_points.around(sample_grid_.key(cell));
      const PairRuns others = among_samples.around(sample_grid_.key(cell));
      for (std::size_t s = sample_grid_.begin(cell); s < sample_grid_.end(cell); ++s) {
        const std::int64_t row = sample_grid_.row(s);
        if (is_frozen(row)) continue;
        moved.row(row) += step(s, attraction, points, others).transpose();
        if (cargo) load(*cargo, s, attraction, points);
      }
    });
    samples_ = std::move(moved);
  }

  const Points& samples() const { return samples_; }

 private:
  static constexpr float unknown = std::numeric_limits<float>::quiet_NaN();

  // A little more than the radius, so that rounding never puts a pair within it two cells apart.
  static double edge(const ConsolidateOptions& options) { return 1.000001 * options.radius; }

  static Eigen::Vector3d origin(const PointsRef& points) {
    for (Eigen::Index i = 0; i < points.rows(); ++i) {
      if (points.row(i).allFinite()) return points.row(i).cast<double>().transpose();
    }
    return Eigen::Vector3d::Zero();
  }

  bool is_frozen(std::int64_t row) const { return !frozen_.empty() && frozen_[static_cast<std::size_t>(row)] != 0; }

  bool is_live(std::size_t cell) const {
    for (std::size_t s = sample_grid_.begin(cell); s < sample_grid_.end(cell); ++s) {
      if (!is_frozen(sample_grid_.row(s))) return true;
    }
    return false;
  }

  // body(i, walk among samples, walk among points) for each i of [0, count).
  template <class Body>
  void for_cells(std::size_t count, Body&& body) const {
    parallel_blocks(static_cast<std::int64_t>(count), cells_per_block, options_.num_threads,
                    [&](std::int64_t, std::int64_t begin, std::int64_t end) {
                      CellWalk among_samples(sample_grid_), among_points(point_grid_);
                      for (std::int64_t i = begin; i < end; ++i) {
                        body(static_cast<std::size_t>(i), among_samples, among_points);
                      }
                    });
  }

  // 1 + the sum of theta over the other points of a grid (Huang 2009, section 3), for the points of one cell. A point
  // of count c stands for c points at one place.
  void weigh(const CellGrid& grid, std::size_t cell, CellWalk& walk, const std::vector<float>& counts,
             std::vector<float>& densities) const {
    const PairRuns around = walk.around(grid.key(cell));
    for (std::size_t i = grid.begin(cell); i < grid.end(cell); ++i) {
      densities[i] = sum_pairs<0>(form_.density, grid.with_mass(counts), around, grid.point(i)).mass;
    }
  }

  // Divides the mass of each point by its density v_j, once a sample has come near.
  void weigh_points() {
    std::vector<std::size_t> cells;
    CellWalk walk(point_grid_);
    for (std::size_t cell = 0; cell < sample_grid_.num_cells(); ++cell) {
      if (!is_live(cell)) continue;
      walk.for_each_range(sample_grid_.key(cell), [&](std::size_t first, std::size_t last) {
        for (std::size_t c = first; c < last; ++c) {
          if (std::exchange(has_density_[c], 1) == 0) cells.push_back(c);
        }
      });
    }
    std::sort(cells.begin(), cells.end());
    for_cells(cells.size(), [&](std::size_t i, CellWalk&, CellWalk& among_points) {
      weigh(point_grid_, cells[i], among_points, counts_, point_mass_);
      for (std::size_t j = point_grid_.begin(cells[i]); j < point_grid_.end(cells[i]); ++j) {
        point_mass_[j] = counts_[j] > 0.0F ? counts_[j] / point_mass_[j] : 0.0F;
      }
    });
  }

  // The mass of a sample is its density w_i.
  void weigh_samples() {
    sample_mass_.assign(sample_grid_.padded_size(), 0.0F);
    const std::vector<float> ones(sample_grid_.padded_size(), 1.0F);
    for_cells(sample_grid_.num_cells(), [&](std::size_t cell, CellWalk& among_samples, CellWalk&) {
      weigh(sample_grid_, cell, among_samples, ones, sample_mass_);
      for (std::size_t s = sample_grid_.begin(cell); s < sample_grid_.end(cell); ++s) {
        sample_mass_[s] += form_.lone_density - 1.0F;
      }
    });
  }

  // Attraction plus mu times repulsion (Huang 2009, section 3); zero where there are no points.
  Eigen::Vector3f step(std::size_t s, const PairKernel& attraction, const PairRuns& points, const PairRuns& others) {
    const Eigen::Vector3f place = sample_grid_.point(s);
    auto normal = normals_.row(sample_grid_.row(s));
    const PairPoints attracting_points = point_grid_.with_mass(point_mass_);
    PairSums attracting;
    if (form_.tangential && !normal.allFinite()) {
      attracting = sum_pairs<2>(attraction, attracting_points, points, place);
      if (attracting.mass > 0.0F) normal = thinnest_direction(attracting).transpose();
    } else {
      attracting = sum_pairs<1>(attraction, attracting_points, points, place);
    }
    Eigen::Vector3f step = Eigen::Vector3f::Zero();
    if (attracting.mass > 0.0F) {
      step = attracting.first / attracting.mass;
    } else if (!(sum_pairs<0>(form_.density, attracting_points, points, place).mass > 0.0F)) {
      return step;  // isolated: not even a point at the sample's own place
    }

    const PairSums repelling = sum_pairs<1>(form_.repulsion, sample_grid_.with_mass(sample_mass_), others, place);
    if (repelling.mass > 0.0F) {
      Eigen::Vector3f away = -repelling.first / std::max(repelling.mass, form_.least_repulsion);
      if (form_.tangential) away -= normal.dot(away) * normal.transpose();
      step += static_cast<float>(options_.mu) * away;
    }
    const float length = step.norm();
    if (length > form_.longest_step) step *= form_.longest_step / length;
    return step;
  }

  // The means of attributes around a sample.
  void load(const Cargo& cargo, std::size_t s, const PairKernel& attraction, const PairRuns& points) const {
    using Row = Eigen::Array<double, 1, Eigen::Dynamic>;
    const Eigen::Index size = cargo.of_points.cols();
    Row sums = Row::Zero(size), masses = Row::Zero(size);
    for (const auto& [begin, end] : points) {
      for (std::size_t j = begin; j < end; ++j) {
        const float squared_distance = (point_grid_.point(j) - sample_grid_.point(s)).squaredNorm();
        const double weight = pair_weight(attraction, squared_distance) * point_mass_[j];
        if (!(weight > 0.0)) continue;
        for (Eigen::Index a = 0; a < size; ++a) {
          const double value = cargo.of_points(point_grid_.row(j), a);
          if (!std::isfinite(value)) continue;
          sums[a] += weight * value;
          masses[a] += weight;
        }
      }
    }
    for (Eigen::Index a = 0; a < size; ++a) {
      if (masses[a] > 0.0) cargo.of_samples(sample_grid_.row(s), a) = static_cast<float>(sums[a] / masses[a]);
    }
  }

  const ConsolidateOptions& options_;
  const Form form_;
  const std::vector<std::uint8_t>& frozen_;
  Points samples_, normals_;
  CellGrid point_grid_, sample_grid_;
  std::vector<std::int64_t> sample_order_;
  std::vector<float> counts_, point_mass_, sample_mass_;  // in the order of the grids, padded
  std::vector<std::uint8_t> has_density_;                 // one a cell of points
};

Points project(const PointsRef& samples, const PointsRef& points, const ConsolidateOptions& options,
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
  require(radius >= 1e-12 && radius <= 1e12, "radius", "a length from 1e-12 to 1e12", radius);
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
