/// What the library runs on.
#pragma once

namespace nacre {

/// The instruction set whose kernels run: "baseline", "avx2" (x86-64-v3) or "avx512" (x86-64-v4); the best that the
/// processor has, or the one that the environment variable NACRE_SIMD names. Throws std::runtime_error when that is not
/// one of these, or not in the processor.
const char* instruction_set();

/// How many threads `num_threads = 0` means: OMP_NUM_THREADS of the environment where it is set, else the number of
/// processors that the process may run on. Where OpenMP lends the threads, omp_set_num_threads() changes it.
int default_threads();

/// What lends threads to loops, chosen when the library was built: "openmp", whose team the program's own loops share,
/// or "threads", a pool of nacre's own.
const char* parallel_backend();

}  // namespace nacre
