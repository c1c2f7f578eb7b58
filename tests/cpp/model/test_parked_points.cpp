#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include "base/random.hpp"
#include "doctest/doctest.h"
#include "fusion/correction.hpp"
#include "fusion/exposure.hpp"
#include "model/checkpoint/fields.hpp"
#include "model/limits.hpp"
#include "model/parked_points.hpp"
#include "parking.hpp"

using namespace nacre;
using namespace nacre_test;

namespace {

namespace fs = std::filesystem;

constexpr std::int32_t num_frames = 40;
constexpr std::int64_t num_points = 40000;

// A wall along x, whose points came and were last seen one after the other.
PointModel wall() {
  PointModel model;
  PointAttribute warmth{"warmth", 1, {}};
  for (std::int64_t i = 0; i < num_points; ++i) {
    const auto part = static_cast<float>(i) / static_cast<float>(num_points);
    const auto bits = random_bits(3, static_cast<std::uint64_t>(i));
    model.points.emplace_back(20.0F * part, static_cast<float>(bits % 1000) / 1000.0F, 2.0F);
    model.normals.emplace_back(0.0F, 0.0F, -1.0F);
    model.colors.emplace_back(Eigen::Vector3f::Constant(static_cast<float>(bits % 200)));
    warmth.values.push_back(part);
    model.confidence.push_back(part);
    model.last_seen.push_back(static_cast<std::int32_t>(part * static_cast<float>(num_frames)));
    model.observations.push_back(3);
    model.free_space_violations.push_back(static_cast<std::uint8_t>(bits % 3));
  }
  model.attributes.push_back(warmth);
  return model;
}

// From the middle of a part of the wall.
ViewVolume view_at(double x) {
  Pose pose = Pose::Identity();
  pose.translation().x() = x;
  return {Camera::pinhole(160, 120, 140.0, 140.0, 79.5, 59.5), pose, 0.0, 0.0, 4.0};
}

std::vector<Pose> corrections() {
  std::vector<Pose> all;
  for (int frame = 0; frame < num_frames; ++frame) {
    Pose pose = Pose::Identity();
    pose.linear() = Eigen::AngleAxisd(0.002 * frame, Eigen::Vector3d::UnitY()).toRotationMatrix();
    pose.translation() = Eigen::Vector3d(0.001 * frame, 0.0, -0.002 * frame);
    all.push_back(pose);
  }
  return all;
}

struct Parked {
  ParkingFolder folder{"nacre-test-parked-points"};
  PointModel model = wall();
  BlockIndex blocks{model};
  ParkedFiles files{folder.path.string()};
  ParkedPoints parked{files};
  Parked() { parked.park(model, blocks, num_points / 2, num_frames, view_at(19.0)); }
  void recall_all() {
    parked.recall(model, blocks, std::vector{Box(Eigen::Vector3f::Constant(-99.0F), Eigen::Vector3f::Constant(99.0F))});
  }
};

}  // namespace

TEST_CASE("points that leave a model are those that were not seen for longest, and come back where they were") {
  Parked there;
  CHECK(there.model.size() <= num_points / 2);
  CHECK(there.model.size() + there.parked.size() == num_points);
  CHECK(there.model.points.front().x() > 5.0F);  // the oldest part of the wall has left
  there.parked.recall(there.model, there.blocks, std::vector{view_at(19.0)});
  CHECK(there.model.size() <= num_points / 2);  // nothing of it is in this view
  there.parked.recall(there.model, there.blocks, std::vector{view_at(3.0)});
  const std::int64_t some = there.model.size();
  CHECK(some > num_points / 2);
  CHECK(some < num_points);
  there.recall_all();
  CHECK(there.parked.size() == 0);
  CHECK(bytes_of(there.model) == bytes_of(wall()));
  CHECK(there.folder.files().empty());
}

TEST_CASE("what happens to a model happens to the points that have left it, to the bit and in its order") {
  Parked there;
  PointModel stayed = wall();
  const Eigen::Vector3f gain(1.01F, 0.99F, 1.02F);
  std::int64_t num_settlings = 0;
  SUBCASE("when they are read") {}
  SUBCASE("in part before") { num_settlings = 1; }
  SUBCASE("before") { num_settlings = num_points / static_cast<std::int64_t>(model_limits::parcel_points); }
  for (int k = 0; k < 2; ++k) {
    move_points(stayed, corrections(), 1);
    expose_points(stayed, gain);
    move_points(there.model, corrections(), 1);
    expose_points(there.model, gain);
    there.blocks.renew(there.model);
    there.parked.move(corrections());
    there.parked.expose(gain);
    there.parked.park(there.model, there.blocks, num_points / 4, num_frames, view_at(19.0));
    for (std::int64_t i = 0; i < num_settlings; ++i) there.parked.settle_some();
  }
  PointModel all;
  there.parked.for_each_part(there.model, there.blocks,
                             [&](const PointModel& part) { append_range(all, part, 0, part.points.size()); });
  CHECK(bytes_of(all) == bytes_of(stayed));
  there.recall_all();
  CHECK(bytes_of(there.model) == bytes_of(stayed));
}

TEST_CASE("points that leave little by little, from between others that have left, are in few files") {
  ParkingFolder folder{"nacre-test-parked-points"};
  PointModel model = wall();
  BlockIndex blocks(model);
  ParkedFiles files(folder.path.string());
  ParkedPoints parked(files);
  for (std::int64_t most = num_points; most >= num_points / 4; most -= num_points / 20) {
    const double x = most > num_points / 2 ? 5.0 : 19.0;  // first a part stays of the middle of what is to leave
    parked.park(model, blocks, most, num_frames, view_at(x));
  }
  const auto per_file = static_cast<std::int64_t>(model_limits::parcel_points);
  CHECK(parked.size() > 2 * num_points / 3);
  CHECK(static_cast<std::int64_t>(folder.files().size()) <= 1 + (parked.size() + per_file - 1) / per_file);
  parked.recall_all(model, blocks);
  CHECK(bytes_of(model) == bytes_of(wall()));
}

TEST_CASE("a file that is damaged or missing is named, and the model stays as it is") {
  Parked there;
  const std::string before = bytes_of(there.model);
  const std::int64_t num_parked = there.parked.size();
  const fs::path file = there.folder.files().front();
  {
    std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
    stream.seekp(200);
    stream.put('!');
  }
  CHECK_THROWS_WITH_AS(there.recall_all(), doctest::Contains(file.filename().string().c_str()), fs::filesystem_error);
  fs::remove(file);
  CHECK_THROWS_WITH_AS(there.recall_all(), doctest::Contains(file.filename().string().c_str()), fs::filesystem_error);
  CHECK(bytes_of(there.model) == before);
  CHECK(there.parked.size() == num_parked);
}

TEST_CASE("where points cannot be written, they stay") {
  ParkingFolder folder{"nacre-test-parked-points"};
  std::ofstream(folder.path) << "no folder";
  PointModel model = wall();
  BlockIndex blocks(model);
  ParkedFiles files(folder.path.string());
  ParkedPoints parked(files);
  CHECK_THROWS_AS(parked.park(model, blocks, num_points / 2, num_frames, view_at(19.0)), fs::filesystem_error);
  CHECK(bytes_of(model) == bytes_of(wall()));
  CHECK(parked.size() == 0);
}
