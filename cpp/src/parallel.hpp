// The only file that knows OpenMP. Work is cut into blocks that do not depend on the number of threads, and block
// results are combined in block order, so that every result has the same bits for any number of threads.
#pragma once

#include <algorithm>
#include <cstdint>
#include <exception>
#include <vector>

#ifdef NACRE_OPENMP
#include <omp.h>
#endif

namespace nacre {

// The number of threads meant by an option: 0 is all that the process may use.
inline int resolve_threads(int num_threads) {
#ifdef NACRE_OPENMP
  return num_threads > 0 ? num_threads : omp_get_max_threads();
#else
  (void)num_threads;
  return 1;
#endif
}

// body(block, begin, end) for each block of [0, count); blocks run in any order. The first exception is rethrown.
template <class Body>
void parallel_blocks(std::int64_t count, std::int64_t block_size, int num_threads, Body&& body) {
  const std::int64_t num_blocks = (count + block_size - 1) / block_size;
  const auto run = [&](std::int64_t block) {
    body(block, block * block_size, std::min(count, (block + 1) * block_size));
  };
#ifdef NACRE_OPENMP
  const int threads = static_cast<int>(std::min<std::int64_t>(resolve_threads(num_threads), num_blocks));
  if (threads > 1) {
    std::exception_ptr error;
#pragma omp parallel for schedule(dynamic) num_threads(threads)
    for (std::int64_t block = 0; block < num_blocks; ++block) {
      try {
        run(block);
      } catch (...) {
#pragma omp critical(nacre_parallel_error)
        if (!error) error = std::current_exception();
      }
    }
    if (error) std::rethrow_exception(error);
    return;
  }
#endif
  (void)num_threads;
  for (std::int64_t block = 0; block < num_blocks; ++block) run(block);
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
