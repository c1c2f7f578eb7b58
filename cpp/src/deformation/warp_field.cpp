#include "deformation/warp_field.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "base/disjoint_sets.hpp"
#include "base/parallel.hpp"
#include "base/se3.hpp"
#include "deformation/limits.hpp"

namespace nacre {
Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& blend) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(blend, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs = Eigen::Vector3d::Ones();
  signs.z() = svd.matrixU().determinant() * svd.matrixV().determinant() < 0.0 ? -1.0 : 1.0;
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

int WarpBinding::count() const { return static_cast<int>(std::find(nodes.begin(), nodes.end(), -1) - nodes.begin()); }

bool WarpBinding::offer(std::int32_t node, float distance) {
  const auto is_nearer = [&](int k) {
    const auto i = static_cast<std::size_t>(k);
    return distance < distances[i] || (distance == distances[i] && node < nodes[i]);
  };
  const int num_nodes = count();
  for (int k = 0; k < num_nodes; ++k) {
    if (nodes[static_cast<std::size_t>(k)] != node) continue;
    if (!is_nearer(k)) return false;
    std::copy(nodes.begin() + k + 1, nodes.end(), nodes.begin() + k);
    std::copy(distances.begin() + k + 1, distances.end(), distances.begin() + k);
    nodes.back() = -1;
    return offer(node, distance);
  }
  int place = num_nodes;
  while (place > 0 && is_nearer(place - 1)) --place;
  if (place == size) return false;
  std::copy_backward(nodes.begin() + place, nodes.end() - 1, nodes.end());
  std::copy_backward(distances.begin() + place, distances.end() - 1, distances.end());
  nodes[static_cast<std::size_t>(place)] = node;
  distances[static_cast<std::size_t>(place)] = distance;
  return true;
}

std::array<double, WarpBinding::blended> WarpBinding::weights(double reach) const {
  std::array<double, blended> result = {};
  const int num_nodes = count();
  if (num_nodes == size) reach = static_cast<double>(distances.back());
  double sum = 0.0;
  for (int k = 0; k < std::min(num_nodes, blended); ++k) {
    const double part = std::max(0.0, 1.0 - static_cast<double>(distances[static_cast<std::size_t>(k)]) / reach);
    sum += result[static_cast<std::size_t>(k)] = part * part;
  }
  if (!(sum > 0.0)) {
    result[0] = sum = 1.0;
  }
  for (double& weight : result) weight /= sum;
  return result;
}

std::vector<std::int32_t> parts_of(const WarpField& field) {
  DisjointSets sets(field.nodes.size());
  for (const WarpBinding& binding : field.bindings) {
    for (int k = 1; k < binding.num_blended(); ++k) {
      sets.join(binding.nodes[0], binding.nodes[static_cast<std::size_t>(k)]);
    }
  }
  std::vector<std::int32_t> first;
  for (std::size_t node = 0; node < field.nodes.size(); ++node) {
    first.push_back(sets.first_of(static_cast<std::int32_t>(node)));
  }
  return first;
}

void move(WarpNode& node, const Vector6& motion) {
  const Eigen::Vector3d axis = motion.head<3>();
  node.rotation =
      nearest_rotation(rotation(axis, std::min(axis.norm(), deformation_limits::largest_turn)) * node.rotation);
  node.position += motion.tail<3>();
}

Vector6 derivative(const WarpNode& node, const Eigen::Vector3d& canonical, const Eigen::Vector3d& direction) {
  Vector6 result;
  result << (node.rotation * (canonical - node.rest)).cross(direction), direction;
  return result;
}

WarpGap gap_between(const WarpNode& first, const WarpNode& second) {
  const Eigen::Vector3d expected = first.rotation * (second.rest - first.rest);
  WarpGap result;
  result.gap = expected + first.position - second.position;
  result.by_first << -cross_matrix(expected), Eigen::Matrix3d::Identity();
  return result;
}

double WarpField::reach() const { return deformation_limits::node_reach * node_spacing; }

Eigen::Affine3d WarpField::at(const WarpBinding& binding) const {
  const auto weights = binding.weights(reach());
  Eigen::Affine3d motion;
  motion.matrix().setZero();
  motion(3, 3) = 1.0;
  const int num_nodes = binding.num_blended();
  if (num_nodes == 0) return Eigen::Affine3d::Identity();
  for (int k = 0; k < num_nodes; ++k) {
    const WarpNode& node = nodes[static_cast<std::size_t>(binding.nodes[static_cast<std::size_t>(k)])];
    const double weight = weights[static_cast<std::size_t>(k)];
    motion.linear() += weight * node.rotation;
    motion.translation() += weight * (node.position - node.rotation * node.rest);
  }
  return motion;
}

NodeStates WarpField::states() const {
  NodeStates result;
  result.reserve(nodes.size());
  for (const WarpNode& node : nodes) {
    const Eigen::Quaterniond turn(node.rotation);
    const Eigen::Vector3d& place = node.position;
    const double values[7] = {turn.x(), turn.y(), turn.z(), turn.w(), place.x(), place.y(), place.z()};
    std::array<float, 7> state;
    std::transform(values, values + 7, state.begin(), [](double value) { return static_cast<float>(value); });
    result.push_back(state);
  }
  return result;
}

WarpField WarpField::as_of(const NodeStates& states) const {
  WarpField field = *this;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    WarpNode& node = field.nodes[i];
    if (i < states.size()) {
      const std::array<float, 7>& state = states[i];
      node.rotation =
          Eigen::Quaternionf(state[3], state[0], state[1], state[2]).cast<double>().normalized().toRotationMatrix();
      node.position = Eigen::Vector3f(state[4], state[5], state[6]).cast<double>();
    } else {
      const Eigen::Affine3d motion = field.at(node.parents);
      node.rotation = nearest_rotation(motion.linear());
      node.position = motion * node.rest;
    }
  }
  return field;
}

