// Union-find: which of many are connected, in steps. A set is known by its first member.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace nacre {

class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : before_(count) { std::iota(before_.begin(), before_.end(), 0); }

  std::int32_t first_of(std::int32_t i) {
    while (before_[static_cast<std::size_t>(i)] != i) {
      std::int32_t& before = before_[static_cast<std::size_t>(i)];
      before = before_[static_cast<std::size_t>(before)];
      i = before;
    }
    return i;
  }

  void join(std::int32_t a, std::int32_t b) {
    const auto [low, high] = std::minmax({first_of(a), first_of(b)});
    before_[static_cast<std::size_t>(high)] = low;
  }

 private:
  std::vector<std::int32_t> before_;  // each member's: one of its set that is not behind it
};

}  // namespace nacre
