// What numbers that were read must be, to be gone on with.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "nacre/fusion.hpp"

namespace nacre {

template <class Number>
bool is_within(Number number, std::size_t count) {
  return number >= 0 && static_cast<std::uint64_t>(number) < count;
}

template <class T, class Test>
bool are_all(const std::vector<T>& values, Test&& test) {
  return std::all_of(values.begin(), values.end(), test);
}

bool is_place(const Eigen::Vector3f& point);

// Whether points are all there, and a surface, of so many frames.
bool is_surface(const PointModel& cloud, std::size_t num_frames);

}  // namespace nacre
