#include <stdexcept>
#include <vector>

#include "base/parallel.hpp"
#include "base/random.hpp"
#include "doctest/doctest.h"

using namespace nacre;

TEST_CASE("every index once, in blocks that do not depend on the threads") {
  for (std::int64_t count : {0, 1, 7, 8, 9, 1000}) {
    for (int threads : {0, 1, 3, 16}) {
      std::vector<int> visits(static_cast<std::size_t>(count), 0);
      parallel_blocks(count, 8, threads, [&](std::int64_t block, std::int64_t begin, std::int64_t end) {
        if (begin != 8 * block || end != std::min<std::int64_t>(count, begin + 8)) throw std::logic_error("block");
        for (std::int64_t i = begin; i < end; ++i) ++visits[static_cast<std::size_t>(i)];
      });
      parallel_for(count, 5, threads, [&](std::int64_t i) { ++visits[static_cast<std::size_t>(i)]; });
      CHECK(visits == std::vector<int>(static_cast<std::size_t>(count), 2));
    }
  }
}

TEST_CASE("a sum has the same bits for any number of threads") {
  const auto sum = [](int threads) {
    return block_reduce(100000, 64, threads, 0.0, [](std::int64_t begin, std::int64_t end) {
      double part = 0;
      for (std::int64_t i = begin; i < end; ++i) part += random_normal(1, static_cast<std::uint64_t>(i));
      return part;
    });
  };
  for (int threads : {0, 2, 3, 8}) CHECK(sum(threads) == sum(1));
  CHECK(block_reduce(0, 64, 2, 5.0, [](std::int64_t, std::int64_t) { return 1.0; }) == 5.0);
}

TEST_CASE("an exception of a block reaches the caller") {
  for (int threads : {1, 4}) {
    CHECK_THROWS_WITH_AS(parallel_for(1000, 1, threads,
                                      [](std::int64_t i) {
                                        if (i == 700) throw std::runtime_error("seven hundred");
                                      }),
                         "seven hundred", std::runtime_error);
  }
}
