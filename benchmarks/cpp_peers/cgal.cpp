// CGAL (GPL): normals by PCA and WLOP, with its parallel tag; threads are TBB's, bounded by the process's affinity.
#include <CGAL/Simple_cartesian.h>
#include <CGAL/pca_estimate_normals.h>
#include <CGAL/version.h>
#include <CGAL/wlop_simplify_and_regularize_point_set.h>

#include <cstdint>
#include <iterator>
#include <utility>
#include <vector>

namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Point = Kernel::Point_3;
using Oriented = std::pair<Point, Kernel::Vector_3>;

void write(const Point& point, double* out) {
  for (int axis = 0; axis < 3; ++axis) out[axis] = point[axis];
}

}  // namespace

extern "C" const char* version() { return CGAL_VERSION_STR; }

extern "C" std::vector<Oriented>* load_oriented(const double* xyz, std::int64_t size) {
  auto* points = new std::vector<Oriented>(static_cast<std::size_t>(size));
  for (std::size_t i = 0; i < points->size(); ++i) {
    (*points)[i].first = Point(xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]);
  }
  return points;
}

extern "C" void normals(std::vector<Oriented>* points, int k) {
  CGAL::pca_estimate_normals<CGAL::Parallel_tag>(
      *points, static_cast<unsigned>(k),
      CGAL::parameters::point_map(CGAL::First_of_pair_property_map<Oriented>())
          .normal_map(CGAL::Second_of_pair_property_map<Oriented>()));
}

extern "C" void unload_oriented(std::vector<Oriented>* points, double* out) {
  for (std::size_t i = 0; i < points->size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) out[3 * i + axis] = (*points)[i].second[axis];
  }
  delete points;
}

struct Wlop {
  std::vector<Point> points, result;
};

extern "C" Wlop* load(const double* xyz, std::int64_t size) {
  auto* wlop = new Wlop;
  wlop->points.reserve(static_cast<std::size_t>(size));
  for (std::int64_t i = 0; i < size; ++i) wlop->points.emplace_back(xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]);
  return wlop;
}

extern "C" std::int64_t consolidate(Wlop* wlop, double percentage, double radius, int iterations) {
  CGAL::wlop_simplify_and_regularize_point_set<CGAL::Parallel_tag>(
      wlop->points, std::back_inserter(wlop->result),
      CGAL::parameters::select_percentage(percentage).neighbor_radius(radius).number_of_iterations(iterations));
  return static_cast<std::int64_t>(wlop->result.size());
}

// The result, and what it started from: CGAL shuffles the points and takes the last ones.
extern "C" void unload(Wlop* wlop, double* result, double* starts) {
  const std::size_t skipped = wlop->points.size() - wlop->result.size();
  for (std::size_t i = 0; i < wlop->result.size(); ++i) {
    write(wlop->result[i], result + 3 * i);
    write(wlop->points[skipped + i], starts + 3 * i);
  }
  delete wlop;
}
