#include "deformation/warp_registration.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/limits.hpp"
#include "base/parallel.hpp"
#include "base/random.hpp"
#include "base/statistics.hpp"
#include "deformation/limits.hpp"
#include "deformation/node_equations.hpp"
#include "registration/color_field.hpp"
#include "registration/limits.hpp"
#include "spatial/nearest_batch.hpp"

namespace nacre {
namespace {

// Of a match that is as bad as none.
const double largest_misfit = base_limits::noise_sigmas * base_limits::noise_sigmas;

// What a match says of the motions of the nodes that move a point.
struct WarpEquation {
  std::array<Vector6, WarpBinding::blended> jacobian;  // of the residual, by each node's motion
  double residual = 0.0;                               // [m] or [1]
  double weight = 0.0;                                 // one by its square; 0: there is no match
};

// A point of the model, and what the frame shows next to it.
struct WarpRow {
  OrientedPoint canonical;
  WarpBinding binding;
  int num_nodes;  // that move it
  std::array<double, WarpBinding::blended> weights;
  float brightness;      // NaN: unknown
  double texture = 0.0;  // by how much it changes from one point to the next
  WarpEquation shape, color;
  double misfit = 0.0;  // [1]
};

class WarpRegistration {
 public:
  WarpRegistration(WarpField& field, const OrientedPoints& canonical, const std::vector<std::int32_t>& in_view,
                   const ShownSurface& shown, int num_threads, const std::vector<std::uint8_t>& was_bending,
                   const std::vector<Eigen::Vector3f>& colors)
      : field_(field),
        parts_(parts_of(field)),
        shown_(shown),
        num_threads_(num_threads),
        was_bending_(was_bending),
        tree_(shown.points.data(), shown.points.rows(), num_threads),
        rows_(chosen_rows(field, canonical, in_view, colors)),
        nearest_(rows_.size(), no_slot),
        equations_(field.nodes.size(), pairs()) {
    uses_.resize(field.nodes.size());
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      const WarpRow& row = rows_[i];
      for (int k = 0; k < row.num_nodes; ++k) {
        Use use{i, k, {}};
        const std::int32_t node = row.binding.nodes[static_cast<std::size_t>(k)];
        for (int m = 0; m < row.num_nodes; ++m) {
          use.blocks[static_cast<std::size_t>(m)] =
              equations_.block_at(node, row.binding.nodes[static_cast<std::size_t>(m)]);
        }
        uses_[static_cast<std::size_t>(node)].push_back(use);
      }
    }
    neighbors_.resize(field.nodes.size());
    for (const WarpEdge& edge : field.edges) {
      for (const auto& [a, b] : {std::pair(edge.first, edge.second), std::pair(edge.second, edge.first)}) {
        const WarpNode& first = field.nodes[static_cast<std::size_t>(a)];
        const WarpNode& second = field.nodes[static_cast<std::size_t>(b)];
        neighbors_[static_cast<std::size_t>(a)].push_back({b, equations_.block_at(a, a), equations_.block_at(a, b),
                                                           gap_between(first, second).gap,
                                                           gap_between(second, first).gap});
      }
    }
  }

  WarpFit fit() {
    const double widest = deformation_limits::first_gate * field_.node_spacing;
    WarpFit found;
    if (rows_.empty()) return found;
    const std::vector<WarpNode> before = field_.nodes;
    match(0.0);
    const std::vector<double> misfits = row_misfits();
    for (int step = 0; step < deformation_limits::steps; ++step) {
      const double part = 1.0 - static_cast<double>(step + 1) / deformation_limits::steps;  // to 0
      match(part * widest);
      move(1.0 + part * (deformation_limits::first_stiffness - 1.0));
    }
    const std::vector<double> by_chance = misfit_by_chance();
    match(0.0);
    found.bent = field_.nodes;
    const std::vector<std::uint8_t> bends = bending(misfits, by_chance);
    const auto num_bent =
        std::count_if(rows_.begin(), rows_.end(), [&](const WarpRow& row) { return bends[part_of(row)] != 0; });
    found.is_bent = 2 * static_cast<std::size_t>(num_bent) > rows_.size();
    found.is_whole = std::find(bends.begin(), bends.end(), 0) == bends.end();
    for (std::size_t node = 0; node < bends.size(); ++node) {
      if (bends[node] == 0) field_.nodes[node] = before[node];
    }
    if (!found.is_whole) match(0.0);
    const auto num_matched =
        std::count_if(rows_.begin(), rows_.end(), [](const WarpRow& row) { return row.shape.weight > 0.0; });
    found.explained = static_cast<double>(num_matched) / static_cast<double>(rows_.size());
    return found;
  }

