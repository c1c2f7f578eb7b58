// CGAL (GPL): triangles over points by an advancing front, as it comes.
#include <CGAL/Advancing_front_surface_reconstruction.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/version.h>

#include <array>
#include <cstdint>
#include <iterator>
#include <vector>

namespace {

using Point = CGAL::Exact_predicates_inexact_constructions_kernel::Point_3;
using Facets = std::vector<std::array<std::size_t, 3>>;

}  // namespace

extern "C" const char* version() { return CGAL_VERSION_STR; }

extern "C" Facets* advance(const double* xyz, std::int64_t size) {
  std::vector<Point> points;
  points.reserve(static_cast<std::size_t>(size));
  for (std::int64_t i = 0; i < size; ++i) points.emplace_back(xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]);
  auto* facets = new Facets;
  CGAL::advancing_front_surface_reconstruction(points.begin(), points.end(), std::back_inserter(*facets));
  return facets;
}

extern "C" std::int64_t count(const Facets* facets) { return static_cast<std::int64_t>(facets->size()); }

extern "C" void unload(Facets* facets, std::int32_t* out) {
  for (const auto& facet : *facets) {
    for (const std::size_t corner : facet) *out++ = static_cast<std::int32_t>(corner);
  }
  delete facets;
}
