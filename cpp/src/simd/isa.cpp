#include "simd/isa.hpp"

#include <cstdlib>
#include <stdexcept>
#include <string>

namespace nacre::simd {
namespace {

bool has(Isa isa) {
#ifdef NACRE_SIMD_X86
  if (isa == Isa::avx2) {
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi") &&
           __builtin_cpu_supports("bmi2");
  }
  if (isa == Isa::avx512) {
    return has(Isa::avx2) && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
           __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
           __builtin_cpu_supports("avx512vl");
  }
#endif
  return isa == Isa::baseline;
}

Isa choose_isa() {
  const char* const forced = std::getenv("NACRE_SIMD");
  if (forced == nullptr || *forced == '\0') {
    return has(Isa::avx512) ? Isa::avx512 : has(Isa::avx2) ? Isa::avx2 : Isa::baseline;
  }
  for (const Isa isa : {Isa::baseline, Isa::avx2, Isa::avx512}) {
    if (std::string(forced) != to_string(isa)) continue;
    if (has(isa)) return isa;
    throw std::runtime_error("NACRE_SIMD asks for " + std::string(forced) + ", which this processor does not have");
  }
  throw std::runtime_error("NACRE_SIMD must be baseline, avx2 or avx512, got " + std::string(forced));
}

}  // namespace

Isa active_isa() {
  static const Isa isa = choose_isa();
  return isa;
}

const char* to_string(Isa isa) {
  switch (isa) {
    case Isa::avx512:
      return "avx512";
    case Isa::avx2:
      return "avx2";
    default:
      return "baseline";
  }
}

}  // namespace nacre::simd
