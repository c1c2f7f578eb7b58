#include "deformation/node_growth.hpp"

#include <algorithm>
#include <cmath>
#include <queue>
#include <tuple>

#include "deformation/limits.hpp"
#include "spatial/hash_grid.hpp"

namespace nacre {
namespace {

struct SurfaceStep {
  std::size_t to;  // among the new points
  float length;    // [m]
};

// Ways over the new points, and to them from those around.
class SurfaceGraph {
 public:
  SurfaceGraph(const WarpField& field, const GrownSurface& surface)
      : first_(field.bindings.size()), steps_(surface.points.size() - first_) {
    const float widest =
        surface.spacings.empty() ? 1.0F : *std::max_element(surface.spacings.begin(), surface.spacings.end());
    PointGrid grid(deformation_limits::neighbor_spacings * static_cast<double>(widest), surface.points.size());
    std::vector<std::size_t> rows;  // of the grid's points
    for (std::size_t i = 0; i < surface.points.size(); ++i) {
      if (i < first_ && surface.last_seen[i] != surface.frame) continue;
      grid.add(surface.points[i]);
      rows.push_back(i);
    }
    for (std::size_t i = first_; i < surface.points.size(); ++i) {
      const float reach = static_cast<float>(deformation_limits::neighbor_spacings) * surface.spacings[i - first_];
      grid.any_near(surface.points[i], [&](std::int32_t k) {
        const std::size_t other = rows[static_cast<std::size_t>(k)];
        const float length = (surface.points[other] - surface.points[i]).norm();
        if (other != i && length < reach &&
            surface.normals[other].dot(surface.normals[i]) > deformation_limits::least_neighbor_cosine) {
          connect(i, other, length);
        }
        return false;
      });
    }
    for (std::vector<SurfaceStep>& steps : steps_) {
      const auto is_before = [](const SurfaceStep& a, const SurfaceStep& b) { return a.to < b.to; };
      const auto is_same = [](const SurfaceStep& a, const SurfaceStep& b) { return a.to == b.to; };
      std::sort(steps.begin(), steps.end(), is_before);
      steps.erase(std::unique(steps.begin(), steps.end(), is_same), steps.end());
    }
  }

  const std::vector<SurfaceStep>& from(std::size_t new_point) const { return steps_[new_point]; }
  struct Border {
    std::size_t from, to;  // a point that is bound, and a new one
    float length;
  };
  const std::vector<Border>& borders() const { return borders_; }

 private:
  void connect(std::size_t i, std::size_t other, float length) {
    if (other < first_) {
      borders_.push_back({other, i - first_, length});
      return;
    }
    steps_[i - first_].push_back({other - first_, length});  // the narrower spacing of both may not reach
    steps_[other - first_].push_back({i - first_, length});
  }

  std::size_t first_;
  std::vector<std::vector<SurfaceStep>> steps_;
  std::vector<Border> borders_;
};

// Dijkstra's algorithm for many nodes at once: a way goes on from where its node is among the nearest.
class NodeDistances {
 public:
  // apart: of nodes around each new point [m].
  NodeDistances(const SurfaceGraph& graph, std::vector<WarpBinding>& bindings, std::size_t first,
                const std::vector<float>& apart)
      : graph_(graph), bindings_(bindings), first_(first), apart_(apart) {}

  void start(std::size_t new_point, std::int32_t node, float distance) { open_.emplace(distance, new_point, node); }

  void spread() {
    while (!open_.empty()) {
      const auto [distance, point, node] = open_.top();
      open_.pop();
      const float reach = static_cast<float>(deformation_limits::node_reach) * apart_[point];
      if (distance > reach || !bindings_[first_ + point].offer(node, distance)) continue;
      for (const SurfaceStep& step : graph_.from(point)) {
        const WarpBinding& next = bindings_[first_ + step.to];
        if (next.count() == WarpBinding::size && next.distances.back() < distance + step.length) continue;
        open_.emplace(distance + step.length, step.to, node);
      }
    }
  }

 private:
  using Way = std::tuple<float, std::size_t, std::int32_t>;
  const SurfaceGraph& graph_;
  std::vector<WarpBinding>& bindings_;
  std::size_t first_;
  const std::vector<float>& apart_;
  std::priority_queue<Way, std::vector<Way>, std::greater<Way>> open_;
};

// The nodes nearest through the air, for surface that no way leads to.
WarpBinding nearest_nodes(const WarpField& field, const Eigen::Vector3d& place) {
  WarpBinding binding;
  for (std::size_t k = 0; k < field.nodes.size(); ++k) {
    binding.offer(static_cast<std::int32_t>(k), static_cast<float>((field.nodes[k].position - place).norm()));
  }
  return binding;
}

void add_node(WarpField& field, const WarpBinding& near, const Eigen::Vector3d& place) {
  WarpNode node;
  node.parents = near.count() > 0 ? near : nearest_nodes(field, place);
  const Eigen::Affine3d motion = field.at(node.parents);
  node.rotation = nearest_rotation(motion.linear());
  node.position = place;
  node.rest = motion.inverse() * place;
  const auto number = static_cast<std::int32_t>(field.nodes.size());
  if (node.parents.count() > 0) field.edges.push_back({node.parents.nodes[0], number});
  field.nodes.push_back(node);
}

}  // namespace

void grow(WarpField& field, const GrownSurface& surface) {
  const std::size_t first = field.bindings.size();
  if (surface.points.size() == first) return;
  const SurfaceGraph graph(field, surface);
  field.bindings.resize(surface.points.size());
  std::vector<float> apart;  // nodes, around each point
  for (const float spacing : surface.spacings) {
    const double farther = std::max(1.0, static_cast<double>(spacing) / surface.spacing);
    apart.push_back(static_cast<float>(farther * field.node_spacing));
  }
  NodeDistances ways(graph, field.bindings, first, apart);
  for (const SurfaceGraph::Border& border : graph.borders()) {
    const WarpBinding& bound = field.bindings[border.from];
    for (int k = 0; k < bound.count(); ++k) {
      const auto i = static_cast<std::size_t>(k);
      ways.start(border.to, bound.nodes[i], bound.distances[i] + border.length);
    }
  }
  ways.spread();
  for (std::size_t i = first; i < surface.points.size(); ++i) {
    const WarpBinding near = field.bindings[i];
    if (near.count() > 0 && near.distances[0] < apart[i - first]) continue;
    add_node(field, near, surface.points[i].cast<double>());
    ways.start(i - first, static_cast<std::int32_t>(field.nodes.size()) - 1, 0.0F);
    ways.spread();
  }
  for (std::size_t i = first; i < surface.points.size(); ++i) {
    const WarpBinding& binding = field.bindings[i];
    const int most = std::min(3, binding.count());
    for (int a = 0; a < most; ++a) {
      for (int b = a + 1; b < most; ++b) {
        const auto [low, high] =
            std::minmax(binding.nodes[static_cast<std::size_t>(a)], binding.nodes[static_cast<std::size_t>(b)]);
        field.edges.push_back({low, high});
      }
    }
  }
  std::sort(field.edges.begin(), field.edges.end());
  field.edges.erase(std::unique(field.edges.begin(), field.edges.end()), field.edges.end());
}

}  // namespace nacre