 private:
  struct Use {  // of a node, by a row
    std::size_t row;
    int k;  // of the row's nodes
    std::array<std::size_t, WarpBinding::blended> blocks;
  };
  struct Neighbor {
    std::int32_t node;
    std::size_t own_block, shared_block;
    Eigen::Vector3d out_before, back_before;
  };

  static std::vector<WarpRow> chosen_rows(const WarpField& field, const OrientedPoints& canonical,
                                          const std::vector<std::int32_t>& in_view,
                                          const std::vector<Eigen::Vector3f>& colors) {
    const std::size_t step =
        std::max<std::size_t>(1, (in_view.size() + deformation_limits::most_rows - 1) / deformation_limits::most_rows);
    std::vector<WarpRow> rows;
    for (std::size_t begin = 0; begin + step <= in_view.size(); begin += step) {
      const auto i = static_cast<std::size_t>(in_view[begin + random_bits(0, begin) % step]);
      const WarpBinding& binding = field.bindings[i];
      WarpRow row;
      row.canonical = {canonical.points[i], canonical.normals[i]};
      row.binding = binding;
      row.num_nodes = binding.num_blended();
      row.weights = binding.weights(field.reach());
      row.brightness = colors.empty() ? std::numeric_limits<float>::quiet_NaN() : luma(colors[i]);
      rows.push_back(row);
    }
    return rows;
  }

  std::vector<std::pair<std::int32_t, std::int32_t>> pairs() const {
    std::vector<std::pair<std::int32_t, std::int32_t>> found;
    for (const WarpEdge& edge : field_.edges) found.emplace_back(edge.first, edge.second);
    for (const WarpRow& row : rows_) {
      for (int a = 0; a < row.num_nodes; ++a) {
        for (int b = a + 1; b < row.num_nodes; ++b) {
          found.emplace_back(std::minmax(row.binding.nodes[static_cast<std::size_t>(a)],
                                         row.binding.nodes[static_cast<std::size_t>(b)]));
        }
      }
    }
    return found;
  }

  // Residuals and their derivatives at the field as it is.
  void match(double gate) {
    constexpr std::int64_t block_size = 256;
    const double widest = std::max(gate, static_cast<double>(shown_.reach.maxCoeff()));
    parallel_blocks(static_cast<std::int64_t>(rows_.size()), block_size, num_threads_,
                    [&](std::int64_t, std::int64_t begin, std::int64_t end) {
                      float x[block_size], y[block_size], z[block_size], squares[block_size];
                      Eigen::Vector3f normals[block_size];
                      for (std::int64_t i = begin; i < end; ++i) {
                        const auto k = i - begin;
                        const WarpRow& row = rows_[static_cast<std::size_t>(i)];
                        const OrientedPoint moved = warped(field_.at(row.binding), row.canonical);
                        x[k] = moved.point.x();
                        y[k] = moved.point.y();
                        z[k] = moved.point.z();
                        normals[k] = moved.normal;
                      }
                      find_nearest_points(tree_, {x, y, z, nearest_.data() + begin, squares, nullptr}, 0, end - begin,
                                          widest);
                      for (std::int64_t i = begin; i < end; ++i) {
                        const auto k = i - begin;
                        linearise(rows_[static_cast<std::size_t>(i)], {x[k], y[k], z[k]}, normals[k],
                                  nearest_[static_cast<std::size_t>(i)], gate);
                      }
                    });
    weigh_colors();
  }

  std::size_t part_of(const WarpRow& row) const {
    return static_cast<std::size_t>(parts_[static_cast<std::size_t>(row.binding.nodes[0])]);
  }

  // The residuals' squares in standard deviations, robustly (Tukey's).
  std::vector<double> row_misfits() const {
    std::vector<double> misfits;
    for (const WarpRow& row : rows_) misfits.push_back(row.misfit);
    return misfits;
  }

