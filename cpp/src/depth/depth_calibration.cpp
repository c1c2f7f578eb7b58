#include "nacre/depth_calibration.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "base/check.hpp"
#include "base/limits.hpp"
#include "base/linear_algebra.hpp"
#include "base/parallel.hpp"
#include "base/pose_check.hpp"
#include "base/se3.hpp"
#include "base/statistics.hpp"
#include "base/step_length.hpp"
#include "camera/limits.hpp"
#include "camera/ray_table.hpp"
#include "depth/inverse_depth_image.hpp"
#include "depth/limits.hpp"

namespace nacre {
namespace {

// What the camera measures wrongly: by so much the inverse depth is tilted, the scene too narrow, and depth measured
// along the rays.
struct Distortion {
  double tilt = 0.0, stretch = 1.0, radial = 0.0;
};

// By what the length of a point's ray is larger than its depth: the logarithm of the factor.
double log_ray_length(const Eigen::Vector3d& point) {
  return 0.5 * std::log1p(point.head<2>().squaredNorm() / (point.z() * point.z()));
}

void require_calibrable(const Camera& camera) {
  if (!can_calibrate_depth(camera)) {
    throw std::invalid_argument("camera: expected a pinhole camera with depth along its axis");
  }
}

// Pixels, each way, whose inverse depths are averaged: an image has so many blocks at most.
int block_side(const Camera& camera) {
  const double pixels = static_cast<double>(camera.width()) * camera.height();
  return std::max(1, static_cast<int>(std::ceil(std::sqrt(pixels / depth_limits::most_blocks))));
}

struct BlockGrid {
  int side, columns, rows;

  explicit BlockGrid(const Camera& camera)
      : side(block_side(camera)), columns(camera.width() / side), rows(camera.height() / side) {}
  std::int64_t size() const { return static_cast<std::int64_t>(columns) * rows; }

  // Of the rows and the columns: blocks side by side share their neighbours, and the camera's error.
  std::vector<Eigen::Index> every_second() const {
    std::vector<Eigen::Index> blocks;
    for (int row = 0; row < rows; row += 2) {
      for (int column = 0; column < columns; column += 2) {
        blocks.push_back(static_cast<Eigen::Index>(row) * columns + column);
      }
    }
    return blocks;
  }
};

using BlockRays = Eigen::Matrix<float, Eigen::Dynamic, 2, Eigen::RowMajor>;

// The means of the pixels' rays, x / z and y / z.
BlockRays mean_rays(const Camera& camera) {
  const BlockGrid grid(camera);
  BlockRays means(grid.size(), 2);
  const double pixels = static_cast<double>(grid.side) * grid.side;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      Eigen::RowVector2d sum = Eigen::RowVector2d::Zero();
      for (int v = row * grid.side; v < (row + 1) * grid.side; ++v) {
        const simd::RayRow rays = camera.ray_table().row(v);
        for (int u = column * grid.side; u < (column + 1) * grid.side; ++u) {
          sum += Eigen::RowVector2f(rays.x[u], rays.y != nullptr ? rays.y[u] : rays.row_y).cast<double>();
        }
      }
      means.row(static_cast<Eigen::Index>(row) * grid.columns + column) = (sum / pixels).cast<float>();
    }
  }
  return means;
}

// The depths that belong to the means of the pixels' inverse depths; NaN where a pixel has none.
Values mean_depths(const DepthRef& depth, const Camera& camera) {
  const BlockGrid grid(camera);
  Values means = Values::Constant(grid.size(), std::numeric_limits<float>::quiet_NaN());
  const double pixels = static_cast<double>(grid.side) * grid.side;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      double inverse = 0.0;
      for (int v = row * grid.side; v < (row + 1) * grid.side; ++v) {
        for (int u = column * grid.side; u < (column + 1) * grid.side; ++u) {
          inverse += 1.0 / static_cast<double>(depth(v, u));
        }
      }
      if (!(std::isfinite(inverse) && inverse > 0.0)) continue;
      means(static_cast<Eigen::Index>(row) * grid.columns + column) = static_cast<float>(pixels / inverse);
    }
  }
  return means;
}

