// Counter-based random numbers: a value depends on the seed and the counter only, never on the order of calls.
#pragma once

#include <cmath>
#include <cstdint>

namespace nacre {

// SplitMix64's finaliser (Steele, Lea and Flood 2014).
inline std::uint64_t mix64(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

inline std::uint64_t random_bits(std::uint64_t seed, std::uint64_t counter) { return mix64(mix64(seed) ^ counter); }

// Uniform in (0, 1).
inline double random_uniform(std::uint64_t seed, std::uint64_t counter) {
  return (static_cast<double>(random_bits(seed, counter) >> 11) + 0.5) * 0x1.0p-53;
}

// Standard normal (Box and Muller 1958); uses the counters 2 c and 2 c + 1.
inline double random_normal(std::uint64_t seed, std::uint64_t counter) {
  constexpr double two_pi = 6.283185307179586;
  return std::sqrt(-2.0 * std::log(random_uniform(seed, 2 * counter))) *
         std::cos(two_pi * random_uniform(seed, 2 * counter + 1));
}

}  // namespace nacre
