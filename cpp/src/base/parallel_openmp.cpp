// OpenMP's threads: one team for the loops of nacre and those of the program around it.
#include <omp.h>

#include "base/parallel_backend.hpp"

#if defined(__unix__) || defined(__APPLE__)
#include <pthread.h>
#endif

namespace nacre::openmp {
namespace {

// A child process has none of its parent's threads. GCC's OpenMP waits for them forever.
bool is_forked = false;

#if defined(__unix__) || defined(__APPLE__)
[[maybe_unused]] const int noted = pthread_atfork(nullptr, nullptr, [] { is_forked = true; });
#endif

}  // namespace

int usable_threads() { return omp_get_max_threads(); }

void run_team(int num_threads, TeamWork work, void* context) {
  if (is_forked) {
    threads::run_team(num_threads, work, context);
    return;
  }
#pragma omp parallel num_threads(num_threads)
  work(context);
}

}  // namespace nacre::openmp
