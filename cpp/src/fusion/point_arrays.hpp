// The arrays of a model's points, which grow and shrink together.
#pragma once

#include <cstddef>

#include "nacre/fusion.hpp"

namespace nacre {

// Calls visit(values, values of a point) for each of them; colours are empty where no frame had any.
template <class Visit>
void for_each_array(PointModel& model, Visit&& visit) {
  visit(model.points, std::size_t{1});
  visit(model.normals, std::size_t{1});
  visit(model.colors, std::size_t{1});
  for (PointAttribute& attribute : model.attributes) {
    visit(attribute.values, static_cast<std::size_t>(attribute.num_channels));
  }
  visit(model.confidence, std::size_t{1});
  visit(model.last_seen, std::size_t{1});
  visit(model.observations, std::size_t{1});
  visit(model.free_space_violations, std::size_t{1});
}

// Room for so many points and some more, where there is less: arrays that double would be half empty.
void make_room(PointModel& model, std::size_t num_points);

// Leaves the arrays no more room than make_room would, and the system what is free: for moments after which there are
// fewer points.
void give_back_room(PointModel& model);

}  // namespace nacre
