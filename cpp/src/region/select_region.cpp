#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <string>

#include "base/check.hpp"
#include "base/numbers.hpp"
#include "base/parallel.hpp"
#include "depth/inverse_depth_image.hpp"
#include "nacre/region.hpp"
#include "region/coarse_frame.hpp"
#include "region/limits.hpp"
#include "region/support_planes.hpp"

namespace nacre {
namespace {

// The pixels with a point in the box.
MaskImage box_mask(const Frame& frame, const RegionOptions& options) {
  MaskImage mask(frame.height, frame.width);
  const auto inside = [](float value, double low, double high) { return value >= low && value <= high; };
  for (Eigen::Index row = 0; row < mask.size(); ++row) {
    mask.data()[row] = frame.points(row, 2) > 0.0F && inside(frame.points(row, 0), options.min_x, options.max_x) &&
                       inside(frame.points(row, 1), options.min_y, options.max_y) &&
                       inside(frame.points(row, 2), options.min_z, options.max_z);
  }
  return mask;
}

// The side of a square of so many cells [m].
float extent_of(const CellGroups& groups, std::int32_t group, const Cell& cell) {
  return std::sqrt(static_cast<float>(groups.size[static_cast<std::size_t>(group)])) * cell.footprint;
}

// Which groups of cells stand on a plane: a cell of it is nearer than the group is large, or nearly, for round things
// hide where they touch.
std::vector<std::uint8_t> standing_groups(const CoarseFrame& frame, const CellGroups& groups,
                                          const std::vector<std::uint8_t>& on_plane) {
  std::vector<std::uint8_t> stands(groups.size.size(), 0);
  for (int i = 0; i < frame.size(); ++i) {
    if (on_plane[static_cast<std::size_t>(i)] == 0) continue;
    frame.for_neighbours(i, region_limits::contact_reach / frame.step, [&](int j, int) {
      const std::int32_t group = groups.group[static_cast<std::size_t>(j)];
      if (group < 0) return;
      const float apart = (frame[i].point - frame[j].point).norm();
      if (!(apart < region_limits::adoption_size * extent_of(groups, group, frame[j]))) return;
      stands[static_cast<std::size_t>(group)] = 1;
    });
  }
  return stands;
}

// A group that stands on nothing is part of one that does, no farther behind or before it than that one is large: of
// the one to which most links go.
void adopt_floating(const CoarseFrame& frame, const std::vector<std::uint8_t>& stands, CellGroups& groups) {
  std::map<std::pair<std::int32_t, std::int32_t>, std::int64_t> links;  // of floating and standing groups
  for (int i = 0; i < frame.size(); ++i) {
    const std::int32_t floating = groups.group[static_cast<std::size_t>(i)];
    if (floating < 0 || stands[static_cast<std::size_t>(floating)] != 0) continue;
    frame.for_neighbours(i, region_limits::contact_reach / frame.step, [&](int j, int) {
      const std::int32_t other = groups.group[static_cast<std::size_t>(j)];
      if (other < 0 || stands[static_cast<std::size_t>(other)] == 0) return;
      links[{floating, other}] += (frame[i].point - frame[j].point).norm() < extent_of(groups, other, frame[j]);
    });
  }
  std::vector<std::int32_t> becomes(groups.size.size());
  std::iota(becomes.begin(), becomes.end(), 0);
  std::vector<std::int64_t> most(groups.size.size(), 0);
  for (const auto& [pair, count] : links) {
    const auto floating = static_cast<std::size_t>(pair.first);
    if (count <= most[floating]) continue;
    most[floating] = count;
    becomes[floating] = pair.second;
  }
  for (std::int32_t& group : groups.group) {
    if (group < 0) continue;
    const std::int32_t other = becomes[static_cast<std::size_t>(group)];
    --groups.size[static_cast<std::size_t>(group)];
    ++groups.size[static_cast<std::size_t>(other)];
    group = other;
  }
}

// Walls and the like: beside a plane, what the image's border cuts off on most sides is no thing.
void leave_out_background(const CoarseFrame& frame, const CellGroups& groups, std::vector<std::uint8_t>& eligible) {
  const std::vector<std::int32_t> cut = border_cells(frame, groups.group, groups.size.size());
  for (std::size_t g = 0; g < cut.size(); ++g) {
    eligible[g] &= cut_off(cut[g], groups.size[g]) < region_limits::background;
  }
}

// The group that shows what the last mask showed; else the largest; -1 where all are too small.
std::int32_t choose_group(const CoarseFrame& frame, const CellGroups& groups, const std::vector<std::uint8_t>& eligible,
                          const MaskRef& previous, const RegionOptions& options) {
  std::vector<std::int64_t> shared(groups.size.size(), 0);
  std::int64_t num_previous = 0;
  for (int i = 0; i < frame.size() && previous.size() > 0; ++i) {
    if (!frame[i].has_point() || previous.data()[frame[i].pixel] == 0) continue;
    ++num_previous;
    const std::int32_t group = groups.group[static_cast<std::size_t>(i)];
    if (group >= 0) ++shared[static_cast<std::size_t>(group)];
  }
  std::int32_t best = -1;
  std::pair<std::int64_t, std::int64_t> best_rank;  // shared cells where these are many, then all
  for (std::size_t g = 0; g < groups.size.size(); ++g) {
    if (eligible[g] == 0 || groups.size[g] < options.min_object * frame.size()) continue;
    const double smaller = static_cast<double>(std::min<std::int64_t>(groups.size[g], num_previous));
    const bool is_known = shared[g] > 0 && static_cast<double>(shared[g]) >= region_limits::same_thing * smaller;
    const std::pair<std::int64_t, std::int64_t> rank{is_known ? shared[g] : 0, groups.size[g]};
    if (best >= 0 && rank <= best_rank) continue;
    best = static_cast<std::int32_t>(g);
    best_rank = rank;
  }
  return best;
}

// The pixels of a group of cells: before all planes, and connected to a cell of the group.
void draw_group(const Frame& frame, const CoarseFrame& coarse, const Camera& camera, const CellGroups& groups,
                std::int32_t chosen, const std::vector<SupportPlane>& planes, const RegionOptions& options,
                int num_threads, MaskImage& mask) {
  std::vector<PlaneCut> cuts;
  cuts.reserve(planes.size());
  for (const SupportPlane& plane : planes) cuts.emplace_back(plane, options.plane_margin);
  parallel_for(frame.height, rows_per_block(frame.width), num_threads, [&](std::int64_t v) {
    for (int u = 0; u < frame.width; ++u) {
      std::uint8_t& flag = mask(v, u);
      if (flag == 0) continue;
      flag = 0;
      const Eigen::Index row = v * frame.width + u;
      Cell pixel;
      pixel.point = frame.points.row(row).transpose();
      const auto side = static_cast<float>(camera.footprint(pixel.point.z()));
      pixel.footprint = side * static_cast<float>(coarse.step);
      const float sigma = std::isfinite(frame.sigma[row]) ? frame.sigma[row] : 0.0F;
      const Eigen::Vector3f normal = frame.normals.row(row).transpose();
      const bool is_before = std::all_of(cuts.begin(), cuts.end(), [&](const PlaneCut& cut) {
        return cut.side(pixel.point, normal, sigma, side) > 0;
      });
      if (!is_before) continue;
      const int x = u / coarse.step, y = static_cast<int>(v) / coarse.step;
      for (int j = std::max(0, y - 1); j <= std::min(coarse.height - 1, y + 1) && flag == 0; ++j) {
        for (int i = std::max(0, x - 1); i <= std::min(coarse.width - 1, x + 1) && flag == 0; ++i) {
          const int k = j * coarse.width + i;
          flag = groups.group[static_cast<std::size_t>(k)] == chosen && are_linked(pixel, coarse[k], 1);
        }
      }
    }
  });
}

// The plane to which the lower end of a thing is nearest.
int support_of(const Frame& frame, const MaskImage& mask, const std::vector<SupportPlane>& planes) {
  int support = -1;
  double least = infinity<double>;
  for (std::size_t k = 0; k < planes.size(); ++k) {
    std::vector<double> heights;
    for (Eigen::Index row = 0; row < mask.size(); ++row) {
      if (mask.data()[row] == 0 || !frame.points.row(row).allFinite()) continue;
      heights.push_back(planes[k].normal.dot(frame.points.row(row).transpose().cast<double>()) - planes[k].offset);
    }
    if (heights.empty()) return -1;
    const auto low =
        heights.begin() + static_cast<std::ptrdiff_t>(region_limits::lower_end * static_cast<double>(heights.size()));
    std::nth_element(heights.begin(), low, heights.end());
    if (*low >= least) continue;
    least = *low;
    support = static_cast<int>(k);
  }
  return support;
}

void select_object(const Frame& frame, const Camera& camera, const RegionOptions& options, const MaskRef& previous,
                   int num_threads, MaskImage& mask, RegionReport& report) {
  const CoarseFrame coarse(frame, camera, mask);
  std::vector<std::uint8_t> left(coarse.cells.size()), on_plane(coarse.cells.size(), 0);
  for (std::size_t i = 0; i < left.size(); ++i) left[i] = coarse.cells[i].has_point();
  report.planes = put_planes_aside(coarse, options, num_threads, left, on_plane);
  CellGroups groups = connect(coarse, left);
  std::vector<std::uint8_t> eligible(groups.size.size(), 1);
  if (!report.planes.empty()) {
    eligible = standing_groups(coarse, groups, on_plane);
    adopt_floating(coarse, eligible, groups);
    leave_out_background(coarse, groups, eligible);
  }
  const std::int32_t chosen = choose_group(coarse, groups, eligible, previous, options);
  if (chosen < 0) {
    report.reason = report.planes.empty() ? "there is no plane on which anything stands, and nothing large enough"
                                          : "nothing large enough stands on a plane";
    mask.setZero();
    return;
  }
  draw_group(frame, coarse, camera, groups, chosen, report.planes, options, num_threads, mask);
  report.support = support_of(frame, mask, report.planes);
}

}  // namespace

bool RegionOptions::has_box() const {
  return std::isfinite(min_x) || std::isfinite(max_x) || std::isfinite(min_y) || std::isfinite(max_y) ||
         std::isfinite(min_z) || std::isfinite(max_z);
}

bool RegionOptions::is_limited() const { return object || has_box(); }

void RegionOptions::check() const {
  require(min_x < max_x, "region.min_x", "less than region.max_x", min_x);
  require(min_y < max_y, "region.min_y", "less than region.max_y", min_y);
  require(min_z < max_z, "region.min_z", "less than region.max_z", min_z);
  require(min_object > 0.0 && min_object <= 1.0, "region.min_object", "in (0, 1]", min_object);
  require(plane_margin >= 0.0 && std::isfinite(plane_margin), "region.plane_margin",
          "0 (automatic) or a positive distance in metres", plane_margin);
}

MaskImage select_region(const Frame& frame, const Camera& camera, const RegionOptions& options, const MaskRef& previous,
                        RegionReport* report, int num_threads) {
  options.check();
  require_camera_size("frame", frame.height, frame.width, camera);
  if (previous.size() > 0) require_camera_size("previous", previous.rows(), previous.cols(), camera);
  MaskImage mask = box_mask(frame, options);
  RegionReport result;
  const auto num_points = static_cast<std::int64_t>((frame.points.col(2).array() > 0.0F).count());
  if (options.object) select_object(frame, camera, options, previous, num_threads, mask, result);
  result.num_inside = (mask != std::uint8_t{0}).count();
  result.num_outside = num_points - result.num_inside;
  if (result.num_inside == 0 && result.reason.empty()) result.reason = "nothing is inside of the box";
  if (report != nullptr) *report = result;
  return mask;
}

void keep_region(const MaskRef& region, Frame& frame) {
  require(region.rows() == frame.height && region.cols() == frame.width, "region", "of the frame's size",
          std::to_string(region.cols()) + " x " + std::to_string(region.rows()));
  frame.valid.erase(
      std::remove_if(frame.valid.begin(), frame.valid.end(), [&](std::int32_t row) { return region.data()[row] == 0; }),
      frame.valid.end());
  for (Eigen::Index row = 0; row < region.size(); ++row) {
    if (region.data()[row] == 0) frame.normals.row(row).setConstant(std::numeric_limits<float>::quiet_NaN());
  }
}

}  // namespace nacre
