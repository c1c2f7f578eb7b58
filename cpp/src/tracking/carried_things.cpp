#include "tracking/carried_things.hpp"

#include <cmath>
#include <limits>
#include <utility>

#include "base/limits.hpp"
#include "base/statistics.hpp"
#include "tracking/limits.hpp"

namespace nacre {
namespace {

float no_depth() { return std::numeric_limits<float>::quiet_NaN(); }
float depth_of(const Cell& cell) { return cell.has_point() ? cell.point.z() : no_depth(); }

}  // namespace

// What holds together of a frame.
class CarriedThings::Pieces {
 public:
  Pieces(const CoarseFrame& cells, const CarriedThings& before)
      : groups_(connect(cells, std::vector<std::uint8_t>(cells.cells.size(), 1))), pieces_(groups_.size.size()) {
    std::vector<float> depths;
    for (int i = 0; i < cells.size(); ++i) {
      if (!cells[i].has_point()) continue;
      depths.push_back(cells[i].point.z());
      if (group(i) < 0) continue;
      Piece& piece = pieces_[static_cast<std::size_t>(group(i))];
      piece.depths.push_back(cells[i].point.z());
      piece.num_staying += before.stays(cells[i], i);
      piece.num_carried += before.is_carried_[static_cast<std::size_t>(i)];
    }
    if (depths.empty()) return;
    const float near = static_cast<float>(tracking_limits::nearer_than_scene) * median_of(std::move(depths));
    const std::vector<std::int32_t> at_border = border_cells(cells, groups_.group, pieces_.size());
    for (std::size_t k = 0; k < pieces_.size(); ++k) {
      Piece& piece = pieces_[k];
      const auto size = static_cast<double>(piece.depths.size());
      piece.was_carried = 2.0 * piece.num_carried > size;
      const bool comes_in = size >= tracking_limits::least_core * cells.size() && at_border[k] > 0;
      piece.may_be_carried = piece.num_staying >= tracking_limits::least_staying * size &&
                             (piece.was_carried || (comes_in && median_of(piece.depths) < near));
    }
  }

  bool may_be_carried(int i) const {
    return group(i) >= 0 && pieces_[static_cast<std::size_t>(group(i))].may_be_carried;
  }
  bool was_carried(int i) const { return group(i) >= 0 && pieces_[static_cast<std::size_t>(group(i))].was_carried; }

 private:
  struct Piece {
    std::vector<float> depths;
    int num_staying = 0, num_carried = 0;  // cells that are as they were, and that were carried
    bool was_carried = false, may_be_carried = false;
  };
  std::int32_t group(int i) const { return groups_.group[static_cast<std::size_t>(i)]; }

  CellGroups groups_;
  std::vector<Piece> pieces_;
};

bool CarriedThings::stays(const Cell& cell, int i) const {
  const float noise = static_cast<float>(base_limits::noise_sigmas * std::sqrt(2.0)) * cell.sigma;
  return std::abs(cell.point.z() - depth_[i]) <= noise;
}

bool CarriedThings::most_has_changed(const CoarseFrame& cells, const Pieces& pieces) const {
  int num_known = 0, num_changed = 0;
  for (int i = 0; i < cells.size(); ++i) {
    if (!is_known(cells[i], i) || pieces.may_be_carried(i)) continue;
    ++num_known;
    num_changed += !stays(cells[i], i);
  }
  return 2 * num_changed >= num_known;
}

void CarriedThings::renew(const CoarseFrame& cells, const Pieces& pieces) {
  for (int i = 0; i < cells.size(); ++i) {
    const bool is_carried = pieces.may_be_carried(i);
    if (is_carried && is_carried_[static_cast<std::size_t>(i)] == 0) {
      if (found_.size() == 0) found_ = Values::Constant(cells.size(), no_depth());
      found_[i] = depth_of(cells[i]);
      cells.for_neighbours(i, 1, [&](int j, int) { found_[j] = std::fmax(found_[j], found_[i]); });
    }
    is_carried_[static_cast<std::size_t>(i)] = is_carried;
    if (!is_carried || !is_known(cells[i], i)) depth_[i] = depth_of(cells[i]);
  }
}

void CarriedThings::look_at(const CoarseFrame& cells, const Camera& camera, std::int64_t frame) {
  found_.resize(0);
  scene_.resize(0, 0);
  if (depth_.size() == 0) {
    is_carried_.assign(cells.cells.size(), 0);
    depth_ = Values::Constant(cells.size(), no_depth());
  }
  const Pieces pieces(cells, *this);
  const bool has_changed = most_has_changed(cells, pieces);
  if (has_changed) {
    since_ = std::exchange(changed_, frame);
    renew(cells, pieces);
  }
  std::vector<std::uint8_t> is_left_out(cells.cells.size(), 0);
  bool is_all = true;
  for (int i = 0; i < cells.size(); ++i) {
    if (!pieces.may_be_carried(i) || !(has_changed || pieces.was_carried(i))) continue;
    is_all = false;
    is_left_out[static_cast<std::size_t>(i)] = 1;
    cells.for_neighbours(i, 1, [&](int j, int) { is_left_out[static_cast<std::size_t>(j)] = 1; });
  }
  if (!is_all) scene_ = pixels_without(is_left_out, cells, camera.width(), camera.height());
}

}  // namespace nacre