// A view without a distortion, worked out where it is asked; NaN where a block has no depth or no ray.
class CorrectedView {
 public:
  CorrectedView(const Values& depths, const BlockRays& rays, const BlockGrid& grid, const Distortion& distortion)
      : depths_(depths), rays_(rays), grid_(grid), distortion_(distortion) {}

  // Without the tilt (1 / z less tilt * x / z), nearer by a power of its ray's length, and stretched across the axis.
  Eigen::Vector3d point(Eigen::Index i) const {
    const double z = static_cast<double>(depths_(i));
    Eigen::Vector3d result(static_cast<double>(rays_(i, 0)) * z, static_cast<double>(rays_(i, 1)) * z, z);
    const double nearer = distortion_.radial == 0.0 ? 1.0 : std::exp(-distortion_.radial * log_ray_length(result));
    result *= nearer / (1.0 - distortion_.tilt * result.x());
    result.head<2>() *= distortion_.stretch;
    return result;
  }
  // From the neighbours to all sides, towards the camera; NaN beside steps and at the image's border.
  Eigen::Vector3d normal(Eigen::Index i) const {
    const Eigen::Index row = i / grid_.columns, column = i % grid_.columns;
    const Eigen::Vector3d none = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
    if (!(row > 0 && row + 1 < grid_.rows && column > 0 && column + 1 < grid_.columns)) return none;
    const Eigen::Vector3d across = point(i + 1) - point(i - 1);
    const Eigen::Vector3d down = point(i + grid_.columns) - point(i - grid_.columns);
    const double step = std::max(std::abs(across.z()), std::abs(down.z()));
    return step <= depth_limits::largest_block_step * point(i).z() ? down.cross(across).normalized() : none;
  }

 private:
  const Values& depths_;
  const BlockRays& rays_;
  BlockGrid grid_;
  Distortion distortion_;
};

// What a pair of views says of tilt, stretch and depth along the rays beside their relative pose.
struct PairFit {
  Eigen::Matrix3d information;
  Eigen::Vector3d gradient;
  Eigen::Matrix<double, 6, 4> response;  // less the twist, by these three and as the residuals want it
};

std::optional<PairFit> linearise(const CorrectedView& target, const CorrectedView& source, const Pose& motion,
                                 double stretch, const Camera& camera) {
  using Row = Eigen::Matrix<double, 10, 1>;
  const BlockGrid grid(camera);
  std::vector<Row> rows;
  std::vector<double> depths;
  for (const Eigen::Index i : grid.every_second()) {
    const Eigen::Vector3d source_normal = source.normal(i);
    if (!source_normal.allFinite()) continue;
    const Eigen::Vector3d p = motion * source.point(i);
    const Eigen::Vector2d pixel = camera.project(Eigen::Vector3d(p.x() / stretch, p.y() / stretch, p.z()));
    const double column = std::floor((pixel.x() + 0.5) / grid.side), line = std::floor((pixel.y() + 0.5) / grid.side);
    if (!(column >= 0.0 && column < grid.columns && line >= 0.0 && line < grid.rows)) continue;
    const auto seen = static_cast<Eigen::Index>(line) * grid.columns + static_cast<Eigen::Index>(column);
    const Eigen::Vector3d q = target.point(seen), n = target.normal(seen);
    const double residual = (q - p).dot(n);
    const double facing = (motion.linear() * source_normal).dot(n);
    if (!(std::abs(residual) < camera_limits::another_surface * q.z() && facing > base_limits::same_surface_cosine))
      continue;
    // Both derivatives at the middle of the two points: at the points themselves, their noise would favour whatever
    // makes the scene smaller.
    const Eigen::Vector3d middle = 0.5 * (p + q);
    const Eigen::Vector3d there = motion.linear().transpose() * (middle - motion.translation());
    const Eigen::Vector3d wide(middle.x(), middle.y(), 0.0), wide_there(there.x(), there.y(), 0.0);
    Row row;
    row << -p.cross(n), -n, n.dot(middle * middle.x() - motion.linear() * (there * there.x())),
        n.dot(wide - motion.linear() * wide_there) / stretch,
        n.dot(motion.linear() * (there * log_ray_length(there)) - middle * log_ray_length(middle)), residual;
    rows.push_back(row);
    depths.push_back(q.z());
  }
  if (static_cast<std::int64_t>(rows.size()) < depth_limits::least_matches) return std::nullopt;

  std::vector<double> squares;
  squares.reserve(depths.size());
  for (const double depth : depths) squares.push_back(depth * depth);
  const double middle_square = median_of(squares);
  std::vector<double> whitened;
  for (std::size_t i = 0; i < rows.size(); ++i) whitened.push_back(std::abs(rows[i](9)) * middle_square / squares[i]);
  const double scale = std::max(mad_to_sigma * median_of(whitened), 1e-9);
  Eigen::Matrix<double, 10, 10> sums = Eigen::Matrix<double, 10, 10>::Zero();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double noise = scale * squares[i] / middle_square;
    sums += robust_weight(whitened[i], scale) / (noise * noise) * (rows[i] * rows[i].transpose());
  }
  Eigen::Matrix<double, 6, 6> hessian = sums.topLeftCorner<6, 6>();
  hessian.diagonal().array() += 1e-9 * hessian.trace();
  PairFit fit;
  fit.response = solve_symmetric_columns(hessian, sums.topRightCorner<6, 4>());
  const Eigen::Matrix<double, 3, 4> left = sums.block<3, 4>(6, 6) - sums.block<3, 6>(6, 0) * fit.response;
  // Rounding leaves less of the information than this where the pose explains all.
  if (!(left.leftCols<3>().diagonal().array() > depth_limits::least_part_left * sums.diagonal().segment<3>(6).array())
           .all()) {
    return std::nullopt;
  }
  fit.information = left.leftCols<3>();
  fit.gradient = left.col(3);
  return fit;
}

