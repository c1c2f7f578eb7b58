#include "model/parked_points.hpp"

#include <algorithm>
#include <functional>
#include <iterator>
#include <limits>
#include <utility>

#include "fusion/correction.hpp"
#include "fusion/point_arrays.hpp"
#include "model/checkpoint/fields.hpp"
#include "model/checkpoint/surface_check.hpp"
#include "model/limits.hpp"

namespace nacre {
namespace {

template <class Value>
void append_values(std::vector<Value>& to, const std::vector<Value>& from, std::size_t first, std::size_t count) {
  const auto begin = from.begin() + static_cast<std::ptrdiff_t>(first);
  to.insert(to.end(), begin, begin + static_cast<std::ptrdiff_t>(count));
}

// As expose_points one after the other, all at once: as many gains as there were frames would take long.
void expose_points(PointModel& points, const std::vector<Eigen::Vector3f>& gains, std::size_t first) {
  constexpr std::size_t group = 16;
  using Lanes = Eigen::Array<float, 3, group>;
  for (std::size_t i = 0; i < points.colors.size(); i += group) {
    const std::size_t count = std::min(group, points.colors.size() - i);
    Lanes colors = Lanes::Zero();
    for (std::size_t k = 0; k < count; ++k) colors.col(static_cast<Eigen::Index>(k)) = points.colors[i + k];
    for (std::size_t g = first; g < gains.size(); ++g) {
      colors = (colors.colwise() * gains[g].array()).min(255.0F);
    }
    for (std::size_t k = 0; k < count; ++k) {
      Eigen::Vector3f& color = points.colors[i + k];
      if (color.allFinite()) color = colors.col(static_cast<Eigen::Index>(k));
    }
  }
}

// Frames, each once, in order.
std::vector<std::int32_t> distinct(const std::vector<std::int32_t>& frames) {
  const auto [first, last] = std::minmax_element(frames.begin(), frames.end());
  std::vector<std::uint8_t> is_among(static_cast<std::size_t>(*last - *first) + 1);
  for (const std::int32_t frame : frames) is_among[static_cast<std::size_t>(frame - *first)] = 1;
  std::vector<std::int32_t> found;
  for (std::size_t i = 0; i < is_among.size(); ++i) {
    if (is_among[i] != 0) found.push_back(*first + static_cast<std::int32_t>(i));
  }
  return found;
}

// Points, and how many of a model's are before them.
struct PlacedPoints {
  std::size_t place;
  PointModel points;
};

// So many values a point. In memory that is there as far as it goes: what is behind moves back, the last first.
template <class Value, class ValuesOf>
void insert_values(std::vector<Value>& values, const std::vector<PlacedPoints>& parts, const ValuesOf& values_of,
                   const Value& missing, std::size_t channels = 1) {
  std::size_t end = values.size(), shift = 0;
  for (const PlacedPoints& part : parts) shift += channels * part.points.points.size();
  values.resize(end + shift, missing);
  const auto at = [&](std::size_t i) { return values.begin() + static_cast<std::ptrdiff_t>(i); };
  for (auto part = parts.rbegin(); part != parts.rend(); ++part) {
    const std::size_t place = channels * part->place, count = channels * part->points.points.size();
    std::move_backward(at(place), at(end), at(end + shift));
    end = place;
    shift -= count;
    const std::vector<Value>& added = std::invoke(values_of, part->points);
    if (added.empty()) {
      std::fill_n(at(place + shift), count, missing);
    } else {
      std::copy(added.begin(), added.end(), at(place + shift));
    }
  }
}

const std::vector<float>& values_of_attribute(const PointModel& points, const std::string& name) {
  static const std::vector<float> none;
  for (const PointAttribute& attribute : points.attributes) {
    if (attribute.name == name) return attribute.values;
  }
  return none;
}

// Colours and attributes that some lack are not known. In the order of their places.
void insert_points(PointModel& model, const std::vector<PlacedPoints>& parts) {
  const float not_known = std::numeric_limits<float>::quiet_NaN();
  bool with_colors = !model.colors.empty();
  std::size_t num_points = model.points.size();
  for (const PlacedPoints& part : parts) {
    num_points += part.points.points.size();
    with_colors = with_colors || !part.points.colors.empty();
    append_range(model, part.points, 0, 0);  // its attributes
  }
  make_room(model, num_points);
  for (PointAttribute& attribute : model.attributes) {
    const auto values_of = [&](const PointModel& points) -> const auto& {
      return values_of_attribute(points, attribute.name);
    };
    insert_values(attribute.values, parts, values_of, not_known, static_cast<std::size_t>(attribute.num_channels));
  }
  const Eigen::Vector3f unknown_vector = Eigen::Vector3f::Constant(not_known);
  if (with_colors) insert_values(model.colors, parts, &PointModel::colors, unknown_vector);
  insert_values(model.points, parts, &PointModel::points, unknown_vector);
  insert_values(model.normals, parts, &PointModel::normals, unknown_vector);
  insert_values(model.confidence, parts, &PointModel::confidence, not_known);
  insert_values(model.last_seen, parts, &PointModel::last_seen, std::int32_t{0});
  insert_values(model.observations, parts, &PointModel::observations, std::uint8_t{0});
  insert_values(model.free_space_violations, parts, &PointModel::free_space_violations, std::uint8_t{0});
}

}  // namespace

void append_range(PointModel& model, const PointModel& more, std::size_t first, std::size_t count) {
  constexpr float unknown = std::numeric_limits<float>::quiet_NaN();
  const std::size_t before = model.points.size();
  append_values(model.points, more.points, first, count);
  append_values(model.normals, more.normals, first, count);
  append_values(model.confidence, more.confidence, first, count);
  append_values(model.last_seen, more.last_seen, first, count);
  append_values(model.observations, more.observations, first, count);
  append_values(model.free_space_violations, more.free_space_violations, first, count);
  if (!more.colors.empty()) {
    model.colors.resize(before, Eigen::Vector3f::Constant(unknown));
    append_values(model.colors, more.colors, first, count);
  } else if (!model.colors.empty()) {
    model.colors.resize(before + count, Eigen::Vector3f::Constant(unknown));
  }
  for (const PointAttribute& attribute : more.attributes) {
    const auto is_same = [&](const PointAttribute& other) { return other.name == attribute.name; };
    auto known = std::find_if(model.attributes.begin(), model.attributes.end(), is_same);
    if (known == model.attributes.end()) {
      model.attributes.push_back({attribute.name, attribute.num_channels, {}});
      known = std::prev(model.attributes.end());
    }
    const auto channels = static_cast<std::size_t>(attribute.num_channels);
    known->values.resize(before * channels, unknown);
    append_values(known->values, attribute.values, first * channels, count * channels);
  }
  for (PointAttribute& attribute : model.attributes) {
    attribute.values.resize((before + count) * static_cast<std::size_t>(attribute.num_channels), unknown);
  }
}

ParkedPoints::Parcel ParkedPoints::write(PointModel points) {
  Parcel parcel;
  parcel.count = points.size();
  Box box;
  for (const Eigen::Vector3f& point : points.points) box.extend(point);
  parcel.lowest = box.min();
  parcel.highest = box.max();
  parcel.frames = distinct(points.last_seen);
  parcel.first_motion = static_cast<std::int64_t>(motions_.size());
  parcel.first_gain = static_cast<std::int64_t>(gains_.size());
  parcel.file = files_.write(points);
  return parcel;
}

PointModel ParkedPoints::read(const Parcel& parcel) const {
  const auto check = [&](const StateReader& archive, const PointModel& points) {
    const auto num_frames = static_cast<std::size_t>(parcel.frames.back()) + 1;
    archive.require(points.size() == parcel.count && is_surface(points, num_frames),
                    "the points are not all there, or no surface");
  };
  auto points = files_.read<PointModel>(parcel.file, check);
  for (auto i = static_cast<std::size_t>(parcel.first_motion); i < motions_.size(); ++i) {
    move_points(points, motions_[i], 1);
  }
  expose_points(points, gains_, static_cast<std::size_t>(parcel.first_gain));
  if (parcel.forgets_violations) {
    std::fill(points.free_space_violations.begin(), points.free_space_violations.end(), std::uint8_t{0});
  }
  return points;
}

// Points that leave become one file with what left from between and beside them before: small files would become ever
// more.
std::vector<ParkedPoints::Leaving> ParkedPoints::divided(const std::vector<BlockIndex::Summary>& blocks,
                                                         const std::vector<BlockIndex::Gap>& gaps) {
  std::vector<Leaving> all;
  std::size_t parcel = 0;
  for (std::size_t k = 0; k < blocks.size();) {
    const std::size_t first = blocks[k].range.first;
    std::size_t end = first;
    for (; k < blocks.size() && blocks[k].range.first == end; ++k)
      end += static_cast<std::size_t>(blocks[k].range.count);
    while (parcel < gaps.size() && gaps[parcel].place < first) ++parcel;
    Leaving now{first, first, parcel, parcel};
    std::size_t count = 0;
    const auto begin_next = [&] {
      if (now.end > now.first || now.end_parcel > now.first_parcel + 1) all.push_back(now);
      now = {now.end, now.end, parcel, parcel};
      count = 0;
    };
    while (true) {
      const std::size_t next_gap = parcel < gaps.size() ? gaps[parcel].place : std::numeric_limits<std::size_t>::max();
      if (next_gap == now.end) {
        if (count + gaps[parcel].count > model_limits::parcel_points) begin_next();
        count += gaps[parcel].count;
        now.end_parcel = ++parcel;
      } else if (now.end < end) {
        if (count >= model_limits::parcel_points) begin_next();
        const std::size_t last = std::min({end, next_gap, now.end + model_limits::parcel_points - count});
        count += last - now.end;
        now.end = last;
      } else {
        break;
      }
    }
    begin_next();
  }
  return all;
}

PointModel ParkedPoints::gathered(const PointModel& model, const BlockIndex& blocks, const Leaving& leaving) const {
  PointModel points;
  std::size_t done = leaving.first;
  for (std::size_t k = leaving.first_parcel; k < leaving.end_parcel; ++k) {
    const std::size_t place = blocks.gaps()[k].place;
    append_range(points, model, done, place - done);
    done = place;
    const PointModel before = read(parcels_[k]);
    append_range(points, before, 0, before.points.size());
  }
  append_range(points, model, done, leaving.end - done);
  return points;
}

// Files are written before anything leaves: where one cannot be, all is as it was.
void ParkedPoints::park(PointModel& model, BlockIndex& blocks, std::int64_t most_points, std::int32_t oldest_frame,
                        const ViewVolume& view) {
  if (!files_.is_on() || model.size() <= most_points) return;
  blocks.renew(model);
  std::vector<BlockIndex::Summary> candidates = blocks.summaries();
  candidates.erase(
      std::remove_if(candidates.begin(), candidates.end(),
                     [&](const auto& block) { return block.newest >= oldest_frame || view.may_hold(block.box); }),
      candidates.end());
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const auto& a, const auto& b) { return a.newest < b.newest; });
  const auto wanted =
      model.size() - static_cast<std::int64_t>(model_limits::part_in_memory * static_cast<double>(most_points));
  std::int64_t num_chosen = 0;
  std::size_t num_blocks = 0;
  while (num_blocks < candidates.size() && num_chosen < wanted) num_chosen += candidates[num_blocks++].range.count;
  candidates.resize(num_blocks);
  if (candidates.empty()) return;
  std::sort(candidates.begin(), candidates.end(),
            [](const auto& a, const auto& b) { return a.range.first < b.range.first; });

  const std::vector<Leaving> leaving = divided(candidates, blocks.gaps());
  std::vector<Parcel> written;
  try {
    for (const Leaving& part : leaving) written.push_back(write(gathered(model, blocks, part)));
  } catch (...) {
    for (const Parcel& parcel : written) files_.release(parcel.file);
    throw;
  }
  take_out(model, blocks, leaving, std::move(written));
}

