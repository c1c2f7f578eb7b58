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
  constexpr double large = 1e15;
  const auto is_far = [](const auto& value) { return std::abs(static_cast<double>(value)) > large; };
  const bool is_moderate = !points.unaryExpr(is_far).any() && options.radius > 1e-6 && options.radius < large;
  NACRE_HOLDS(!is_moderate || result.points.allFinite());
}

}  // namespace

NACRE_FUZZ_TARGET(bytes) {
  if (bytes.boolean()) {
    run<nacre::Points>(bytes);
  } else {
    run<nacre::PointsDouble>(bytes);
  }
}
