// Embedded deformation (Sumner, Schmid and Pauly 2007): nodes on a surface, each of which turns about itself and goes
// somewhere; a point of the surface goes where its nearest nodes take it, blended.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "deformation/limits.hpp"
#include "nacre/types.hpp"

namespace nacre {

// The nodes nearest to a point along the surface. The last only tells how far the others' influence reaches.
struct WarpBinding {
  static constexpr int blended = deformation_limits::blended_nodes;
  static constexpr int size = blended + 1;

  std::array<std::int32_t, size> nodes;    // nearest first; -1: none
  std::array<float, size> distances = {};  // [m]

  WarpBinding() { nodes.fill(-1); }
  int count() const;
  int num_blended() const { return std::min(count(), blended); }
  // Takes a node in, where it is among the nearest. Of equally near ones that with the lower number is nearer.
  bool offer(std::int32_t node, float distance);
  // (1 - d_k / reach)^2, normalised; reach: the last node's distance, or the given where there are fewer.
  std::array<double, blended> weights(double reach) const;
};

struct WarpNode {
  Eigen::Vector3d rest;      // in the canonical shape
  WarpBinding parents;       // nodes before it that carried it when it was added
  Eigen::Matrix3d rotation;  // about itself, from the canonical shape
  Eigen::Vector3d position;  // where it is
};

// Turns a node about itself, by less than is about linear, and shifts it.
void move(WarpNode& node, const Vector6& motion);
// How far along a direction the node takes a canonical point, by its motion.
Vector6 derivative(const WarpNode& node, const Eigen::Vector3d& canonical, const Eigen::Vector3d& direction);

// Where the first node expects the second, from there: 0 in a shape that only turned and moved.
struct WarpGap {
  Eigen::Vector3d gap;
  Eigen::Matrix<double, 3, 6> by_first;  // derivative by the first node's motion; by the second's shift it is -1
};
WarpGap gap_between(const WarpNode& first, const WarpNode& second);

struct WarpEdge {
  std::int32_t first, second;  // first < second
  bool operator<(const WarpEdge& other) const {
    return first != other.first ? first < other.first : second < other.second;
  }
  bool operator==(const WarpEdge& other) const { return first == other.first && second == other.second; }
};

// Where nodes were at a frame: rotations as quaternions (x, y, z, w), then positions.
using NodeStates = std::vector<std::array<float, 7>>;

struct WarpField {
  double node_spacing = 0.0;  // [m]
  std::vector<WarpNode> nodes;
  std::vector<WarpEdge> edges;        // in order
  std::vector<WarpBinding> bindings;  // of the model's points

  double reach() const;  // of a node, along the surface [m]
  // From the canonical shape to where its surroundings are.
  Eigen::Affine3d at(const WarpBinding& binding) const;

  NodeStates states() const;
  // The field as it was when so many of its nodes were there; what was added later was carried by its parents.
  WarpField as_of(const NodeStates& states) const;
  // Root mean square of the edges' change of length, against their length.
  double strain() const;
};

// Parts of the surface that share no nodes, as a thing and the wall behind it: of each node the first of its part.
std::vector<std::int32_t> parts_of(const WarpField& field);

// The rotation nearest to a blend of rotations.
Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& blend);

struct OrientedPoints {
  std::vector<Eigen::Vector3f> points, normals;
};

// Points of the canonical shape, those of the field's bindings, to where the field takes them.
OrientedPoints warped(const WarpField& field, const std::vector<Eigen::Vector3f>& points,
                      const std::vector<Eigen::Vector3f>& normals, int num_threads);

// One of them there and back.
struct OrientedPoint {
  Eigen::Vector3f point, normal;
};
OrientedPoint warped(const Eigen::Affine3d& motion, const OrientedPoint& canonical);
OrientedPoint unwarped(const Eigen::Affine3d& motion, const OrientedPoint& moved);

}  // namespace nacre