// Depth along the axis, as was said: nothing else is asked.
void hold_radial(PairFit& fit) {
  fit.information.row(2).setZero();
  fit.information.col(2).setZero();
  fit.information(2, 2) = 1.0;
  fit.gradient(2) = 0.0;
}

Pose followed(const Pose& motion, const PairFit& fit, const Eigen::Vector4d& step) {
  const Eigen::Matrix<double, 6, 1> twist = -fit.response * step;
  return motion_about(Eigen::Vector3d::Zero(), twist) * motion;
}

// Whether a value is so many of its standard deviations from 0 that chance is ruled out, when these are known from the
// scatter of some pairs of views: two pairs share a view, and two values are fitted. Student's distribution, by the
// Gaussian's quantile that belongs to it (Wallace 1959).
bool is_beyond_doubt(double sigmas, int num_pairs) {
  const double freedom = 0.5 * (num_pairs - 1);
  if (!(freedom > 0.0)) return false;
  const double gaussian =
      (8.0 * freedom + 1.0) / (8.0 * freedom + 3.0) * std::sqrt(freedom * std::log1p(sigmas * sigmas / freedom));
  return gaussian > depth_limits::sure_sigmas;
}

}  // namespace

bool DepthCalibration::is_significant() const {
  return is_beyond_doubt(tilt / sigma, num_pairs) && std::abs(tilt) > depth_limits::least_tilt;
}

bool DepthCalibration::has_wrong_focal_length() const {
  const double error = std::abs(focal_scale - 1.0);
  return is_beyond_doubt(error / focal_sigma, num_pairs) && error > depth_limits::least_focal_error;
}

bool DepthCalibration::has_radial_depth() const {
  return is_beyond_doubt(radial / radial_sigma, num_pairs) && radial > depth_limits::least_radial;
}

bool can_calibrate_depth(const Camera& camera) {
  return camera.model() == Camera::Model::pinhole && camera.depth_kind() == DepthKind::z;
}

DepthImage correct_depth(const DepthRef& depth, const Camera& camera, double tilt, int num_threads) {
  require_calibrable(camera);
  require_camera_size("depth", depth.rows(), depth.cols(), camera);
  DepthImage result(depth.rows(), depth.cols());
  const auto per_depth = static_cast<float>(tilt);
  parallel_for(depth.rows(), rows_per_block(depth.cols()), num_threads, [&](std::int64_t v) {
    const float* const x = camera.ray_table().row(static_cast<int>(v)).x;
    for (Eigen::Index u = 0; u < depth.cols(); ++u) {
      const float z = depth(v, u), change = per_depth * x[u] * z;
      result(v, u) = std::abs(change) < depth_limits::largest_correction ? z / (1.0F - change)
                                                                         : std::numeric_limits<float>::quiet_NaN();
    }
  });
  return result;
}