  // What the rows of a part say of its bend.
  struct Evidence {
    double gain = 0.0;        // of misfit, of rows that were matched before
    double gain_found = 0.0;  // and of those that are only now
    std::int64_t num_rows = 0, num_matched = 0, num_missing = 0, num_found = 0;  // missing: before, found of those

    void add(double before, double now) {
      const bool is_matched = now < largest_misfit, was_matched = before < largest_misfit;
      ++num_rows;
      num_matched += is_matched ? 1 : 0;
      if (!was_matched) {
        ++num_missing;
        num_found += is_matched ? 1 : 0;
      }
      (was_matched ? gain : gain_found) += before - now;
    }

    bool is_shown() const { return 2 * num_matched > num_rows; }
    // Some rows at its rim are matched by chance, or most that were missing by the bend.
    bool is_bent(double by_chance) const { return gain + (2 * num_found > num_missing ? gain_found : 0.0) > by_chance; }
  };

  // Which nodes are of parts that bend: those whose bend explains more than chance may. A part that the frame does not
  // show goes with what its first node was added to.
  std::vector<std::uint8_t> bending(const std::vector<double>& misfits_before,
                                    const std::vector<double>& by_chance) const {
    std::vector<Evidence> parts(field_.nodes.size());
    for (std::size_t i = 0; i < rows_.size(); ++i) parts[part_of(rows_[i])].add(misfits_before[i], rows_[i].misfit);
    std::vector<std::uint8_t> bends(field_.nodes.size(), 0);
    for (std::size_t node = 0; node < bends.size(); ++node) {
      const auto part = static_cast<std::size_t>(parts_[node]);
      const std::int32_t parent = field_.nodes[node].parents.nodes[0];
      if (part != node) {
        bends[node] = bends[part];
      } else if (parts[node].is_shown()) {
        bends[node] = parts[node].is_bent(by_chance[node]) ? 1 : 0;
      } else if (parent >= 0) {
        bends[node] = bends[static_cast<std::size_t>(parent)];
      }
    }
    return bends;
  }

  // What the bend of each part may explain without there being one: many times what the last step's equations explain
  // of noise alone, of one standard deviation and either sign at each row (Hutchinson's estimate of degrees of freedom,
  // which stiffness makes fewer than the unknowns). An error that neighbours share counts as often as there are rows.
  std::vector<double> misfit_by_chance() {
    equations_.set_right_side_zero();
    const auto noise_of = [&](std::size_t i) {
      return std::sqrt(rows_[i].shape.weight) * (random_bits(1, i) % 2 == 0 ? 1.0 : -1.0);
    };
    for (std::size_t node = 0; node < uses_.size(); ++node) {
      for (const Use& use : uses_[node]) {
        if (!(rows_[use.row].shape.weight > 0.0)) continue;
        equations_.right_side(node) +=
            noise_of(use.row) * rows_[use.row].shape.jacobian[static_cast<std::size_t>(use.k)];
      }
    }
    const std::vector<Vector6> motion = solved();
    std::vector<double> explained(field_.nodes.size(), 0.0), num_rows(field_.nodes.size(), 0.0);
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      const WarpRow& row = rows_[i];
      num_rows[part_of(row)] += 1.0;
      if (!(row.shape.weight > 0.0)) continue;
      double moved = 0.0;
      for (int k = 0; k < row.num_nodes; ++k) {
        const auto j = static_cast<std::size_t>(k);
        moved += row.shape.jacobian[j].dot(motion[static_cast<std::size_t>(row.binding.nodes[j])]);
      }
      explained[part_of(row)] += moved * (2.0 * noise_of(i) - row.shape.weight * moved);
    }
    std::vector<std::uint8_t> went_on(field_.nodes.size(), 0);
    for (std::size_t node = 0; node < was_bending_.size(); ++node) {
      if (was_bending_[node] != 0) went_on[static_cast<std::size_t>(parts_[node])] = 1;
    }
    std::vector<double> by_chance(field_.nodes.size());
    for (std::size_t part = 0; part < by_chance.size(); ++part) {
      const double by_noise =
          went_on[part] != 0 ? deformation_limits::misfit_of_bending : deformation_limits::misfit_by_noise;
      const double shared = deformation_limits::misfit_per_shared * shown_.shared_error;
      by_chance[part] = by_noise * explained[part] + shared * (num_rows[part] - explained[part]);
    }
    return by_chance;
  }

