#include "region/support_planes.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>

#include "base/parallel.hpp"
#include "base/random.hpp"
#include "region/limits.hpp"

namespace nacre {
namespace {

enum Side : std::uint8_t { on = 1, before, behind };

struct Search {
  const CoarseFrame& frame;
  const RegionOptions& options;
  int num_threads;

  float pixel_of(const Cell& cell) const { return cell.footprint / static_cast<float>(frame.step); }

  bool is_on(const PlaneCut& cut, const Cell& cell) const {
    return std::abs(cut.height(cell.point)) < cut.margin(cell.sigma, pixel_of(cell)) && cut.has_normal(cell.normal);
  }

  std::int64_t count(const SupportPlane& plane, const std::vector<int>& rows) const {
    const PlaneCut cut(plane, options.plane_margin);
    return std::count_if(rows.begin(), rows.end(), [&](int i) { return is_on(cut, frame[i]); });
  }

  // Least squares over the cells of a plane, weighted by 1 / sigma^2; false where they span none.
  bool refine(SupportPlane& plane, const std::vector<int>& rows) const {
    const PlaneCut cut(plane, options.plane_margin);
    double sum = 0.0;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    Eigen::Matrix3d square = Eigen::Matrix3d::Zero();
    for (const int i : rows) {
      const Cell& cell = frame[i];
      if (!is_on(cut, cell)) continue;
      const double spread = std::max(1e-5, static_cast<double>(cell.sigma)), weight = 1.0 / (spread * spread);
      const Eigen::Vector3d point = cell.point.cast<double>();
      sum += weight;
      mean += weight * point;
      square += weight * point * point.transpose();
    }
    if (!(sum > 0.0)) return false;
    mean /= sum;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(square / sum - mean * mean.transpose());
    if (!(solver.eigenvalues()(1) > 1e-12)) return false;
    Eigen::Vector3d normal = solver.eigenvectors().col(0);
    if (normal.dot(plane.normal) < 0.0) normal = -normal;
    plane = {normal, normal.dot(mean)};
    return true;
  }