DepthCalibrator::DepthCalibrator(const Camera& camera) : camera_(camera) {
  require_calibrable(camera);
  rays_ = mean_rays(camera);
}

std::int64_t DepthCalibrator::num_blocks() const { return BlockGrid(camera_).size(); }

bool DepthCalibrator::has_enough() const { return num_views() == depth_limits::most_views; }

bool DepthCalibrator::is_new_direction(const Pose& world_from_camera) const {
  return views_.empty() ||
         angle_between(views_.back().world_from_camera, world_from_camera) >= depth_limits::least_turn;
}

bool DepthCalibrator::add(const DepthRef& depth, const Pose& world_from_camera) {
  require_camera_size("depth", depth.rows(), depth.cols(), camera_);
  require_rigid(world_from_camera, "world_from_camera");
  if (!is_new_direction(world_from_camera) || has_enough()) return false;
  views_.push_back({mean_depths(depth, camera_), world_from_camera});
  return true;
}

DepthCalibration DepthCalibrator::settled(Fit fit, int num_threads) const {
  for (;;) {
    const DepthCalibration found = iterate(fit, num_threads);
    if (fit.is_done) return found;
  }
}

// Depth is along the axis or along the rays, nothing between: what both fits say of tilt and focal length differs by
// noise alone where it is along the axis, and is better known there if nothing else is asked.
DepthCalibration DepthCalibrator::fit(int num_threads) const {
  Fit either = begun();
  either.asks_radial = true;
  const DepthCalibration along_rays = settled(std::move(either), num_threads);
  if (along_rays.has_radial_depth()) return along_rays;
  DepthCalibration found = settled(begun(), num_threads);
  found.radial = along_rays.radial;
  found.radial_sigma = along_rays.radial_sigma;
  return found;
}

void DepthCalibrator::begin_fit() { fit_ = begun(); }

// What a few more steps like the last would leave insignificant need not be known better.
std::optional<DepthCalibration> DepthCalibrator::step(int num_threads) {
  const DepthCalibration found = iterate(fit_.value(), num_threads);
  const double most = std::abs(found.tilt / found.sigma) + base_limits::longest_step * std::abs(fit_->last_step(0));
  if (!fit_->is_done && is_beyond_doubt(most, found.num_pairs)) return std::nullopt;
  fit_.reset();
  return found;
}

DepthCalibrator::Fit DepthCalibrator::begun() const {
  Fit fit;
  for (int step = 1; step <= 2; ++step) {
    for (int i = 0; i + step < num_views(); ++i) {
      const Pose &a = views_[static_cast<std::size_t>(i)].world_from_camera,
                 &b = views_[static_cast<std::size_t>(i + step)].world_from_camera;
      const double turn = angle_between(a, b);
      if (turn >= depth_limits::least_turn && turn <= depth_limits::most_turn) {
        fit.pairs.push_back({i, i + step, a.inverse() * b});
      }
    }
  }
  return fit;
}

// The median of the first view.
double DepthCalibrator::typical_depth() const {
  std::vector<double> depths;
  for (const float z : views_.front().depths) {
    if (std::isfinite(z)) depths.push_back(static_cast<double>(z));
  }
  return depths.empty() ? 0.0 : median_of(depths);
}

