#include <cstdint>
#include <thread>
#include <vector>

#include "base/scratch.hpp"
#include "doctest/doctest.h"

using nacre::Scratch;

TEST_CASE("memory comes back to the next who needs as much") {
  const float* first = nullptr;
  {
    const Scratch<float> values(300000);
    first = values.data();
    CHECK(reinterpret_cast<std::uintptr_t>(first) % 64 == 0);
  }
  {
    const Scratch<double> tiny(10);
    CHECK(static_cast<const void*>(tiny.data()) != first);  // not a large block for little
    const Scratch<float> same(290000);
    CHECK(same.data() == first);
    const Scratch<float> other(290000);
    CHECK(other.data() != first);
  }
  const Scratch<float> larger(600000);
  CHECK(larger.data() != first);
}

TEST_CASE("memory that is in use is nobody else's") {
  std::vector<Scratch<int>> arrays;
  for (int round = 0; round < 3; ++round) {
    for (int i = 0; i < 20; ++i) {
      arrays.emplace_back(static_cast<std::size_t>(1000 * (i + 1)));
      for (int k = 0; k < 1000 * (i + 1); ++k) arrays.back().data()[k] = i;
    }
    for (int i = 0; i < 20; ++i) {
      for (int k = 0; k < 1000 * (i + 1); ++k) REQUIRE(arrays[static_cast<std::size_t>(i)].data()[k] == i);
    }
    arrays.clear();
  }
}

TEST_CASE("moving takes the memory along, also to another thread") {
  Scratch<int> a(100), b(200);
  int* const of_b = b.data();
  a = std::move(b);
  CHECK(a.data() == of_b);
  std::thread([moved = std::move(a)]() mutable { moved.data()[199] = 1; }).join();
}
