#include "fusion/point_arrays.hpp"

#include <cstdint>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/free_memory.hpp"
#include "base/kept_rows.hpp"
#include "fusion/limits.hpp"

namespace nacre {
namespace {

std::size_t with_room_ahead(std::size_t num_points) { return num_points + num_points / fusion_limits::points_per_free; }

}  // namespace

void PointModel::keep(const std::vector<std::uint8_t>& flags) {
  const std::vector<KeptRun> runs = runs_of(flags);
  for_each_array(*this, [&](auto& values, std::size_t channels) { keep_runs(values, runs, channels); });
}

void make_room(PointModel& model, std::size_t num_points) {
  if (num_points <= model.points.capacity()) return;
  for_each_array(model, [&](auto& values, std::size_t channels) {
    if (!values.empty()) values.reserve(with_room_ahead(num_points) * channels);
  });
}

void give_back_room(PointModel& model) {
  const std::size_t most = with_room_ahead(model.points.size());
  for_each_array(model, [&](auto& values, std::size_t channels) {
    if (values.capacity() <= most * channels) return;
    std::remove_reference_t<decltype(values)> smaller;
    smaller.reserve(most * channels);
    smaller.assign(values.begin(), values.end());
    values = std::move(smaller);
  });
  give_back_free_memory();
}

}  // namespace nacre