// What the views say; the fit is done where they are at rest, or may not come to it.
DepthCalibration DepthCalibrator::iterate(Fit& fit, int num_threads) const {
  fit.is_done = true;
  const Distortion distortion{fit.tilt, fit.stretch, fit.radial};
  const BlockGrid grid(camera_);
  const auto view = [&](std::int32_t i) {
    return CorrectedView(views_[static_cast<std::size_t>(i)].depths, rays_, grid, distortion);
  };
  std::vector<std::optional<PairFit>> fits(fit.pairs.size());
  parallel_for(static_cast<std::int64_t>(fits.size()), 1, num_threads, [&](std::int64_t k) {
    const Pair& pair = fit.pairs[static_cast<std::size_t>(k)];
    fits[static_cast<std::size_t>(k)] =
        linearise(view(pair.first), view(pair.second), pair.motion, distortion.stretch, camera_);
    if (fits[static_cast<std::size_t>(k)] && !fit.asks_radial) hold_radial(*fits[static_cast<std::size_t>(k)]);
  });
  DepthCalibration result;
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  for (const std::optional<PairFit>& pair : fits) {
    if (!pair) continue;
    information += pair->information;
    gradient += pair->gradient;
    ++result.num_pairs;
  }
  if (result.num_pairs < 2) return result;
  const Eigen::Matrix3d covariance = information.inverse();
  Eigen::Vector3d step = -covariance * gradient;
  // From the scatter, as neighbours share their errors; two pairs share a view.
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const std::optional<PairFit>& pair : fits) {
    if (!pair) continue;
    const Eigen::Vector3d left = pair->gradient + pair->information * step;
    scatter += left * left.transpose();
  }
  const Eigen::Array3d sigmas = (2.0 * (covariance * scatter * covariance).diagonal().array()).sqrt();
  const Eigen::Vector3d in_sigmas = step.array() / sigmas.max(1e-12);
  const double longest = depth_limits::largest_stretch_step / std::max(std::abs(step(1)), 1e-12);
  fit.length = std::min(step_length(fit.last_step, fit.length, in_sigmas, Eigen::Matrix3d::Identity()), longest);
  fit.last_step = in_sigmas;
  step *= fit.length;
  fit.tilt += step(0);
  // What lies across the axis looks turned by so much: by more than the views are, and turns and tilt change places.
  if (!(std::abs(fit.tilt) * typical_depth() <= depth_limits::least_turn)) return DepthCalibration{};
  fit.stretch += step(1);
  fit.radial += step(2);
  result.tilt = fit.tilt;
  result.sigma = sigmas(0);
  result.focal_scale = 1.0 / fit.stretch;
  result.focal_sigma = sigmas(1) / (fit.stretch * fit.stretch);
  if (fit.asks_radial) {
    result.radial = fit.radial;
    result.radial_sigma = sigmas(2);
  }
  const bool is_at_rest = (step.array().abs() <= depth_limits::at_rest * sigmas).all();
  fit.is_done = is_at_rest || ++fit.iteration == depth_limits::most_calibration_steps;
  if (fit.is_done) return result;
  for (std::size_t i = 0; i < fits.size(); ++i) {
    if (fits[i]) fit.pairs[i].motion = followed(fit.pairs[i].motion, *fits[i], {step(0), step(1), step(2), fit.length});
  }
  return result;
}

void DepthCalibrator::set_poses(const std::vector<Pose>& world_from_camera) {
  for (std::size_t i = 0; i < views_.size(); ++i) views_[i].world_from_camera = world_from_camera[i];
}

std::vector<Pose> DepthCalibrator::correct(double tilt, int num_threads) {
  fit_.reset();
  const BlockGrid grid(camera_);
  const auto straight = [&](const View& view) { return CorrectedView(view.depths, rays_, grid, {tilt}); };
  std::vector<Pose> motions(views_.size(), Pose::Identity());
  parallel_for(num_views() - 1, 1, num_threads, [&](std::int64_t k) {
    const auto i = static_cast<std::size_t>(k);
    Pose motion = views_[i].world_from_camera.inverse() * views_[i + 1].world_from_camera;
    const std::optional<PairFit> fit = linearise(straight(views_[i]), straight(views_[i + 1]), motion, 1.0, camera_);
    motions[i + 1] = fit ? followed(motion, *fit, {0.0, 0.0, 0.0, 1.0}) : motion;
  });
  for (View& view : views_) {
    const CorrectedView corrected = straight(view);
    for (Eigen::Index i = 0; i < view.depths.size(); ++i) {
      view.depths(i) = static_cast<float>(corrected.point(i).z());
    }
  }
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < views_.size(); ++i) {
    poses.push_back(i == 0 ? views_[0].world_from_camera : orthonormal(poses.back() * motions[i]));
  }
  set_poses(poses);
  return poses;
}

}  // namespace nacre
