#include "tracking/still_scene.hpp"

#include <algorithm>
#include <limits>

#include "camera/limits.hpp"
#include "tracking/limits.hpp"

namespace nacre {
namespace {

constexpr CellBudget cell_budget = {tracking_limits::most_cells, tracking_limits::largest_cell};
constexpr float unknown = std::numeric_limits<float>::quiet_NaN();

VisibilityMargin of_surface(double margin) { return {margin, camera_limits::another_surface}; }

DepthView view_of(const CoarseFrame& cells, const Pose& world_from_camera) {
  DepthView view{Values(cells.size()), Values(cells.size()), world_from_camera};
  for (int i = 0; i < cells.size(); ++i) {
    view.depth[i] = cells[i].has_point() ? cells[i].point.z() : unknown;
    view.sigma[i] = cells[i].sigma;
  }
  return view;
}

// visit(i, block, k) for the cells that are in the image of a camera at a pose in their frame.
template <class Visit>
void visit_cells_in_view(const CoarseFrame& cells, const PointProjection& projection, Visit&& visit) {
  Points points(cells.size(), 3), normals(cells.size(), 3);
  for (int i = 0; i < cells.size(); ++i) {
    points.row(i) = cells[i].point.transpose();
    normals.row(i) = cells[i].normal.transpose();
  }
  visit_points_in_view(points, normals, 0, cells.size(), projection, [&](Eigen::Index i, const auto& block, int k) {
    if (cells[static_cast<int>(i)].has_point()) visit(static_cast<int>(i), block, k);
  });
}

// What a view says of each cell of a frame.
std::vector<Visibility> judge(const CoarseFrame& cells, const Pose& world_from_cells, const DepthView& view,
                              const Camera& camera, double margin) {
  std::vector<Visibility> judged(cells.cells.size(), Visibility::unknown);
  const PointProjection projection(camera, world_from_cells.inverse() * view.world_from_camera);
  visit_cells_in_view(cells, projection, [&](int i, const PointProjection::Block& block, int k) {
    judged[static_cast<std::size_t>(i)] = visibility_in(view, block, k, of_surface(margin), cells[i].sigma);
  });
  return judged;
}

// Shows in a view, at some of its pixels, what another one shows there.
template <class IsChosen>
void show_from(const DepthView& other, const Camera& camera, IsChosen&& is_chosen, DepthView& view) {
  const PointProjection projection(camera, other.world_from_camera.inverse() * view.world_from_camera);
  const Points points = SeenPoints(other, camera).points;
  visit_points_in_view(points, points, 0, points.rows(), projection, [&](Eigen::Index i, const auto& block, int k) {
    const std::int32_t pixel = block.pixel[k];
    if (!is_chosen(pixel) || view.depth[pixel] < block.z[k]) return;
    view.depth[pixel] = block.z[k];
    view.sigma[pixel] = other.sigma[i];
  });
}

// visit(j) for a cell and those beside it, of so many across and down.
template <class Visit>
void visit_around(int i, int across, int down, Visit&& visit) {
  const int u = i % across, v = i / across;
  for (int y = std::max(0, v - 1); y <= std::min(down - 1, v + 1); ++y) {
    for (int x = std::max(0, u - 1); x <= std::min(across - 1, u + 1); ++x) {
      visit(static_cast<std::size_t>(y * across + x));
    }
  }
}

// Cells of one thing.
struct Thing {
  int core = 0;     // where the scene was seen through, there and all around
  int moved = 0;    // where something moved in the frame before
  int evident = 0;  // where either is so
};

}  // namespace

StillScene::StillScene(const Camera& camera)
    : width_(camera.width()), height_(camera.height()), camera_(camera_of_cells(camera)) {}

Camera StillScene::camera_of_cells(const Camera& camera) { return coarse_camera(camera, cell_budget); }

CoarseFrame StillScene::cells_of(const Frame& frame, const Camera& camera) {
  return CoarseFrame(frame, camera, MaskImage(), cell_budget);
}

MaskImage StillScene::still_region(const CoarseFrame& cells, const Pose& world_from_camera, double margin) const {
  if (scene_.depth.size() == 0) return {};
  const auto count = static_cast<std::size_t>(cells.size());
  const std::vector<Visibility> judged = judge(cells, world_from_camera, scene_, camera_, margin);
  std::vector<std::uint8_t> is_unconfirmed(count);
  for (std::size_t i = 0; i < count; ++i) {
    is_unconfirmed[i] = judged[i] == Visibility::seen_through || judged[i] == Visibility::unknown;
  }
  const CellGroups groups = connect(cells, is_unconfirmed);
  std::vector<Thing> things(groups.size.size());
  for (std::size_t i = 0; i < count; ++i) {
    if (groups.group[i] < 0) continue;
    Thing& thing = things[static_cast<std::size_t>(groups.group[i])];
    const bool is_through = judged[i] == Visibility::seen_through, has_moved = !moved_.empty() && moved_[i] != 0;
    thing.moved += has_moved;
    thing.evident += is_through || has_moved;
    if (!is_through) continue;
    int num_through = 0, num_judged = 0;
    visit_around(static_cast<int>(i), cells.width, cells.height, [&](std::size_t j) {
      num_through += judged[j] == Visibility::seen_through;
      num_judged += judged[j] != Visibility::unknown;
    });
    thing.core += num_through == num_judged && num_judged >= tracking_limits::least_around;
  }
  const auto moves = [&](std::size_t k) {
    const bool goes_on = 2 * things[k].moved > groups.size[k];
    return things[k].core >= (goes_on ? 1.0 : tracking_limits::least_core * cells.size());
  };
  std::vector<std::uint8_t> is_moving(count, 0);
  for (std::size_t i = 0; i < count; ++i) {
    if (groups.group[i] < 0) continue;
    const auto k = static_cast<std::size_t>(groups.group[i]);
    const bool is_whole = 2 * things[k].evident > groups.size[k];
    if (!moves(k) || (!is_whole && judged[i] != Visibility::seen_through)) continue;
    visit_around(static_cast<int>(i), cells.width, cells.height, [&](std::size_t j) { is_moving[j] = 1; });
  }
  int num_moving = 0, num_points = 0;
  for (std::size_t i = 0; i < count; ++i) {
    num_points += cells.cells[i].has_point();
    num_moving += cells.cells[i].has_point() && is_moving[i] != 0;
  }
  if (num_moving == 0 || num_moving > tracking_limits::most_moving * num_points) return {};
  return pixels_without(is_moving, cells, width_, height_);
}

void StillScene::add(const CoarseFrame& cells, const MaskImage& still, const Pose& world_from_camera, double margin) {
  moved_.assign(still.size() > 0 ? cells.cells.size() : 0, 0);
  for (std::size_t i = 0; i < moved_.size(); ++i) {
    moved_[i] = cells.cells[i].has_point() && still.data()[cells.cells[i].pixel] == 0;
  }
  DepthView now = view_of(cells, world_from_camera);
  const auto hide = [&](const std::vector<std::uint8_t>& is_hidden) {
    for (std::size_t i = 0; i < is_hidden.size(); ++i) {
      if (is_hidden[i] != 0) now.depth[static_cast<Eigen::Index>(i)] = unknown;
    }
  };
  if (scene_.depth.size() > 0 && part_in_view(cells, world_from_camera) > tracking_limits::least_in_view) {
    hide(moved_);
    forget_what_left(now, margin);
    return;
  }
  const DepthView all = now;
  if (!moved_.empty() && all_.depth.size() > 0) {
    // What has not moved since the camera came to the last place has become part of the scene.
    std::vector<std::uint8_t> is_hidden = moved_;
    const std::vector<Visibility> then = judge(cells, world_from_camera, all_, camera_, margin);
    for (std::size_t i = 0; i < then.size(); ++i) is_hidden[i] &= then[i] != Visibility::agrees;
    hide(is_hidden);
    show_from(scene_, camera_, [&](std::int32_t i) { return is_hidden[static_cast<std::size_t>(i)] != 0; }, now);
  }
  scene_ = now;
  all_ = all;
}

// Of a frame, in the image of the scene.
double StillScene::part_in_view(const CoarseFrame& cells, const Pose& world_from_camera) const {
  const PointProjection projection(camera_, world_from_camera.inverse() * scene_.world_from_camera);
  int num_in_view = 0, num_points = 0;
  for (const Cell& cell : cells.cells) num_points += cell.has_point();
  visit_cells_in_view(cells, projection, [&](int, const PointProjection::Block&, int) { ++num_in_view; });
  return static_cast<double>(num_in_view) / std::max(1, num_points);
}

void StillScene::move(const Pose& motion) {
  scene_.world_from_camera = motion * scene_.world_from_camera;
  all_.world_from_camera = motion * all_.world_from_camera;
}

void StillScene::forget_what_left(const DepthView& now, double margin) {
  const Points points = SeenPoints(scene_, camera_).points, towards_camera = -points.rowwise().normalized();
  std::vector<std::uint8_t> has_left(static_cast<std::size_t>(points.rows()), 0);
  const PointProjection projection(camera_, scene_.world_from_camera.inverse() * now.world_from_camera);
  const auto look = [&](Eigen::Index i, const PointProjection::Block& block, int k) {
    if (visibility_in(now, block, k, of_surface(margin), scene_.sigma[i]) != Visibility::seen_through) return;
    has_left[static_cast<std::size_t>(i)] = 1;
    scene_.depth[i] = unknown;
  };
  visit_points_in_view(points, towards_camera, 0, points.rows(), projection, look);
  if (std::find(has_left.begin(), has_left.end(), 1) == has_left.end()) return;
  show_from(now, camera_, [&](std::int32_t i) { return has_left[static_cast<std::size_t>(i)] != 0; }, scene_);
}

namespace {

// Squares of an image.
struct Squares {
  int width, side, across, down;

