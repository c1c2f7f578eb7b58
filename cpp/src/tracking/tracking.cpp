#include "tracking/tracking.hpp"

#include <algorithm>
#include <cmath>

#include "base/parallel.hpp"
#include "base/random.hpp"
#include "base/statistics.hpp"
#include "camera/point_projection.hpp"
#include "camera/point_spacing.hpp"
#include "camera/view_distance.hpp"
#include "fusion/observer.hpp"
#include "outlines/registration.hpp"
#include "registration/color.hpp"
#include "registration/icp.hpp"
#include "tracking/acceptance.hpp"
#include "tracking/frame_samples.hpp"
#include "tracking/relocalisation.hpp"
#include "tracking/turntable_search.hpp"

namespace nacre {
namespace {

constexpr double largest_distance = 1.75;         // from a guess that is near, as view_distance
constexpr std::size_t max_target_points = 30000;  // that a frame is registered to

// Model points that a camera near a pose may see, as a cloud to register to.
struct View {
  Points points, normals;  // world frame
  Values brightness;       // empty where the model has no colours
  double thinning = 1.0;   // how much farther apart the points are than the model's
};

// Points in the image widened by a third on each side, turned away from the camera by at most 120 degrees: one of every
// n of them, so that at most max_target_points are left.
View points_in_view(const PointModel& model, const Camera& camera, const Pose& world_from_camera,
                    std::int32_t oldest_frame, int num_threads) {
  constexpr std::int64_t block_size = PointProjection::capacity;
  const PointProjection model_view(camera, world_from_camera);
  const auto width = static_cast<float>(camera.width()), height = static_cast<float>(camera.height());
  const float margin_u = width / 3.0F, margin_v = height / 3.0F;
  std::vector<std::vector<std::uint32_t>> found(static_cast<std::size_t>((model.size() + block_size - 1) / block_size));
  parallel_blocks(
      model.size(), block_size, num_threads, [&](std::int64_t number, std::int64_t begin, std::int64_t end) {
        const auto first = static_cast<std::size_t>(begin);
        PointProjection::Block block;
        model_view.project(model.points[first].data(), model.normals[first].data(), static_cast<int>(end - begin),
                           block);
        std::uint32_t rows[block_size];
        std::size_t count = 0;
        for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(end - begin); ++i) {
          rows[count] = static_cast<std::uint32_t>(begin) + i;
          count += static_cast<std::size_t>((block.u[i] > -margin_u) & (block.u[i] < width + margin_u) &
                                            (block.v[i] > -margin_v) & (block.v[i] < height + margin_v) &
                                            (block.facing[i] > -0.5F) & (model.last_seen[first + i] >= oldest_frame));
        }
        found[static_cast<std::size_t>(number)].assign(rows, rows + count);
      });
  std::size_t num_found = 0;
  for (const auto& rows : found) num_found += rows.size();
  const std::size_t step = (num_found + max_target_points - 1) / max_target_points;
  const auto count = static_cast<Eigen::Index>(step > 0 ? num_found / step : 0);
  View view{Points(count, 3), Points(count, 3), Values(model.colors.empty() ? 0 : count),
            std::sqrt(static_cast<double>(std::max<std::size_t>(step, 1)))};
  // One of every `step`, at random.
  const auto is_chosen = [&](std::size_t index) { return index % step == random_bits(0, index / step) % step; };
  std::size_t index = 0;
  Eigen::Index k = 0;
  for (const auto& rows : found) {
    for (const std::uint32_t row : rows) {
      if (k == count || !is_chosen(index++)) continue;
      view.points.row(k) = model.points[row].transpose();
      if (view.brightness.size() > 0) view.brightness[k] = luma(model.colors[row]);
      view.normals.row(k++) = model.normals[row].transpose();
    }
  }
  return view;
}

double median_reach(const IcpSource& source) {
  return source.reach.size() > 0 ? static_cast<double>(median_of(source.reach)) : 0.0;
}

// What stays the same while one frame is registered from several guesses.
struct Search {
  const PointModel& model;
  const Frame& frame;
  const Camera& camera;
  const SurfaceObserver& observer;
  const TrackingOptions& options;
  IcpSource source;
  const Values& noise;   // of the sampled points [m]
  const DepthView& now;  // from the origin: where the camera is, is to be found
  const DepthView& before;
  double spacing;             // of the model [m]
  double depth;               // of the sampled points, the median [m]
  std::int32_t oldest_frame;  // see track

  mutable std::optional<OutlinePair> found_outlines = {};

