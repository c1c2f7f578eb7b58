#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "base/parked_files.hpp"
#include "base/random.hpp"
#include "doctest/doctest.h"
#include "loops/key_frame_views.hpp"
#include "loops/limits.hpp"
#include "loops/loop_closure.hpp"
#include "meshes.hpp"
#include "nacre/model_options.hpp"
#include "nacre/simulation.hpp"
#include "parking.hpp"

using namespace nacre;
using namespace nacre_test;

namespace {

namespace fs = std::filesystem;

constexpr int newest = loops_limits::newest_key_frames;
constexpr int recalled = loops_limits::recalled_key_frames;
constexpr int num_views = newest + 2 * recalled;

KeyFrameView view_of(int key_frame) {
  const auto number = static_cast<float>(key_frame);
  KeyFrameView view{Points::Constant(7, 3, number), Points::Constant(7, 3, 0.5F * number), {}};
  view.outline.push_back(
      {Eigen::Vector3d::Constant(key_frame), Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(), 0.1});
  return view;
}

struct Views {
  ParkingFolder folder{"nacre-test-key-frame-views"};
  ParkedFiles files{folder.path.string()};
  KeyFrameViews views{files};
  std::vector<std::string> expected;
  Views() {
    for (int k = 0; k < num_views; ++k) {
      expected.push_back(bytes_of(view_of(k)));
      views.add(view_of(k));
    }
  }
  // Those that are in memory: all that can be read while there are no files.
  int num_in_memory() {
    const fs::path away = folder.path.string() + "-away";
    fs::rename(folder.path, away);
    int count = 0;
    for (int k = 0; k < num_views; ++k) {
      try {
        count += views[k]->points.rows() == 7;
      } catch (const fs::filesystem_error&) {
      }
    }
    fs::rename(away, folder.path);
    return count;
  }
};

// A long wall with boxes before it: a camera walks along it, jumps back to where it began, and takes itself to have
// come nearer on the way.
class Walk {
 public:
  static constexpr int num_frames = 140, num_steps = 100;

  Walk() {
    Mesh wall = quad({-3.0, -2.0, 2.0}, {50.0, 0.0, 0.0}, {0.0, 4.0, 0.0});
    for (int i = 0; i < 400; ++i) {
      const auto part = [&](int j) { return random_uniform(5, static_cast<std::uint64_t>(10 * i + j)); };
      const Eigen::Vector3d corner(0.12 * i - 3.0, 2.4 * part(0) - 1.2, 2.0 - 0.4 * part(1));
      const Eigen::Vector3d across(0.1 + 0.4 * part(2), 0.2 * part(3) - 0.1, 0.2 * part(4) - 0.1);
      wall = together(wall, quad(corner, across, {0.1 * part(5), 0.1 + 0.4 * part(6), 0.2 * part(7) - 0.1}));
    }
    const MeshTree tree(wall.vertices, wall.triangles);
    for (int k = 0; k < num_frames; ++k) views_.push_back(simulate_depth(tree, camera_, pose(k)));
  }

  std::vector<LoopReport> reports(const std::string& folder, int num_threads) const {
    ModelOptions options;
    options.num_threads = options.registration.num_threads = num_threads;
    ParkedFiles files(folder);
    LoopClosure loops(camera_, options, files);
    std::vector<LoopReport> all;
    for (int k = 0; k < num_frames; ++k) {
      const Frame frame = make_frame(views_[static_cast<std::size_t>(k)], camera_);
      SurfaceObserver observer(camera_, options.fusion);
      observer.look_at(frame, ColorsRef(Colors()), num_threads);
      AlignResult alignment;
      alignment.target_from_source = Eigen::Translation3d(0.0, 0.0, 0.001 * k) * pose(k);
      alignment.center = pose(k).translation();
      alignment.information = 1e6 * Matrix6::Identity();
      const DepthView view{frame.points.col(2), frame.sigma};
      loops.park();
      all.push_back(loops.add_frame({k, frame, view, observer, {}, alignment, 0.01, false, false}));
    }
    CHECK(loops.num_key_frames() > newest + recalled);
    return all;
  }

 private:
  static Pose pose(int k) {
    Pose pose = Pose::Identity();
    pose.translation().x() = 0.4 * (k % num_steps);
    return pose;
  }

