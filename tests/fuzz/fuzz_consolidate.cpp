// WLOP of any points, with attributes.
#include "options.hpp"

namespace {

template <class Matrix>
void run(nacre_fuzz::Bytes& bytes) {
  using namespace nacre;
  const Matrix points = bytes.rows<Matrix>(200);
  Attributes attributes(0, 0);
  if (bytes.boolean()) {
    attributes = Attributes::Constant(points.rows() + (bytes.byte() == 255), bytes.integer(0, 3), bytes.coordinate());
  }
  const ConsolidateOptions options = nacre_fuzz::consolidate_options(bytes);
  const auto result = consolidate(points, options, attributes);
  NACRE_HOLDS(result.points.rows() <= options.num_points && result.points.rows() <= points.rows());
  NACRE_HOLDS(static_cast<Eigen::Index>(result.sources.size()) == result.points.rows());
  for (const std::int64_t source : result.sources) NACRE_HOLDS(source >= 0 && source < points.rows());
  NACRE_HOLDS(result.points.allFinite());
}

}  // namespace

NACRE_FUZZ_TARGET(bytes) {
  if (bytes.boolean()) {
    run<nacre::Points>(bytes);
  } else {
    run<nacre::PointsDouble>(bytes);
  }
}