void ParkedPoints::take_out(PointModel& model, BlockIndex& blocks, const std::vector<Leaving>& leaving,
                            std::vector<Parcel> written) {
  std::vector<std::uint8_t> flags(model.points.size(), 1);
  std::vector<Parcel> parcels;
  std::vector<BlockIndex::Gap> gaps;
  std::size_t k = 0;
  const auto keep_until = [&](std::size_t end) {
    for (; k < end; ++k) {
      gaps.push_back(blocks.gaps()[k]);
      parcels.push_back(std::move(parcels_[k]));
    }
  };
  for (std::size_t i = 0; i < leaving.size(); ++i) {
    const Leaving& part = leaving[i];
    keep_until(part.first_parcel);
    for (; k < part.end_parcel; ++k) files_.release(parcels_[k].file);
    gaps.push_back({part.first, static_cast<std::size_t>(written[i].count)});
    parcels.push_back(std::move(written[i]));
    std::fill(flags.begin() + static_cast<std::ptrdiff_t>(part.first),
              flags.begin() + static_cast<std::ptrdiff_t>(part.end), std::uint8_t{0});
    size_ += static_cast<std::int64_t>(part.end - part.first);
  }
  keep_until(parcels_.size());
  parcels_ = std::move(parcels);
  blocks.set_gaps(std::move(gaps));
  model.keep(flags);
  blocks.keep(flags);
  give_back_room(model);
}