  // The plane of most cells: a few cells with their normals, drawn at random, as in RANSAC (Fischler and Bolles 1981),
  // and the best of these refined.
  std::optional<SupportPlane> largest_plane(const std::vector<int>& rows, std::int64_t least,
                                            std::uint64_t seed) const {
    if (rows.empty()) return std::nullopt;
    std::vector<int> voters;
    const std::size_t stride = (rows.size() + region_limits::most_voters - 1) / region_limits::most_voters;
    for (std::size_t i = 0; i < rows.size(); i += stride) voters.push_back(rows[i]);
    std::vector<std::pair<std::int64_t, int>> votes(
        region_limits::num_hypotheses);  // negative, so that the most come first
    const auto hypothesis = [&](int k) {
      const auto row = random_bits(seed, static_cast<std::uint64_t>(k)) % rows.size();
      const Cell& cell = frame[rows[row]];
      const Eigen::Vector3d normal = cell.normal.cast<double>();
      return SupportPlane{normal, normal.dot(cell.point.cast<double>())};
    };
    parallel_for(region_limits::num_hypotheses, 8, num_threads, [&](std::int64_t k) {
      const int number = static_cast<int>(k);
      votes[static_cast<std::size_t>(k)] = {-count(hypothesis(number), voters), number};
    });
    std::sort(votes.begin(), votes.end());
    std::vector<std::pair<std::int64_t, SupportPlane>> found(region_limits::num_refined);
    parallel_for(region_limits::num_refined, 1, num_threads, [&](std::int64_t k) {
      SupportPlane plane = hypothesis(votes[static_cast<std::size_t>(k)].second);
      for (int i = 0; i < region_limits::num_refinements; ++i) {
        if (!refine(plane, voters)) return;
      }
      found[static_cast<std::size_t>(k)] = {count(plane, rows), plane};
    });
    const auto best =
        std::max_element(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    if (best->first < least) return std::nullopt;
    return best->second;
  }

  // 0 for the cells that are put aside.
  std::vector<std::uint8_t> sides_of(const SupportPlane& plane, const std::vector<std::uint8_t>& left) const {
    const PlaneCut cut(plane, options.plane_margin);
    std::vector<std::uint8_t> sides(left.size(), 0);
    for (std::size_t i = 0; i < left.size(); ++i) {
      if (left[i] == 0) continue;
      const Cell& cell = frame.cells[i];
      const int side = cut.side(cell.point, cell.normal, cell.sigma, pixel_of(cell));
      sides[i] = side > 0 ? before : side < 0 ? behind : on;
    }
    return sides;
  }

  // What hangs on the back of a plane is small against it, as the edge of a table is. And something stands on it, or it
  // goes on beyond the image; then what stands on it may also outweigh what hangs, by size and length of contact.
  bool is_support(const std::vector<std::uint8_t>& sides) const {
    const CellGroups groups = connect(frame, sides);
    std::vector<double> contact(groups.size.size(), 0.0);
    std::vector<std::uint8_t> side_of(groups.size.size(), 0);
    for (int i = 0; i < frame.size(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      if (groups.group[k] < 0) continue;
      const auto group = static_cast<std::size_t>(groups.group[k]);
      side_of[group] = sides[k];
      if (sides[k] == on) continue;
      bool touches = false;
      frame.for_neighbours(i, 2, [&](int j, int steps) {
        touches = touches || (sides[static_cast<std::size_t>(j)] == on && are_linked(frame[i], frame[j], steps));
      });
      contact[group] += touches;
    }
    double standing = 0.0, hanging = 0.0, standing_weight = 0.0, hanging_weight = 0.0;
    for (std::size_t g = 0; g < side_of.size(); ++g) {
      if (!(contact[g] > 0.0)) continue;
      (side_of[g] == before ? standing : hanging) += groups.size[g];
      (side_of[g] == before ? standing_weight : hanging_weight) += contact[g] * groups.size[g];
    }
    const auto size = static_cast<std::int32_t>(std::count(sides.begin(), sides.end(), on));
    std::vector<std::int32_t> is_on(sides.size());
    std::transform(sides.begin(), sides.end(), is_on.begin(), [](std::uint8_t side) { return side == on ? 0 : -1; });
    const bool goes_on = cut_off(border_cells(frame, is_on, 1)[0], size) > region_limits::goes_on;
    const bool is_edge = hanging < region_limits::small_part * size;
    return goes_on ? is_edge || hanging_weight < standing_weight
                   : is_edge && standing >= options.min_object * frame.size();
  }
};

}  // namespace

std::vector<SupportPlane> put_planes_aside(const CoarseFrame& frame, const RegionOptions& options, int num_threads,
                                           std::vector<std::uint8_t>& left, std::vector<std::uint8_t>& on_plane) {
  const Search search{frame, options, num_threads};
  std::vector<SupportPlane> planes;
  const auto num_points = std::count(left.begin(), left.end(), std::uint8_t{1});
  const auto least = static_cast<std::int64_t>(region_limits::least_plane * static_cast<double>(num_points)) + 1;
  std::uint64_t seed = 0;
  bool found = true;
  while (found && planes.size() < region_limits::most_planes) {
    found = false;
    std::vector<int> rows;
    for (int i = 0; i < frame.size(); ++i) {
      if (left[static_cast<std::size_t>(i)] != 0 && frame[i].normal.squaredNorm() > 0.0F) rows.push_back(i);
    }
    for (int candidate = 0; candidate < region_limits::num_candidates && !found; ++candidate) {
      const std::optional<SupportPlane> plane = search.largest_plane(rows, least, ++seed);
      if (!plane) break;
      const std::vector<std::uint8_t> sides = search.sides_of(*plane, left);
      found = search.is_support(sides);
      if (found) planes.push_back(*plane);
      for (std::size_t i = 0; found && i < sides.size(); ++i) {
        if (sides[i] == on) on_plane[i] = 1;
        if (sides[i] != before) left[i] = 0;
      }
      rows.erase(
          std::remove_if(rows.begin(), rows.end(), [&](int i) { return sides[static_cast<std::size_t>(i)] == on; }),
          rows.end());
    }
  }
  return planes;
}

}  // namespace nacre
