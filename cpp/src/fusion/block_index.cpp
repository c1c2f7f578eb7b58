#include "fusion/block_index.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/pose_check.hpp"
#include "camera/point_projection.hpp"
#include "fusion/limits.hpp"

namespace nacre {

BlockIndex BlockIndex::unbounded(const PointModel& model) {
  BlockIndex index(model);
  for (Block& block : index.blocks_) {
    const auto far = static_cast<float>(farthest_place);
    block.box = Box(Eigen::Vector3f::Constant(-far), Eigen::Vector3f::Constant(far));
    block.newest = std::numeric_limits<std::int32_t>::max();
  }
  return index;
}

void BlockIndex::renew(const PointModel& model) {
  blocks_.clear();
  size_ = 0;
  add_new(model);
}

void BlockIndex::measure(const PointModel& model, const std::vector<PointRange>& moved) {
  for (const PointRange& range : moved) measure(model, range.first, blocks_[range.block]);
}

void BlockIndex::measure(const PointModel& model, std::size_t first, Block& block) const {
  block.box.setEmpty();
  block.newest = std::numeric_limits<std::int32_t>::min();
  for (std::size_t i = first; i < first + static_cast<std::size_t>(block.count); ++i) {
    block.box.extend(model.points[i]);
    block.newest = std::max(block.newest, model.last_seen[i]);
  }
}

void BlockIndex::add_new(const PointModel& model) {
  while (size_ < model.points.size()) {
    if (blocks_.empty() || blocks_.back().count == PointProjection::capacity) blocks_.emplace_back();
    Block& block = blocks_.back();
    const std::size_t first = size_ - static_cast<std::size_t>(block.count);
    const std::size_t added = std::min<std::size_t>(PointProjection::capacity, model.points.size() - first);
    size_ = first + added;
    block.count = static_cast<int>(added);
    measure(model, first, block);
  }
}

static std::vector<BlockIndex::Gap>::const_iterator next_gap(const std::vector<BlockIndex::Gap>& gaps,
                                                             std::size_t place) {
  return std::upper_bound(gaps.begin(), gaps.end(), place,
                          [](std::size_t before, const BlockIndex::Gap& gap) { return before < gap.place; });
}

std::size_t BlockIndex::first_gap_behind(std::size_t place) const {
  const auto next = next_gap(gaps_, place);
  return next == gaps_.end() ? std::numeric_limits<std::size_t>::max() : next->place;
}

std::size_t BlockIndex::num_left_before(std::size_t place) const {
  return std::accumulate(gaps_.cbegin(), next_gap(gaps_, place), std::size_t{0},
                         [](std::size_t sum, const Gap& gap) { return sum + gap.count; });
}

std::vector<BlockIndex::Summary> BlockIndex::summaries() const {
  std::vector<Summary> all;
  std::size_t first = 0;
  for (std::size_t k = 0; k < blocks_.size(); ++k) {
    all.push_back({{k, first, blocks_[k].count}, blocks_[k].box, blocks_[k].newest});
    first += static_cast<std::size_t>(blocks_[k].count);
  }
  return all;
}

// Neighbours that have become small become one.
void BlockIndex::keep(const std::vector<std::uint8_t>& flags) {
  std::size_t place = 0, num_before = 0;
  for (Gap& gap : gaps_) {
    for (; place < gap.place; ++place) num_before += static_cast<std::size_t>(flags[place] != 0);
    gap.place = num_before;
  }
  std::size_t kept = 0, next = 0;
  for (const Block& block : blocks_) {
    Block left = block;
    const auto* const first = flags.data() + next;
    left.count = static_cast<int>(block.count - std::count(first, first + block.count, std::uint8_t{0}));
    next += static_cast<std::size_t>(block.count);
    if (left.count == 0) continue;
    if (kept > 0 && blocks_[kept - 1].count + left.count <= PointProjection::capacity) {
      Block& before = blocks_[kept - 1];
      before.count += left.count;
      before.box.extend(left.box);
      before.newest = std::max(before.newest, left.newest);
    } else {
      blocks_[kept++] = left;
    }
  }
  blocks_.resize(kept);
  size_ = 0;
  for (const Block& block : blocks_) size_ += static_cast<std::size_t>(block.count);
}

std::vector<PointRange> BlockIndex::in_view(const ViewVolume& volume, std::int32_t oldest_frame) const {
  std::vector<PointRange> found;
  std::size_t first = 0;
  for (std::size_t k = 0; k < blocks_.size(); ++k) {
    const Block& block = blocks_[k];
    if (block.newest >= oldest_frame && volume.may_hold(block.box)) found.push_back({k, first, block.count});
    first += static_cast<std::size_t>(block.count);
  }
  return found;
}

std::vector<PointRange> BlockIndex::from(std::size_t first) const {
  std::vector<PointRange> found;
  std::size_t begin = 0;
  for (std::size_t k = 0; k < blocks_.size(); ++k) {
    const std::size_t end = begin + static_cast<std::size_t>(blocks_[k].count);
    if (end > first) found.push_back({k, std::max(begin, first), static_cast<int>(end - std::max(begin, first))});
    begin = end;
  }
  return found;
}

// Behind all that is measured, by more than noise, the support of an observation and what counts as one surface, a
// frame says nothing. Beside the image, a point a spacing away stands for surface within it.
ViewVolume observed_volume(const RegisteredFrame& now, const FusionOptions& options, double spacing) {
  const Camera& camera = now.camera;
  float farthest = 0.0F, sigma = 0.0F;
  for (const std::int32_t row : now.frame.valid) {
    farthest = std::max(farthest, now.frame.points(row, 2));
    sigma = std::max(sigma, now.frame.sigma[row]);
  }
  const double across = std::max(1.0, std::abs(camera.fx() / camera.fy()));
  const double behind = static_cast<double>(farthest) + 2.0 * options.support +
                        fusion_limits::behind_sigmas * static_cast<double>(sigma) +
                        fusion_limits::behind_spacings * spacing;
  // Support and spacing are some pixels, whose footprint grows with the depth.
  const double pixels = fusion_limits::behind_pixels;
  const double grown = pixels * (camera.footprint(1.0) - camera.footprint(0.0));
  const double limit =
      grown < 0.5 ? (behind + pixels * camera.footprint(0.0)) / (1.0 - grown) : std::numeric_limits<double>::infinity();
  return {camera, now.world_from_camera, 0.0, across * spacing, limit};
}

}  // namespace nacre
