#include "tracking/relocalisation.hpp"

#include <vector>

#include "registration/global_search.hpp"
#include "tracking/limits.hpp"
#include "tracking/points_in_view.hpp"

namespace nacre {

std::optional<Pose> fit_anywhere(const PointModel& model, const IcpSource& source, const AlignOptions& options) {
  GlobalAlignOptions search_options;
  search_options.max_residual = tracking_limits::largest_search_residual;
  search_options.seed = options.seed;
  search_options.num_threads = options.num_threads;
  const GlobalCloud frame(source.cloud.points, source.cloud.normals, Eigen::Vector3d::Zero());
  const GlobalCloud whole(as_rows(model.points), as_rows(model.normals));
  const SearchSide moving(frame, search_options, false), still(whole, search_options, false);
  if (!is_enough(moving) || !is_enough(still)) return std::nullopt;
  const GlobalSearch search(moving, still, search_options);
  const GlobalAcceptance acceptance = accept_motion(search.run(), search_options, search.tolerance());
  if (acceptance.status != GlobalAlignStatus::found) return std::nullopt;
  return acceptance.best.alignment.target_from_source;
}

}  // namespace nacre
