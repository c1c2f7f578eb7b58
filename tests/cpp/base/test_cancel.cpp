#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>

#include "base/parallel.hpp"
#include "clouds.hpp"
#include "doctest/doctest.h"
#include "nacre/cancel.hpp"
#include "nacre/consolidation.hpp"
#include "nacre/kdtree.hpp"

using namespace nacre;
using std::chrono::milliseconds;

namespace {

void work_for_ever(int threads) {
  parallel_for(1 << 30, 1, threads, [](std::int64_t) { std::this_thread::sleep_for(milliseconds(1)); });
}

}  // namespace

TEST_CASE("a flag that another thread sets ends a call") {
  for (int threads : {1, 2}) {
    std::atomic<bool> is_unwanted{false};
    std::thread button([&] {
      std::this_thread::sleep_for(milliseconds(50));
      is_unwanted = true;
    });
    const CancelScope scope([&] { return is_unwanted.load(); });
    CHECK_THROWS_AS(work_for_ever(threads), Cancelled);
    button.join();
  }
}

TEST_CASE("what the function throws comes out of the call") {
  const CancelScope scope([]() -> bool { throw std::logic_error("enough"); });
  CHECK_THROWS_WITH_AS(work_for_ever(2), "enough", std::logic_error);
}

TEST_CASE("the innermost scope is asked, and none any more after its end") {
  int outer = 0;
  const CancelScope scope([&] { return ++outer > 0; });
  {
    const CancelScope nothing(nullptr);
    std::this_thread::sleep_for(milliseconds(120));
    CancelScope::check();
  }
  CHECK(outer == 0);
  CHECK_THROWS_AS(CancelScope::check(), Cancelled);
  CHECK(outer == 1);
}

TEST_CASE("progress ends the iterations of a consolidation, and keeps what they reached") {
  const Points points = sphere_cloud(4000, 1).points;
  ConsolidateOptions options;
  options.radius = 0.05;
  options.num_points = 500;
  options.iterations = 3;
  const Consolidated three = consolidate(points, options);
  CHECK(three.iterations == 3);

  options.iterations = 10;
  std::vector<int> told;
  options.progress = [&](int done, int total) {
    CHECK(total == 10);
    told.push_back(done);
    return done < 3;
  };
  const Consolidated stopped = consolidate(points, options);
  CHECK(told == std::vector<int>{1, 2, 3});
  CHECK(stopped.iterations == 3);
  CHECK(stopped.points == three.points);
}