  Camera camera_ = Camera::pinhole(104, 78, 90.0, 90.0, 51.5, 38.5);
  std::vector<DepthImage> views_;
};

}  // namespace

TEST_CASE("loops close to the same bits whether key frames leave memory or not, for any number of threads") {
  const Walk walk;
  const std::vector<LoopReport> stayed = walk.reports("", 1);
  int num_closed = 0;
  for (const int num_threads : {1, 3}) {
    const ParkingFolder folder("nacre-test-key-frame-views");
    const std::vector<LoopReport> left = walk.reports(folder.path.string(), num_threads);
    REQUIRE(left.size() == stayed.size());
    for (std::size_t k = 0; k < left.size(); ++k) {
      CHECK(left[k].frame == stayed[k].frame);
      CHECK(left[k].distance == stayed[k].distance);
      REQUIRE(left[k].corrections.size() == stayed[k].corrections.size());
      for (std::size_t i = 0; i < left[k].corrections.size(); ++i) {
        CHECK(left[k].corrections[i].matrix() == stayed[k].corrections[i].matrix());
      }
      num_closed += left[k].frame.has_value() ? 1 : 0;
    }
  }
  CHECK(num_closed > 0);
}

TEST_CASE("what older key frames saw leaves memory, and is the same when it is asked for") {
  Views there;
  CHECK(there.folder.files().size() == 0);
  there.views.park();
  CHECK(there.folder.files().size() == num_views - newest);
  CHECK(there.num_in_memory() == newest + recalled);
  for (int round = 0; round < 3; ++round) {
    for (int i = 0; i < num_views; ++i) {
      const auto random = random_bits(5, static_cast<std::uint64_t>(i + num_views * round));
      const int k = round == 0 ? i : static_cast<int>(random % static_cast<std::uint64_t>(num_views));
      CHECK(bytes_of(*there.views[k]) == there.expected[static_cast<std::size_t>(k)]);
    }
    CHECK(there.num_in_memory() == newest + recalled);
  }
}

TEST_CASE("what is held stays when its key frame leaves memory") {
  Views there;
  const auto first = there.views[0];
  there.views.park();
  for (int k = 0; k < num_views; ++k) there.views[k];
  CHECK(bytes_of(*first) == there.expected[0]);
}

TEST_CASE("what a key frame saw is replaced wherever it is") {
  Views there;
  there.views.park();
  for (const int k : {0, num_views - newest - 1, num_views - 1}) {
    there.views.replace(k, view_of(-k - 1));
    there.expected[static_cast<std::size_t>(k)] = bytes_of(view_of(-k - 1));
  }
  CHECK(there.folder.files().size() == num_views - newest);
  for (int k = 0; k < num_views; ++k) {
    CHECK(bytes_of(*there.views[k]) == there.expected[static_cast<std::size_t>(k)]);
  }
}

TEST_CASE("without a folder all stay in memory") {
  ParkedFiles nowhere("");
  KeyFrameViews views(nowhere);
  for (int k = 0; k < num_views; ++k) views.add(view_of(k));
  views.park();
  for (int k = 0; k < num_views; ++k) CHECK(views[k]->points(0, 0) == static_cast<float>(k));
}

TEST_CASE("where what key frames saw cannot be written, it stays") {
  Views there;
  std::ofstream(there.folder.path) << "no folder";
  CHECK_THROWS_AS(there.views.park(), fs::filesystem_error);
  for (int k = 0; k < num_views; ++k) {
    CHECK(bytes_of(*there.views[k]) == there.expected[static_cast<std::size_t>(k)]);
  }
  fs::remove(there.folder.path);
  there.views.park();
  CHECK(there.folder.files().size() == num_views - newest);
}

TEST_CASE("a damaged file of a key frame is named") {
  Views there;
  there.views.park();
  for (int k = 0; k < num_views; ++k) there.views[k];  // the first is on disk alone
  for (const fs::directory_entry& entry : fs::directory_iterator(there.folder.path)) {
    std::fstream stream(entry.path(), std::ios::in | std::ios::out | std::ios::binary);
    stream.seekp(100);
    stream.put('!');
  }
  CHECK_THROWS_WITH_AS(there.views[0], doctest::Contains(".points"), fs::filesystem_error);
}
