// Loops on several threads. Work is cut into blocks that do not depend on the number of threads, and block results are
// combined in block order, so that every result has the same bits for any number of threads.
#pragma once

#include <algorithm>
#include <cstdint>
#include <type_traits>
#include <vector>

namespace nacre {

// What lends the threads: "openmp" or "threads".
const char* thread_backend();

// The number of threads meant by an option: 0 is all that the process may use (OMP_NUM_THREADS where that is set, else
// the processors it may run on; with OpenMP what omp_set_num_threads says).
int resolve_threads(int num_threads);

// run(context, block) for each block of [0, num_blocks), in any order, on the caller's and up to num_threads - 1 other
// threads. The first exception stops the loop and is rethrown; so does the caller's CancelScope.
void run_blocks(std::int64_t num_blocks, int num_threads, void (*run)(void* context, std::int64_t block),
                void* context);

// body(block, begin, end) for each block of [0, count); blocks run in any order.
template <class Body>
void parallel_blocks(std::int64_t count, std::int64_t block_size, int num_threads, Body&& body) {
  const auto run = [&](std::int64_t block) {
    body(block, block * block_size, std::min(count, (block + 1) * block_size));
  };
  using Run = decltype(run);
  run_blocks((count + block_size - 1) / block_size, num_threads,
             [](void* context, std::int64_t block) { (*static_cast<Run*>(context))(block); },
             const_cast<std::remove_const_t<Run>*>(&run));
}

// body(i) for each i of [0, count).
template <class Body>
void parallel_for(std::int64_t count, std::int64_t block_size, int num_threads, Body&& body) {
  parallel_blocks(count, block_size, num_threads, [&](std::int64_t, std::int64_t begin, std::int64_t end) {
    for (std::int64_t i = begin; i < end; ++i) body(i);
  });
}

// The sum over blocks of map(begin, end), added in block order.
template <class T, class Map>
T block_reduce(std::int64_t count, std::int64_t block_size, int num_threads, const T& zero, Map&& map) {
  const std::int64_t num_blocks = (count + block_size - 1) / block_size;
  std::vector<T> partial(static_cast<std::size_t>(num_blocks), zero);
  parallel_blocks(count, block_size, num_threads, [&](std::int64_t block, std::int64_t begin, std::int64_t end) {
    partial[static_cast<std::size_t>(block)] = map(begin, end);
  });
  T total = zero;
  for (const T& value : partial) total += value;
  return total;
}

}  // namespace nacre