  std::vector<Vector6> solved() const {
    return equations_.solve(deformation_limits::solver_tolerance, deformation_limits::most_solver_steps, num_threads_);
  }

  void linearise(WarpRow& row, const Eigen::Vector3f& point, const Eigen::Vector3f& normal, std::uint32_t slot,
                 double gate) const {
    row.shape.weight = row.color.weight = 0.0;
    row.misfit = largest_misfit;
    if (slot == no_slot) return;
    const auto found = static_cast<Eigen::Index>(tree_.id(slot));
    const Eigen::Vector3f other = shown_.normals.row(found).transpose();
    if (!(normal.dot(other) > deformation_limits::least_neighbor_cosine)) return;
    const Eigen::Vector3f apart = shown_.points.row(found).transpose() - point;
    const double reach = std::max(gate, static_cast<double>(shown_.reach[found]));
    const double off = static_cast<double>(other.dot(apart)), part = off / reach;
    if (!(std::abs(part) < 1.0) || static_cast<double>(apart.norm()) > std::max(gate, std::sqrt(2.0) * reach)) return;
    const double sigma = static_cast<double>(shown_.sigma[found]);
    const double robust = (1.0 - part * part) * (1.0 - part * part);  // Tukey's
    row.misfit = std::min(largest_misfit, reach * reach / (3.0 * sigma * sigma) * (1.0 - robust * (1.0 - part * part)));
    // Along the mean of both normals: on a curved surface the chord between two of its points has no part in it.
    const Eigen::Vector3d direction = 0.5 * (other + normal).cast<double>();
    set(row.shape, row, direction, direction.dot(apart.cast<double>()), robust / (sigma * sigma));
    if (shown_.brightness.size() == 0) return;
    const Eigen::Vector3d gradient = shown_.gradient.row(found).transpose().cast<double>();
    const double expected = static_cast<double>(shown_.brightness[found]) - gradient.dot(apart.cast<double>());
    const double residual = static_cast<double>(row.brightness) - expected;
    if (!std::isfinite(residual)) return;
    row.texture = gradient.norm() * static_cast<double>(shown_.spacing);
    set(row.color, row, gradient, residual, 1.0);
  }

  // direction: in which the point's motion changes the residual.
  void set(WarpEquation& equation, const WarpRow& row, const Eigen::Vector3d& direction, double residual,
           double weight) const {
    equation.residual = residual;
    equation.weight = weight;
    const Eigen::Vector3d canonical = row.canonical.point.cast<double>();
    for (int k = 0; k < row.num_nodes; ++k) {
      const auto j = static_cast<std::size_t>(k);
      equation.jacobian[j] = row.weights[j] * derivative(node_of(row, k), canonical, direction);
    }
  }

  // By how much brightness errs, and by how much the image's exposure differs from the model's, the residuals tell. A
  // gradient that changes it by less from point to point is noise.
  void weigh_colors() {
    std::vector<double> residuals;
    for (const WarpRow& row : rows_) {
      if (row.color.weight > 0.0) residuals.push_back(row.color.residual);
    }
    if (residuals.empty()) return;
    const double exposure = median_of(residuals);
    for (double& residual : residuals) residual = std::abs(residual - exposure);
    const double sigma = std::max(registration_limits::least_brightness_noise, mad_to_sigma * median_of(residuals));
    for (WarpRow& row : rows_) {
      WarpEquation& color = row.color;
      if (!(color.weight > 0.0)) continue;
      color.residual -= exposure;
      const bool tells = row.texture > sigma;
      color.weight = tells ? robust_weight(color.residual, sigma, 1.0 / (sigma * sigma)) : 0.0;
    }
  }

  const WarpNode& node_of(const WarpRow& row, int k) const {
    return field_.nodes[static_cast<std::size_t>(row.binding.nodes[static_cast<std::size_t>(k)])];
  }

