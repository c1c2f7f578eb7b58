#include "model/parked_points.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <system_error>
#include <utility>

#include "fusion/deformation.hpp"
#include "fusion/exposure.hpp"
#include "model/checkpoint/checkpoint.hpp"
#include "model/checkpoint/fields.hpp"
#include "model/checkpoint/seal.hpp"
#include "model/limits.hpp"
#include "nacre/checkpoint.hpp"

#ifdef _WIN32
#include <io.h>
#else
#include <unistd.h>
#endif

namespace nacre {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const char* what, const fs::path& path) {
  throw fs::filesystem_error(what, path, std::error_code(errno, std::generic_category()));
}

// The file is complete, or not there.
void write_file(const fs::path& path, const std::string& bytes) {
  fs::path unfinished = path;
  unfinished += ".tmp";
  std::FILE* const file = std::fopen(unfinished.string().c_str(), "wb");
  if (file == nullptr) fail("points cannot be written", path);
  bool is_good = std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size() && std::fflush(file) == 0;
#ifdef _WIN32
  is_good = is_good && _commit(_fileno(file)) == 0;
#else
  is_good = is_good && fsync(fileno(file)) == 0;
#endif
  const int error = errno;
  is_good = std::fclose(file) == 0 && is_good;
  if (!is_good) {
    std::remove(unfinished.string().c_str());
    errno = error;
    fail("points cannot be written", path);
  }
  fs::rename(unfinished, path);
}