  explicit Squares(const Camera& camera)
      : width(camera.width()),
        side(std::max(1, std::max(camera.width(), camera.height()) / tracking_limits::squares_across)),
        across((camera.width() + side - 1) / side),
        down((camera.height() + side - 1) / side) {}

  std::size_t size() const { return static_cast<std::size_t>(across * down); }
  std::size_t at(std::int32_t pixel) const {
    return static_cast<std::size_t>(pixel / width / side * across + pixel % width / side);
  }
};

// One of every `step` rows.
Points some_of(const PointsRef& points, Eigen::Index step) {
  Points some((points.rows() + step - 1) / step, 3);
  for (Eigen::Index i = 0; i < some.rows(); ++i) some.row(i) = points.row(i * step);
  return some;
}

}  // namespace

std::vector<std::int32_t> still_points(const PointsRef& points, const PointsRef& normals, const DepthView& view,
                                       const Pose& world_from_camera, const Camera& camera, double margin) {
  const Squares squares(camera);
  const PointProjection projection(camera, world_from_camera);
  struct Count {
    int judged = 0, through = 0;
  };
  std::vector<Count> counts(squares.size());
  const Eigen::Index step = std::max<Eigen::Index>(1, points.rows() / tracking_limits::most_judged_points);
  const Points some = some_of(points, step), their_normals = some_of(normals, step);
  visit_points_in_view(some, their_normals, 0, some.rows(), projection, [&](auto, const auto& block, int k) {
    const Visibility is = visibility_in(view, block, k, of_surface(margin));
    if (is != Visibility::agrees && is != Visibility::seen_through) return;
    Count& count = counts[squares.at(block.pixel[k])];
    ++count.judged;
    count.through += is == Visibility::seen_through;
  });
  std::vector<std::uint8_t> is_gone(squares.size(), 0);
  for (std::size_t i = 0; i < counts.size(); ++i) {
    int gone_around = 0, judged_around = 0;
    visit_around(static_cast<int>(i), squares.across, squares.down, [&](std::size_t j) {
      judged_around += counts[j].judged > 0;
      gone_around += 2 * counts[j].through > counts[j].judged;
    });
    if (gone_around < judged_around || judged_around < tracking_limits::least_around) continue;
    visit_around(static_cast<int>(i), squares.across, squares.down, [&](std::size_t j) { is_gone[j] = 1; });
  }
  int num_gone = 0, num_judged = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    num_judged += counts[i].judged;
    num_gone += is_gone[i] != 0 ? counts[i].judged : 0;
  }
  std::vector<std::uint8_t> stays(static_cast<std::size_t>(points.rows()), 1);
  if (num_gone > 0 && num_gone < (1.0 - tracking_limits::most_moving) * num_judged) {
    visit_points_in_view(points, normals, 0, points.rows(), projection, [&](auto i, const auto& block, int k) {
      stays[static_cast<std::size_t>(i)] = is_gone[squares.at(block.pixel[k])] == 0;
    });
  }
  std::vector<std::int32_t> rows;
  for (std::size_t i = 0; i < stays.size(); ++i) {
    if (stays[i] != 0) rows.push_back(static_cast<std::int32_t>(i));
  }
  return rows;
}

}  // namespace nacre
