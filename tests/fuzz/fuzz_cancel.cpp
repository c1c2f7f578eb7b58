// Calls that are stopped anywhere leave nothing behind, and stop by Cancelled alone.
#include "bytes.hpp"
#include "nacre/consolidation.hpp"
#include "nacre/normals.hpp"
#include "nacre/registration.hpp"

NACRE_FUZZ_TARGET(bytes) {
  using namespace nacre;
  const Points points = bytes.points(300);
  const int kind = bytes.byte() % 3, threads = bytes.threads();
  int left = bytes.byte();
  bool is_stopped = false;
  try {
    const CancelScope scope([&] { return --left < 0; });
    if (kind == 0) (void)estimate_normals(points, {16, 1.0, threads});
    if (kind == 1) (void)KdTree(points, threads).query(points, 4, KdTree::infinity, threads);
    if (kind == 2) (void)align(AlignCloud(points), AlignCloud(points));
  } catch (const Cancelled&) {
    is_stopped = true;
  }
  NACRE_HOLDS(!is_stopped || left < 0);
  CancelScope::check();
}
