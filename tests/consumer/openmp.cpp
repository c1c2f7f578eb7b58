// A stranger's program with loops of its own in OpenMP: nacre's loops run on the same threads, and stay out of its
// loops.
#include <omp.h>

#include <cstdio>
#include <cstring>
#include <fstream>
#include <string>

#include "nacre/kdtree.hpp"
#include "nacre/system.hpp"

namespace {

int failures = 0;

void check(bool condition, const char* what) {
  std::printf("%-40s %s\n", what, condition ? "ok" : "FAILED");
  failures += !condition;
}

// 0 where the system does not tell.
int threads_of_process() {
  std::ifstream status("/proc/self/status");
  std::string word;
  int number = 0;
  while (status >> word) {
    if (word == "Threads:") status >> number;
  }
  return number;
}

}  // namespace

int main() {
  std::printf("backend: %s\n", nacre::parallel_backend());
  const bool shared = std::strcmp(nacre::parallel_backend(), "openmp") == 0;
  omp_set_num_threads(3);
  if (shared) check(nacre::default_threads() == 3, "omp_set_num_threads is heard");

  const nacre::Points points = nacre::Points::Random(20000, 3);
  const nacre::KdTree tree(points);
  int threads = 0;
#pragma omp parallel
#pragma omp master
  threads = threads_of_process();
  const nacre::Neighbors expected = tree.query(points, 4);
  if (shared) check(threads_of_process() == threads, "one team of threads");

  bool same = true;
#pragma omp parallel for reduction(&& : same)
  for (int i = 0; i < 12; ++i) same = same && tree.query(points, 4).distances == expected.distances;
  check(same, "calls inside a parallel loop");
  if (shared) check(threads_of_process() == threads, "and no thread more");
  return failures == 0 ? 0 : 1;
}