void ParkedPoints::recall(PointModel& model, BlockIndex& blocks, const std::vector<ViewVolume>& volumes) {
  std::vector<std::uint8_t> is_wanted;
  for (const Parcel& parcel : parcels_) {
    const Box box(parcel.lowest, parcel.highest);
    is_wanted.push_back(
        std::any_of(volumes.begin(), volumes.end(), [&](const ViewVolume& volume) { return volume.may_hold(box); }));
  }
  recall(model, blocks, is_wanted);
}

void ParkedPoints::recall(PointModel& model, BlockIndex& blocks, const std::vector<Box>& near) {
  std::vector<std::uint8_t> is_wanted;
  for (const Parcel& parcel : parcels_) {
    const Box box(parcel.lowest, parcel.highest);
    is_wanted.push_back(std::any_of(near.begin(), near.end(), [&](const Box& other) { return box.intersects(other); }));
  }
  recall(model, blocks, is_wanted);
}

// All are read before the model changes.
void ParkedPoints::recall(PointModel& model, BlockIndex& blocks, const std::vector<std::uint8_t>& is_wanted) {
  if (std::find(is_wanted.begin(), is_wanted.end(), std::uint8_t{1}) == is_wanted.end()) return;
  std::vector<PlacedPoints> back;
  std::vector<BlockIndex::Gap> gaps;
  std::vector<Parcel> left;
  std::size_t num_back = 0;
  for (std::size_t k = 0; k < parcels_.size(); ++k) {
    const auto [place, count] = blocks.gaps()[k];
    if (is_wanted[k]) {
      back.push_back({place, read(parcels_[k])});
      num_back += count;
    } else {
      gaps.push_back({place + num_back, count});
    }
  }
  insert_points(model, back);
  for (std::size_t k = 0; k < parcels_.size(); ++k) {
    if (is_wanted[k]) {
      files_.release(parcels_[k].file);
    } else {
      left.push_back(std::move(parcels_[k]));
    }
  }
  size_ -= static_cast<std::int64_t>(num_back);
  parcels_ = std::move(left);
  if (parcels_.empty()) {
    motions_.clear();
    gains_.clear();
  }
  blocks.renew(model);
  blocks.set_gaps(std::move(gaps));
}