  // One step of Gauss and Newton.
  void move(double stiffness) {
    constexpr std::int64_t block_size = 8;
    equations_.set_zero();
    parallel_for(static_cast<std::int64_t>(field_.nodes.size()), block_size, num_threads_, [&](std::int64_t number) {
      const auto node = static_cast<std::int32_t>(number);
      add_rows(node);
      add_edges(node, stiffness);
      add_prior(node);
    });
    const std::vector<Vector6> motion = solved();
    for (std::size_t i = 0; i < field_.nodes.size(); ++i) nacre::move(field_.nodes[i], motion[i]);
  }

  void add_rows(std::int32_t number) {
    const auto node = static_cast<std::size_t>(number);
    for (const Use& use : uses_[node]) {
      const WarpRow& row = rows_[use.row];
      for (const WarpEquation* equation : {&row.shape, &row.color}) {
        if (!(equation->weight > 0.0)) continue;
        const Vector6 own = equation->weight * equation->jacobian[static_cast<std::size_t>(use.k)];
        equations_.right_side(node) += equation->residual * own;
        for (int m = 0; m < row.num_nodes; ++m) {
          const auto other = static_cast<std::size_t>(m);
          equations_.block(use.blocks[other]).noalias() += own * equation->jacobian[other].transpose();
        }
      }
    }
  }

  void add_edges(std::int32_t number, double stiffness) {
    const auto i = static_cast<std::size_t>(number);
    const WarpNode& a = field_.nodes[i];
    for (const Neighbor& neighbor : neighbors_[i]) {
      const WarpNode& b = field_.nodes[static_cast<std::size_t>(neighbor.node)];
      const double size = (b.rest - a.rest).norm();
      if (!(size > 0.0)) continue;
      const double length = deformation_limits::strain * size, held = deformation_limits::change * size;
      WarpGap out = gap_between(a, b), back = gap_between(b, a);
      // In standard deviations, the same for both ways.
      const double strained = std::sqrt(0.5 * (out.gap.squaredNorm() + back.gap.squaredNorm())) / length;
      const double yielding = deformation_limits::even_strain / std::max(deformation_limits::even_strain, strained);
      const double by_rest = stiffness * yielding / (length * length), by_last = stiffness / (held * held);
      const double weight = by_rest + by_last;
      out.gap -= by_last / weight * neighbor.out_before;
      back.gap -= by_last / weight * neighbor.back_before;
      Matrix6& own = equations_.block(neighbor.own_block);
      own.noalias() += weight * out.by_first.transpose() * out.by_first;
      own.bottomRightCorner<3, 3>().diagonal().array() += weight;
      Matrix6& shared = equations_.block(neighbor.shared_block);
      shared.rightCols<3>() -= weight * out.by_first.transpose();
      shared.bottomRows<3>() -= weight * back.by_first;
      equations_.right_side(i).noalias() -= weight * out.by_first.transpose() * out.gap;
      equations_.right_side(i).tail<3>() += weight * back.gap;
    }
  }

  // No step is longer than where the field is anything like linear: what nothing holds stays.
  void add_prior(std::int32_t node) {
    Matrix6& own = equations_.block(equations_.block_at(node, node));
    const double turn = 1.0 / (deformation_limits::largest_turn * deformation_limits::largest_turn);
    own.topLeftCorner<3, 3>().diagonal().array() += turn;
    own.bottomRightCorner<3, 3>().diagonal().array() += 1.0 / (field_.node_spacing * field_.node_spacing);
  }

  WarpField& field_;
  std::vector<std::int32_t> parts_;  // of each node: the first node of its part
  const ShownSurface& shown_;
  int num_threads_;
  const std::vector<std::uint8_t>& was_bending_;
  BlockTree<float> tree_;
  std::vector<WarpRow> rows_;
  std::vector<std::uint32_t> nearest_;  // of the rows, in the tree
  NodeEquations equations_;
  std::vector<std::vector<Use>> uses_;            // of each node
  std::vector<std::vector<Neighbor>> neighbors_;  // likewise
};

}  // namespace

WarpFit register_warp(WarpField& field, const OrientedPoints& canonical, const std::vector<std::int32_t>& in_view,
                      const ShownSurface& shown, int num_threads, const std::vector<std::uint8_t>& was_bending,
                      const std::vector<Eigen::Vector3f>& colors) {
  if (shown.points.rows() == 0) return {};
  return WarpRegistration(field, canonical, in_view, shown, num_threads, was_bending, colors).fit();
}

}  // namespace nacre
