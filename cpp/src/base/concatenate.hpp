// What blocks of work have found, in their order.
#pragma once

#include <cstddef>
#include <vector>

namespace nacre {

template <class T>
std::vector<T> concatenate(const std::vector<std::vector<T>>& parts) {
  std::size_t size = 0;
  for (const std::vector<T>& part : parts) size += part.size();
  std::vector<T> all;
  all.reserve(size);
  for (const std::vector<T>& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

}  // namespace nacre