// Each point moves with the frame that last observed it: bounds hold those of the box with each of these.
void ParkedPoints::move(const std::vector<Pose>& corrections) {
  for (Parcel& parcel : parcels_) {
    const Box before(parcel.lowest, parcel.highest);
    Box after;
    for (const std::int32_t frame : parcel.frames) {
      after.extend(moved(before, corrections[static_cast<std::size_t>(frame)]));
    }
    parcel.lowest = after.min();
    parcel.highest = after.max();
  }
  if (parcels_.empty()) return;
  motions_.push_back(corrections);
  std::size_t num_poses = 0;
  for (const std::vector<Pose>& motion : motions_) num_poses += motion.size();
  while (num_poses > model_limits::most_kept_motions && !settle_some()) continue;
}

// Bounds are not known before it is done.
void ParkedPoints::straighten(const std::vector<Pose>& poses, double tilt) {
  std::vector<Parcel> straight;
  for (const Parcel& parcel : parcels_) {
    PointModel points = read(parcel);
    straighten_points(points, poses, tilt, 1);
    straight.push_back(write(std::move(points)));
  }
  replace_all(std::move(straight));
}

void ParkedPoints::expose(const Eigen::Vector3f& gain) {
  if (!parcels_.empty() && gain != Eigen::Vector3f::Ones()) gains_.push_back(gain);
}

void ParkedPoints::forget_violations() {
  for (Parcel& parcel : parcels_) parcel.forgets_violations = true;
}

bool ParkedPoints::settle_some() {
  if (motions_.empty()) return false;
  int num_settled = 0;
  for (Parcel& parcel : parcels_) {
    if (is_within(parcel.first_motion, motions_.size())) {
      if (num_settled++ == model_limits::settled_parcels) return false;
      Parcel settled = write(read(parcel));
      files_.release(parcel.file);
      parcel = std::move(settled);
    }
  }
  for (Parcel& parcel : parcels_) parcel.first_motion = 0;
  motions_.clear();
  return true;
}

void ParkedPoints::replace_all(std::vector<Parcel> parcels) {
  for (const Parcel& parcel : parcels_) files_.release(parcel.file);
  for (Parcel& parcel : parcels) parcel.first_motion = parcel.first_gain = 0;
  parcels_ = std::move(parcels);
  motions_.clear();
  gains_.clear();
}

}  // namespace nacre