  // Found when they are first asked for.
  const OutlinePair& outlines() const {
    constexpr std::size_t most_before = 2000, most_now = 600;
    if (!found_outlines) {
      found_outlines.emplace(OutlinePair{camera, before, find_outline(before, camera, most_before, options.num_threads),
                                         find_outline(now, camera, most_now, options.num_threads), now.depth,
                                         static_cast<double>(median_sigma(frame))});
    }
    return *found_outlines;
  }

  bool has_automatic_gate() const { return !(options.registration.max_distance > 0.0); }

  // A match may be about as far along the surface as the model's points are apart, and as far across it as noise and
  // the shape between the points take it.
  IcpSource with_reach(const View& view, const IcpTarget& target) const {
    IcpSource gated = source;
    const auto count = static_cast<Eigen::Index>(source.cloud.rows.size());
    gated.reach.resize(count);
    gated.largest_residual.resize(count);
    const double set = options.registration.final_distance;
    // Noise or spacing that is large against one of the surfaces would match anything.
    const Points& points = source.cloud.points;
    const auto extent = static_cast<double>((points.colwise().maxCoeff() - points.colwise().minCoeff()).norm());
    const double largest = 0.03 * std::min(target.diameter(), extent);
    for (Eigen::Index i = 0; i < count; ++i) {
      const float sigma = noise[source.cloud.rows[static_cast<std::size_t>(i)]];
      const double apart = spacing_at(points(i, 2), sigma, camera, spacing);
      const double across = std::max(2.75 * apart, 4.0 * static_cast<double>(sigma));
      gated.reach[i] = static_cast<float>(set > 0.0 ? set : std::min(1.5 * view.thinning * apart, largest));
      gated.largest_residual[i] = static_cast<float>(set > 0.0 ? set : std::min(across, largest));
    }
    return gated;
  }

  // NaN where too few of the points are seen.
  double consistency(const Points& points, const Points& normals, const DepthView& seen, const Pose& pose) const {
    constexpr std::int64_t least_judged = 20;
    return compare(points, normals, seen, pose, camera, {3.0 * spacing}, options.num_threads).consistency(least_judged);
  }

  // Near: the guess is about right, and a narrow gate is safest. Wide: it is not. expectation: of the guess.
  TrackingResult register_from(const Pose& guess, bool wide, Expectation expectation) const {
    const View view = points_in_view(model, camera, guess, oldest_frame, options.num_threads);
    AlignOptions align_options = options.registration;
    align_options.max_points = 0;  // the view is thin enough
    const IcpTarget target(AlignCloud(view.points, view.normals), align_options);
    const IcpSource gated = with_reach(view, target);
    if (!(align_options.final_distance > 0.0)) align_options.final_distance = median_reach(gated);
    if (has_automatic_gate() && !wide) align_options.max_distance = 4.0 * align_options.final_distance;

    TrackingResult result;
    result.alignment = align_to(target, gated, guess, align_options);
    const Eigen::Index num_weak = result.alignment.weak_directions.cols();
    if (num_weak > 0 && view.brightness.size() > 0 && observer.has_colors()) {
      result.alignment = determine_by_color(target, gated, BrightCloud(view.points, view.brightness),
                                            bright_cloud(frame, observer), result.alignment, align_options);
    }
    if (num_weak > 0 && result.alignment.weak_directions.cols() == num_weak) {
      result.alignment = determine_by_outline(target, gated, outlines(), result.alignment, align_options);
    }
    const Pose& pose = result.alignment.target_from_source;
    const double in_view = consistency(view.points, view.normals, now, pose);
    const Eigen::Matrix3f rotation = pose.linear().cast<float>();
    const Eigen::RowVector3f translation = pose.translation().cast<float>().transpose();
    const Points points = (source.cloud.points * rotation.transpose()).rowwise() + translation;
    const Points normals = source.cloud.normals * rotation.transpose();
    const double earlier = consistency(points, normals, before, before.world_from_camera);
    result.consistency = std::isfinite(in_view) || std::isfinite(earlier) ? std::fmin(in_view, earlier) : 0.0;
    result.expectation = view_distance(guess, pose, depth) > largest_distance ? Expectation::unexpected : expectation;
    accept_frame(result, options);
    return result;
  }

