#include "nacre/system.hpp"

#include "base/parallel.hpp"
#include "simd/isa.hpp"

namespace nacre {

const char* instruction_set() { return simd::to_string(simd::active_isa()); }

int default_threads() { return resolve_threads(0); }

const char* parallel_backend() { return thread_backend(); }

}  // namespace nacre
