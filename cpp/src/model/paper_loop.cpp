#include "model/paper_loop.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/point_rows.hpp"
#include "base/random.hpp"
#include "camera/limits.hpp"
#include "nacre/kdtree.hpp"
#include "nacre/normals.hpp"
#include "registration/paper_icp.hpp"
#include "tracking/limits.hpp"

namespace nacre {
namespace {

template <class Value>
void append(std::vector<Value>& values, const std::vector<Value>& more) {
  values.insert(values.end(), more.begin(), more.end());
}

}  // namespace

PointModel choose(const PointModel& cloud, double count, std::uint64_t seed) {
  std::vector<std::pair<std::uint64_t, std::size_t>> keyed;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) keyed.emplace_back(random_bits(seed, i), i);
  std::sort(keyed.begin(), keyed.end());
  std::vector<std::uint8_t> flags(cloud.points.size(), 0);
  const auto wanted = std::min(keyed.size(), static_cast<std::size_t>(std::lround(std::max(0.0, count))));
  for (std::size_t k = 0; k < wanted; ++k) flags[keyed[k].second] = 1;
  PointModel chosen = cloud;
  chosen.keep(flags);
  return chosen;
}

void append(PointModel& model, const PointModel& more) {
  append(model.points, more.points);
  append(model.normals, more.normals);
  append(model.confidence, more.confidence);
  append(model.last_seen, more.last_seen);
  append(model.observations, more.observations);
  append(model.free_space_violations, more.free_space_violations);
}

Points PaperLoop::model_normals(const PointModel& model) const {
  const NormalOptions wanted = {options.wlop.normal_neighbors, options.wlop.normal_radius, options.num_threads};
  Points normals = estimate_normals(as_rows(model.points), wanted);
  const KdTree tree(as_rows(model.points), options.num_threads);
  const Neighbors near = tree.query(as_rows(model.points), wanted.k, wanted.max_radius, options.num_threads);
  for (Eigen::Index i = 0; i < normals.rows(); ++i) {
    const bool has_all = near.indices(i, wanted.k - 1) < normals.rows();
    if (!has_all) normals.row(i).setConstant(std::numeric_limits<float>::quiet_NaN());
    const Eigen::Vector3f& before = model.normals[static_cast<std::size_t>(i)];
    if (normals.row(i).dot(before.transpose()) < 0.0F) normals.row(i) *= -1.0F;
  }
  return normals;
}

TrackingResult PaperLoop::register_frame(const CurrentFrame& now, const TrackingTarget& target,
                                         const Pose& guess) const {
  AlignOptions align_options = options.registration;
  align_options.seed = random_bits(options.registration.seed, static_cast<std::uint64_t>(frame_index));
  const Points normals = model_normals(target.model);
  const Points source = take_rows<Points>(now.frame.points, now.frame.valid);
  const Points source_normals = take_rows<Points>(now.frame.normals, now.frame.valid);

  TrackingResult result;
  result.alignment = align_as_in_paper(AlignCloud(source, source_normals),
                                       AlignCloud(as_rows(target.model.points), normals), guess, align_options);
  const double margin = camera_limits::surface_spacings * target.spacing;
  const double part = compare(as_rows(target.model.points), as_rows(target.model.normals), now.view,
                              result.alignment.target_from_source, now.camera, {margin}, options.num_threads)
                          .consistency(tracking_limits::least_judged);
  result.consistency.of_target = std::isfinite(part) ? part : 0.0;
  result.test(options, target.usual);
  return result;
}

PointModel PaperLoop::samples(const PointModel& model, const PointModel& fresh) const {
  const std::uint64_t seed = mix64(options.wlop.seed) + 16 * static_cast<std::uint64_t>(frame_index);
  PointModel chosen;
  if (model.size() == 0) {
    chosen = choose(fresh, options.wlop.first_fraction * static_cast<double>(fresh.size()), seed);
  } else {
    chosen = choose(model, options.wlop.kept_fraction * static_cast<double>(model.size()), seed);
    append(chosen, choose(fresh, options.wlop.new_fraction * static_cast<double>(model.size()), seed + 1));
  }
  return chosen.size() > options.max_points ? choose(chosen, options.max_points, seed + 2) : chosen;
}

}  // namespace nacre