  // Cameras around what a known camera saw: it turned about each of its axes, one way and the other.
  std::vector<Pose> around(const Pose& pose) const {
    const View view = points_in_view(model, camera, pose, oldest_frame, options.num_threads);
    std::vector<Pose> poses = {pose};
    if (view.points.rows() == 0) return poses;
    const Eigen::Vector3d center = view.points.colwise().mean().transpose().cast<double>();
    for (int axis = 0; axis < 3; ++axis) {
      for (const double angle : {-0.75, 0.75}) {
        Pose turn = Pose::Identity();
        turn.linear() = Eigen::AngleAxisd(angle, pose.linear().col(axis)).toRotationMatrix();
        turn.translation() = center - turn.linear() * center;
        poses.push_back(turn * pose);
      }
    }
    return poses;
  }

  // From every place where a camera has been, and around it: a few points each, then the best with all.
  TrackingResult relocalise(const std::vector<Pose>& key_poses) const {
    constexpr std::size_t num_finalists = 3;
    std::vector<Pose> guesses;
    for (const Pose& key_pose : key_poses) {
      for (const Pose& guess : around(key_pose)) guesses.push_back(guess);
    }
    TrackingResult best;
    for (const Pose& candidate : most_promising(model, source, guesses, options.registration, num_finalists)) {
      const TrackingResult result = register_from(candidate, false, Expectation::unexpected);
      if (result.rank() >= best.rank()) best = result;
    }
    return best;
  }
};

// What the search on the plane found needs no other test: it has seen all other places.
TrackingResult on_plane(const PlaneFit& fit) {
  TrackingResult result;
  result.alignment = fit.alignment;
  result.consistency = fit.consistency;
  result.status = FrameStatus::tracked;
  result.score = fit.score;
  result.is_to_whole_model = result.is_on_plane = true;
  return result;
}

}  // namespace

TrackingResult track(const PointModel& model, const Frame& frame, const Camera& camera, const SurfaceObserver& observer,
                     const DepthView& now, std::vector<Pose> guesses, const WhereElse& elsewhere, bool was_lost,
                     const DepthView& before, PlaceHypothesis& hypothesis, std::int32_t oldest_frame, double spacing,
                     const TrackingOptions& options) {
  const FrameSamples samples = sample_frame(frame, observer, options);
  Search search{model,
                frame,
                camera,
                observer,
                options,
                IcpSource(AlignCloud(samples.points, samples.normals, samples.sigma), options.registration),
                samples.noise,
                now,
                before,
                spacing,
                median_depth(samples.points),
                oldest_frame};
  TrackingResult best;
  best.alignment.target_from_source = guesses.front();
  const std::optional<Pose> predicted = hypothesis.predict(search.source, options.registration);
  if (predicted) guesses.insert(guesses.begin(), *predicted);
  const auto try_guesses = [&] {
    for (const bool wide : {false, true}) {
      if (wide && (best.status != FrameStatus::lost || !search.has_automatic_gate())) return;
      for (const Pose& guess : guesses) {
        const TrackingResult result =
            search.register_from(guess, wide, was_lost ? Expectation::near_lost : Expectation::expected);
        if (result.rank() >= best.rank()) best = result;
        if (result.is_clear_cut) return;
      }
    }
  };
  try_guesses();
  if (best.status != FrameStatus::lost) return best;
  if (oldest_frame > 0) {
    search.oldest_frame = 0;
    try_guesses();
    best.is_to_whole_model = true;
    if (best.status != FrameStatus::lost) return best;
  }
  if (elsewhere.views != nullptr && !elsewhere.views->empty()) {
    const std::optional<ObjectView> view = elsewhere.view_of_frame();
    const auto fit = view ? fit_on_plane(model, *elsewhere.views, *view, camera, options.registration) : std::nullopt;
    if (fit) return on_plane(*fit);
  }
  const bool goes_on = predicted && hypothesis.is_confirmed_by(best);
  const std::vector<Pose> key_poses = goes_on || !elsewhere.key_poses ? std::vector<Pose>() : elsewhere.key_poses();
  if (!key_poses.empty()) {
    TrackingResult found = search.relocalise(key_poses);
    found.is_to_whole_model = true;
    if (found.status != FrameStatus::lost) return found;
    if (found.rank() > best.rank()) best = found;
  }
  if (!goes_on && elsewhere.everywhere) {
    const std::optional<Pose> pose = fit_anywhere(model, search.source, options.registration);
    if (pose) {
      TrackingResult found = search.register_from(*pose, false, Expectation::unexpected);
      found.is_to_whole_model = true;
      if (found.status != FrameStatus::lost) return found;
      if (found.rank() > best.rank()) best = found;
    }
  }
  if (options.relocalise && options.verify && hypothesis.add(best, search.source)) {
    best.status = FrameStatus::tracked;
    best.reason.clear();
  }
  return best;
}

}  // namespace nacre