std::string read_file(const fs::path& path) {
  errno = 0;
  std::ifstream stream(path, std::ios::binary);
  if (!stream) fail("points of the model that were written cannot be read", path);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

void remove_file(const std::string& folder, const std::string& file) {
  std::error_code ignored;
  fs::remove(fs::path(folder) / file, ignored);
}

template <class Value>
void append_values(std::vector<Value>& to, const std::vector<Value>& from, std::size_t first, std::size_t count) {
  const auto begin = from.begin() + static_cast<std::ptrdiff_t>(first);
  to.insert(to.end(), begin, begin + static_cast<std::ptrdiff_t>(count));
}

std::string new_token() {
  std::random_device device;
  char text[17];
  std::snprintf(text, sizeof(text), "%08x%08x", static_cast<unsigned>(device()), static_cast<unsigned>(device()));
  return text;
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

ParkedPoints::ParkedPoints(const std::string& folder)
    : folder_(folder.empty() ? folder : fs::absolute(folder).string()), token_(new_token()) {}

// What no checkpoint names nobody will ask for.
ParkedPoints::~ParkedPoints() {
  for (const Parcel& parcel : parcels_) {
    if (!parcel.is_named) remove_file(folder_, parcel.file);
  }
}

ParkedPoints::Parcel ParkedPoints::write(PointModel points) {
  Parcel parcel;
  parcel.count = points.size();
  Box box;
  for (const Eigen::Vector3f& point : points.points) box.extend(point);
  parcel.lowest = box.min();
  parcel.highest = box.max();
  parcel.frames = points.last_seen;
  std::sort(parcel.frames.begin(), parcel.frames.end());
  parcel.frames.erase(std::unique(parcel.frames.begin(), parcel.frames.end()), parcel.frames.end());
  parcel.first_change = static_cast<std::int64_t>(changes_.size());
  parcel.file = token_ + "-" + std::to_string(next_++) + ".points";
  std::string bytes(sealed_header_size, '\0');
  StateWriter archive(bytes);
  archive(points);
  write_file(fs::path(folder_) / parcel.file, sealed(std::move(bytes)));
  return parcel;
}

PointModel ParkedPoints::read(const Parcel& parcel) const {
  const fs::path path = fs::path(folder_) / parcel.file;
  const std::string bytes = read_file(path);
  PointModel points;
  try {
    check_seal(bytes);
    StateReader archive(bytes, sealed_header_size);
    archive(points);
    archive.require_end();
    archive.require(points.size() == parcel.count && is_surface(points, std::numeric_limits<std::int32_t>::max()),
                    "the points are not all there, or no surface");
  } catch (const CheckpointError& error) {
    throw CheckpointError("points of the model in " + path.string() + ": " + error.what(), error.offset());
  }
  for (auto i = static_cast<std::size_t>(parcel.first_change); i < changes_.size(); ++i) {
    const Change& change = changes_[i];
    if (change.tilt != 0.0) {
      straighten_points(points, change.poses, change.tilt, 1);
    } else if (!change.poses.empty()) {
      move_points(points, change.poses, 1);
    }
    if (change.gain != Eigen::Vector3f::Ones()) expose_points(points, change.gain);
    if (change.forgets_violations) {
      std::fill(points.free_space_violations.begin(), points.free_space_violations.end(), std::uint8_t{0});
    }
  }
  return points;
}

void ParkedPoints::release(const Parcel& parcel) {
  if (parcel.is_named) {
    released_.push_back({parcel.file, num_checkpoints_});
  } else {
    remove_file(folder_, parcel.file);
  }
}

void ParkedPoints::note_checkpoint() {
  ++num_checkpoints_;
  for (Parcel& parcel : parcels_) parcel.is_named = true;
  const auto is_old = [&](const Released& released) { return released.checkpoint + 2 <= num_checkpoints_; };
  for (const Released& released : released_) {
    if (is_old(released)) remove_file(folder_, released.file);
  }
  released_.erase(std::remove_if(released_.begin(), released_.end(), is_old), released_.end());
}

// Files are written before anything leaves: where one cannot be, all is as it was.
void ParkedPoints::park(PointModel& model, BlockIndex& blocks, std::int64_t most_points, std::int32_t oldest_frame,
                        const ViewVolume& view) {
  if (!is_on() || model.size() <= most_points) return;
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

  fs::create_directories(folder_);
  std::vector<std::uint8_t> flags(model.points.size(), 1);
  std::vector<std::pair<std::size_t, Parcel>> leaving;  // with their places
  try {
    for (std::size_t k = 0; k < candidates.size();) {
      const std::size_t first = candidates[k].range.first;
      std::size_t end = first;
      for (; k < candidates.size() && candidates[k].range.first == end && end - first < model_limits::parcel_points &&
             (end == first || !blocks.has_mark_within(first, end + 1));
           ++k) {
        end += static_cast<std::size_t>(candidates[k].range.count);
        if (blocks.has_mark_within(first, end)) {  // what is parked between two of its points divides it
          end = blocks.first_mark_behind(first);
          ++k;
          break;
        }
      }
      PointModel points;
      append_range(points, model, first, end - first);
      leaving.emplace_back(first, write(std::move(points)));
      std::fill(flags.begin() + static_cast<std::ptrdiff_t>(first), flags.begin() + static_cast<std::ptrdiff_t>(end),
                std::uint8_t{0});
    }
  } catch (...) {
    for (const auto& [_, parcel] : leaving) remove_file(folder_, parcel.file);
    throw;
  }
  for (auto& [place, parcel] : leaving) {
    size_ += parcel.count;
    const std::size_t k = blocks.add_mark(place);
    parcels_.insert(parcels_.begin() + static_cast<std::ptrdiff_t>(k), std::move(parcel));
  }
  model.keep(flags);
  blocks.keep(flags);
}

void ParkedPoints::recall(PointModel& model, BlockIndex& blocks, const ViewVolume& volume) {
  std::vector<std::uint8_t> is_wanted;
  for (const Parcel& parcel : parcels_) is_wanted.push_back(volume.may_hold(Box(parcel.lowest, parcel.highest)));
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
  PointModel whole;
  append_range(whole, model, 0, 0);  // its colours and attributes
  std::vector<std::size_t> marks;
  std::vector<Parcel> left;
  std::size_t done = 0;
  std::int64_t num_back = 0;
  for (std::size_t k = 0; k < parcels_.size(); ++k) {
    const std::size_t place = blocks.marks()[k];
    append_range(whole, model, done, place - done);
    done = place;
    if (!is_wanted[k]) {
      marks.push_back(whole.points.size());
      continue;
    }
    const PointModel back = read(parcels_[k]);
    append_range(whole, back, 0, back.points.size());
    num_back += back.size();
  }
  append_range(whole, model, done, model.points.size() - done);
  for (std::size_t k = 0; k < parcels_.size(); ++k) {
    if (is_wanted[k]) {
      release(parcels_[k]);
    } else {
      left.push_back(std::move(parcels_[k]));
    }
  }
  size_ -= num_back;
  parcels_ = std::move(left);
  if (parcels_.empty()) changes_.clear();
  model = std::move(whole);
  blocks.renew(model);
  blocks.set_marks(std::move(marks));
}

void ParkedPoints::add(Change change) {
  if (parcels_.empty()) return;
  changes_.push_back(std::move(change));
  std::size_t num_poses = 0;
  for (const Change& kept : changes_) num_poses += kept.poses.size();
  if (num_poses > model_limits::most_kept_motions) settle();
}

// Each point moves with the frame that last observed it: bounds hold those of the box with each of these.
void ParkedPoints::move(const std::vector<Pose>& corrections) {
  for (Parcel& parcel : parcels_) {
    const Box before(parcel.lowest, parcel.highest);
    Box after;
    for (const std::int32_t frame : parcel.frames) {
      const Eigen::Isometry3f motion(corrections[static_cast<std::size_t>(frame)].cast<float>());
      const Eigen::Vector3f center = motion * before.center();
      const Eigen::Vector3f half = 0.5F * (motion.linear().cwiseAbs() * before.sizes());
      after.extend(Box(center - half, center + half));
    }
    parcel.lowest = after.min();
    parcel.highest = after.max();
  }
  Change change;
  change.poses = corrections;
  add(std::move(change));
}

// Bounds are not known before it is done.
void ParkedPoints::straighten(const std::vector<Pose>& poses, double tilt) {
  if (parcels_.empty()) return;
  Change change;
  change.poses = poses;
  change.tilt = tilt;
  changes_.push_back(std::move(change));
  settle();
}

void ParkedPoints::expose(const Eigen::Vector3f& gain) {
  Change change;
  change.gain = gain;
  add(std::move(change));
}

void ParkedPoints::forget_violations() {
  Change change;
  change.forgets_violations = true;
  add(std::move(change));
}

// Writes all anew, so that nothing is left to be done.
void ParkedPoints::settle() {
  std::vector<Parcel> settled;
  for (const Parcel& parcel : parcels_) settled.push_back(write(read(parcel)));
  for (const Parcel& parcel : parcels_) release(parcel);
  for (Parcel& parcel : settled) parcel.first_change = 0;
  parcels_ = std::move(settled);
  changes_.clear();
}

}  // namespace nacre
