// Where a model's points are, block by block: a frame has to do with those that its camera sees, however many there
// are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "camera/view_volume.hpp"
#include "fusion/registered_frame.hpp"
#include "nacre/fusion.hpp"

namespace nacre {

// Points of a model in a row, at most as many as are projected at once.
struct PointRange {
  std::size_t block;  // of the index
  std::size_t first;  // of the model's points
  int count;
};

// Points that were inserted one after the other are near each other: blocks of them in a row, each with its bounds. It
// follows the model: whoever changes points, adds or removes them tells it.
class BlockIndex {
 public:
  BlockIndex() = default;
  explicit BlockIndex(const PointModel& model) { renew(model); }
  static BlockIndex unbounded(const PointModel& model);  // all points may be anywhere: no block is left out

  void renew(const PointModel& model);                                          // all of it has changed
  void measure(const PointModel& model, const std::vector<PointRange>& moved);  // points of these have
  void add_new(const PointModel& model);                                        // points were added behind
  void keep(const std::vector<std::uint8_t>& flags);                            // see PointModel::keep

  // Those that may have points in a volume, last seen by oldest_frame or later; in the model's order.
  std::vector<PointRange> in_view(const ViewVolume& volume, std::int32_t oldest_frame = 0) const;
  struct Summary {
    PointRange range;
    Box box;
    std::int32_t newest;  // frame that last observed one of the points
  };
  std::vector<Summary> summaries() const;

  // Gaps between points, in order: how many points are before each, and how many have left from it. They stay between
  // the same points.
  struct Gap {
    std::size_t place;
    std::size_t count;
  };
  const std::vector<Gap>& gaps() const { return gaps_; }
  void set_gaps(std::vector<Gap> gaps) { gaps_ = std::move(gaps); }
  std::size_t first_gap_behind(std::size_t place) const;
  std::size_t num_left_before(std::size_t place) const;  // from gaps up to there

  // Those from a point on.
  std::vector<PointRange> from(std::size_t first) const;

 private:
  struct Block {
    int count = 0;
    Box box;
    std::int32_t newest = 0;  // frame that last observed one of the points
  };
  void measure(const PointModel& model, std::size_t first, Block& block) const;

  std::vector<Block> blocks_;
  std::size_t size_ = 0;  // of the model
  std::vector<Gap> gaps_;
};

// What a frame can say anything about: points of the model elsewhere are as if they were not there. spacing: of the
// model [m].
ViewVolume observed_volume(const RegisteredFrame& now, const FusionOptions& options, double spacing);

}  // namespace nacre
