#include "tracking.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "icp_target.hpp"
#include "parallel.hpp"
#include "random.hpp"
#include "surface_observer.hpp"

namespace nacre {
namespace {

// The model's points that a camera near a pose may see, as a cloud to register to.
struct View {
  Points points, normals;
};

Eigen::Vector3d viewing_direction(const Camera& camera, const Eigen::Vector3d& point) {
  return camera.model() == Camera::Model::orthographic ? Eigen::Vector3d::UnitZ() : point.normalized();
}

// Points in the image widened by a third on each side, turned away from the camera by at most 120 degrees.
View points_in_view(const PointModel& model, const Camera& camera, const Pose& world_from_camera) {
  const Pose camera_from_world = world_from_camera.inverse();
  const double margin_u = camera.width() / 3.0, margin_v = camera.height() / 3.0;
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < model.points.size(); ++i) {
    const Eigen::Vector3d point = camera_from_world * model.points[i].cast<double>();
    const Eigen::Vector2d pixel = camera.project(point);
    if (!(pixel.x() > -margin_u && pixel.x() < camera.width() + margin_u && pixel.y() > -margin_v &&
          pixel.y() < camera.height() + margin_v)) {
      continue;
    }
    const Eigen::Vector3d normal = camera_from_world.linear() * model.normals[i].cast<double>();
    if (!(normal.dot(viewing_direction(camera, point)) < 0.5)) continue;
    rows.push_back(i);
  }
  View view{Points(static_cast<Eigen::Index>(rows.size()), 3), Points(static_cast<Eigen::Index>(rows.size()), 3)};
  for (std::size_t k = 0; k < rows.size(); ++k) {
    view.points.row(static_cast<Eigen::Index>(k)) = model.points[rows[k]].transpose();
    view.normals.row(static_cast<Eigen::Index>(k)) = model.normals[rows[k]].transpose();
  }
  return view;
}

// Of the model's points that face the camera and project onto a measured pixel: the part that agrees with it, among
// those that agree and those that the camera sees through. Points behind the measured surface are hidden, not wrong.
double consistency_of(const PointModel& model, const Frame& frame, const Camera& camera, const Pose& world_from_camera,
                      double spacing, int num_threads) {
  struct Counts {
    std::int64_t agree = 0, violated = 0;
    Counts& operator+=(const Counts& other) {
      agree += other.agree;
      violated += other.violated;
      return *this;
    }
  };
  const Pose camera_from_world = world_from_camera.inverse();
  const Counts counts =
      block_reduce(model.size(), 1024, num_threads, Counts{}, [&](std::int64_t begin, std::int64_t end) {
        Counts sum;
        for (std::int64_t index = begin; index < end; ++index) {
          const auto i = static_cast<std::size_t>(index);
          const Eigen::Vector3d point = camera_from_world * model.points[i].cast<double>();
          const Eigen::Vector3d normal = camera_from_world.linear() * model.normals[i].cast<double>();
          const double facing = -normal.dot(viewing_direction(camera, point));
          if (!(facing > 0.3)) continue;
          const Eigen::Vector2d pixel = camera.project(point);
          if (!(pixel.x() > -0.5 && pixel.y() > -0.5 && pixel.x() < frame.width - 0.5 &&
                pixel.y() < frame.height - 0.5)) {
            continue;
          }
          const Eigen::Index row =
              static_cast<Eigen::Index>(pixel.y() + 0.5) * frame.width + static_cast<Eigen::Index>(pixel.x() + 0.5);
          const double behind = static_cast<double>(frame.points(row, 2)) - point.z();
          if (!std::isfinite(behind)) continue;
          const double tolerance = std::max(3.0 * spacing, 4.0 * static_cast<double>(frame.sigma[row])) / facing;
          if (behind > tolerance) {
            ++sum.violated;
          } else if (behind > -tolerance) {
            ++sum.agree;
          }
        }
        return sum;
      });
  const std::int64_t judged = counts.agree + counts.violated;
  return judged > 0 ? static_cast<double>(counts.agree) / static_cast<double>(judged) : 0.0;
}

// Denoised points of the frame, spread over it at random: noise would shift the matches on curved surfaces.
struct Samples {
  Points points, normals;
  Values sigma;
};

Samples sample_frame(const Frame& frame, const Camera& camera, const ModelOptions& options) {
  const std::int64_t count =
      options.registration.max_samples > 0
          ? std::min<std::int64_t>(options.registration.max_samples, static_cast<std::int64_t>(frame.valid.size()))
          : static_cast<std::int64_t>(frame.valid.size());
  Samples samples{Points(count, 3), Points(count, 3), Values(count)};
  const Colors no_colors;
  const ColorsRef colors(no_colors);
  const SurfaceObserver observer(frame, camera, options.fusion, colors, options.num_threads);
  const double stride = static_cast<double>(frame.valid.size()) / static_cast<double>(std::max<std::int64_t>(count, 1));
  parallel_for(count, 256, options.num_threads, [&](std::int64_t i) {
    // One of every `stride` pixels.
    const double place =
        (static_cast<double>(i) + random_uniform(options.registration.seed, static_cast<std::uint64_t>(i))) * stride;
    const std::int32_t row = frame.valid[std::min(frame.valid.size() - 1, static_cast<std::size_t>(place))];
    const Eigen::Vector3f point = frame.points.row(row).transpose(), normal = frame.normals.row(row).transpose();
    const Observation seen = observer.observe(point, normal, row, frame.sigma[row]);
    samples.points.row(i) = (point + seen.offset * normal).transpose();
    samples.normals.row(i) = seen.weight > 0.0F ? seen.normal.normalized().transpose() : normal.transpose();
    samples.sigma[i] = frame.sigma[row];
  });
  return samples;
}

// Most of the frame matches, closely, and nothing contradicts: no other guess needs to be tried.
bool is_beyond_doubt(const TrackingResult& result, double gate) {
  return result.alignment.overlap > 0.35 && result.consistency > 0.9 && result.alignment.rmse < 0.25 * gate;
}

// After a loss the guess is poor, and only a registration beyond doubt is believed.
void judge(TrackingResult& result, const ModelOptions& options, double gate, bool was_lost) {
  std::ostringstream reason;
  reason.precision(3);
  result.status = FrameStatus::lost;
  if (result.alignment.status == AlignStatus::too_few_pairs) {
    reason << "too few points of the frame match the model";
  } else if (result.alignment.overlap < options.min_overlap) {
    reason << "overlap " << result.alignment.overlap << " is below " << options.min_overlap;
  } else if (result.consistency < options.min_consistency) {
    reason << "consistency " << result.consistency << " is below " << options.min_consistency;
  } else if (result.alignment.rmse > options.max_residual * gate) {
    reason << "residuals of " << result.alignment.rmse << " m are above " << options.max_residual * gate;
  } else if (was_lost && !is_beyond_doubt(result, gate)) {
    reason << "not sure enough after a loss: overlap " << result.alignment.overlap << ", consistency "
           << result.consistency << ", residuals " << result.alignment.rmse << " m";
  } else if (result.alignment.weak_directions.cols() > 0) {
    result.status = FrameStatus::weak;
    reason << result.alignment.weak_directions.cols() << " direction(s) of the pose are not determined";
  } else {
    result.status = FrameStatus::tracked;
  }
  result.reason = reason.str();
}

}  // namespace

