#include <atomic>
#include <stdexcept>
#include <thread>
#include <vector>

#include "base/parallel.hpp"
#include "base/random.hpp"
#include "doctest/doctest.h"

#if defined(__unix__) || defined(__APPLE__)
#include <sys/wait.h>
#include <unistd.h>
#endif

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

TEST_CASE("an exception of any thread leaves the next loop whole") {
  for (int round = 0; round < 100; ++round) {
    CHECK_THROWS_AS(parallel_for(64, 1, 4, [](std::int64_t) { throw std::logic_error("each"); }), std::logic_error);
    std::atomic<int> visits{0};
    parallel_for(64, 1, 4, [&](std::int64_t) { ++visits; });
    CHECK(visits == 64);
  }
}

namespace {

// A loop in each block of a loop.
std::int64_t nested_sum(int threads) {
  return block_reduce(40, 3, threads, std::int64_t{0}, [&](std::int64_t begin, std::int64_t end) {
    return block_reduce(end - begin, 1, threads, std::int64_t{0}, [&](std::int64_t i, std::int64_t) {
      return block_reduce(100, 7, threads, std::int64_t{0},
                          [&](std::int64_t first, std::int64_t last) { return (last - first) * (begin + i); });
    });
  });
}

}  // namespace

TEST_CASE("loops inside loops, and several callers at once") {
  const std::int64_t expected = 100 * 39 * 40 / 2;
  for (int threads : {1, 2, 4}) CHECK(nested_sum(threads) == expected);
  std::vector<std::int64_t> sums(6);
  std::vector<std::thread> callers;
  for (std::int64_t& sum : sums) callers.emplace_back([&sum] { sum = nested_sum(3); });
  for (std::thread& caller : callers) caller.join();
  CHECK(sums == std::vector<std::int64_t>(6, expected));
}

#if defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define FORK_IS_WATCHED  // the thread sanitizer ends children that start threads
#endif
#endif

#if (defined(__unix__) || defined(__APPLE__)) && !defined(FORK_IS_WATCHED)
TEST_CASE("a forked process goes on, and so do its children") {
  const std::int64_t expected = nested_sum(4);  // the parent's threads are there
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    alarm(60);  // ends a child that hangs
    if (nested_sum(4) != expected) _exit(1);
    const pid_t grandchild = fork();
    if (grandchild == 0) _exit(nested_sum(4) == expected ? 0 : 2);
    int status = 0;
    waitpid(grandchild, &status, 0);
    _exit(WIFEXITED(status) ? WEXITSTATUS(status) : 3);
  }
  CHECK(nested_sum(4) == expected);
  int status = 0;
  waitpid(child, &status, 0);
  CHECK(WIFEXITED(status));
  CHECK(WEXITSTATUS(status) == 0);
}
#endif
