// A random subset of points.
#pragma once

#include <cstdint>
#include <vector>

#include "nacre/types.hpp"

namespace nacre {

// Up to `count` of the finite rows, without replacement, ascending; the choice for a smaller count is part of that for
// a larger one. A place that several points share is taken again only when every place is taken. Defined for Points
// and PointsDouble.
template <class Cloud>
std::vector<std::int64_t> choose_rows(const Cloud& points, std::int64_t count, std::uint64_t seed, int num_threads);

}  // namespace nacre