double WarpField::strain() const {
  double sum = 0.0;
  for (const WarpEdge& edge : edges) {
    const WarpNode& a = nodes[static_cast<std::size_t>(edge.first)];
    const WarpNode& b = nodes[static_cast<std::size_t>(edge.second)];
    const double length = (b.rest - a.rest).norm();
    const double change = length > 0.0 ? (b.position - a.position).norm() / length - 1.0 : 0.0;
    sum += change * change;
  }
  return edges.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(edges.size()));
}

OrientedPoint warped(const Eigen::Affine3d& motion, const OrientedPoint& canonical) {
  return {(motion * canonical.point.cast<double>()).cast<float>(),
          (motion.linear() * canonical.normal.cast<double>()).normalized().cast<float>()};
}

OrientedPoint unwarped(const Eigen::Affine3d& motion, const OrientedPoint& moved) {
  const Eigen::Matrix3d back = motion.linear().inverse();
  return {(back * (moved.point.cast<double>() - motion.translation())).cast<float>(),
          (back * moved.normal.cast<double>()).normalized().cast<float>()};
}

OrientedPoints warped(const WarpField& field, const std::vector<Eigen::Vector3f>& points,
                      const std::vector<Eigen::Vector3f>& normals, int num_threads) {
  constexpr std::int64_t block_size = 1024;
  OrientedPoints result{std::vector<Eigen::Vector3f>(points.size()), std::vector<Eigen::Vector3f>(points.size())};
  parallel_for(static_cast<std::int64_t>(points.size()), block_size, num_threads, [&](std::int64_t number) {
    const auto i = static_cast<std::size_t>(number);
    const OrientedPoint moved = warped(field.at(field.bindings[i]), {points[i], normals[i]});
    result.points[i] = moved.point;
    result.normals[i] = moved.normal;
  });
  return result;
}

}  // namespace nacre
