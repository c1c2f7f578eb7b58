// Poses that are tied to each other by measured motions, and the poses that fit the measurements best.
#pragma once

#include <vector>

#include "nacre/types.hpp"

namespace nacre {

// A measured motion between two nodes. Its residual is the twist log(from_from_to^-1 pose_from^-1 pose_to), in the
// frame of `to`; information is the inverse covariance of that.
struct PoseEdge {
  int from, to;
  Pose from_from_to;
  Matrix6 information;
  bool is_loop;  // may be wrong
};

struct PoseGraphFit {
  bool converged = false;
  int iterations = 0;
  double cost = 0.0;            // sum of the squared errors that count
  double largest_error = 0.0;   // of the edges that count, in standard deviations
  std::vector<double> weights;  // of each edge: 1 counts, 0 is left out
};

// Nodes and edges may be added at any time. Every node must be tied to a fixed one, through edges that are no loops.
class PoseGraph {
 public:
  // Returns the number of the node. Nodes that are fixed stay where they are; the first always is.
  int add_node(const Pose& world_from_node, bool is_fixed = false);
  void add_edge(const PoseEdge& edge);
  void drop_edges(std::size_t num_kept) { edges_.resize(num_kept); }  // the newest

  int num_nodes() const { return static_cast<int>(poses_.size()); }
  const std::vector<PoseEdge>& edges() const { return edges_; }
  const std::vector<Pose>& poses() const { return poses_; }
  void set_poses(const std::vector<Pose>& poses) { poses_ = poses; }
  void measure_edges();    // as the poses are now
  bool has_fixed() const;  // nodes beside the first

  // Moves the nodes to the least squares of all residuals (Gauss and Newton, damped after Levenberg and Marquardt).
  // Loops are measured more finely than the way between their ends, so that a wrong one does not keep its residual: it
  // bends the way. While an edge is off by more than `outlier` standard deviations, the loop goes, of the newest,
  // without which the others fit best.
  PoseGraphFit optimise(double outlier = 5.0);

 private:
  friend struct PrivateState;
  double squared_error(std::size_t edge, const std::vector<Pose>& poses) const;
  double cost(const std::vector<Pose>& poses, const std::vector<double>& weights) const;
  PoseGraphFit fit(const std::vector<double>& weights);
  bool step(const std::vector<double>& weights, double& damping, double& cost);

  std::vector<Pose> poses_;
  std::vector<int> unknowns_;  // where a node's six unknowns begin; -1: fixed
  int num_unknowns_ = 0;
  std::vector<PoseEdge> edges_;
};

}  // namespace nacre