TrackingResult track(const PointModel& model, const Frame& frame, const Camera& camera,
                     const std::vector<Pose>& guesses, bool was_lost, const ModelOptions& options) {
  TrackingResult best;
  best.alignment.target_from_source = guesses.front();
  const bool automatic_gate = !(options.registration.max_distance > 0.0);

  // Near: the guess is about right, and a narrow gate is safest. Wide: it is not.
  const Samples samples = sample_frame(frame, camera, options);
  const IcpSource source(AlignCloud(samples.points, samples.normals, samples.sigma), options.registration);
  for (const bool wide : {false, true}) {
    if (wide && !automatic_gate) break;
    for (const Pose& guess : guesses) {
      const View view = points_in_view(model, camera, guess);
      const IcpTarget target(AlignCloud(view.points, view.normals), options.registration);
      AlignOptions align_options = options.registration;
      if (!(align_options.final_distance > 0.0)) {
        align_options.final_distance = std::max(2.5 * target.spacing(), 4.0 * static_cast<double>(median_sigma(frame)));
      }
      if (automatic_gate && !wide) align_options.max_distance = 4.0 * align_options.final_distance;

      TrackingResult result;
      result.alignment = align_to(target, source, guess, align_options);
      result.consistency = consistency_of(model, frame, camera, result.alignment.target_from_source, target.spacing(),
                                          options.num_threads);
      judge(result, options, align_options.final_distance, was_lost);
      if (result.rank() >= best.rank()) best = result;
      if (result.status == FrameStatus::tracked && is_beyond_doubt(result, align_options.final_distance)) return result;
    }
  }
  return best;
}

}  // namespace nacre
