// Names for what the standard library says at length.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

namespace nacre {

template <class T>
constexpr T infinity = std::numeric_limits<T>::infinity();

constexpr double pi = 3.14159265358979323846;

inline std::size_t as_size(std::int64_t i) { return static_cast<std::size_t>(i); }

}  // namespace nacre
