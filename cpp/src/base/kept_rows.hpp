// Which rows of arrays stay, by flags: 0 where one goes.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace nacre {

// Rows one after the other that stay.
struct KeptRun {
  std::size_t first, count;
};

inline std::vector<KeptRun> runs_of(const std::vector<std::uint8_t>& flags) {
  std::vector<KeptRun> runs;
  const auto is_kept = [](std::uint8_t flag) { return flag != 0; };
  for (auto begin = std::find_if(flags.begin(), flags.end(), is_kept); begin != flags.end();) {
    const auto end = std::find(begin, flags.end(), std::uint8_t{0});
    runs.push_back({static_cast<std::size_t>(begin - flags.begin()), static_cast<std::size_t>(end - begin)});
    begin = std::find_if(end, flags.end(), is_kept);
  }
  return runs;
}

// So many values a row. What is before the first that goes stays where it is.
template <class Value>
void keep_runs(std::vector<Value>& values, const std::vector<KeptRun>& runs, std::size_t count = 1) {
  if (values.empty()) return;
  auto end = values.begin();
  for (const KeptRun& run : runs) {
    const auto first = values.begin() + static_cast<std::ptrdiff_t>(run.first * count);
    const auto last = first + static_cast<std::ptrdiff_t>(run.count * count);
    end = first == end ? last : std::copy(first, last, end);
  }
  values.erase(end, values.end());
}

}  // namespace nacre
