// Rays into any mesh, and points near it.
#include "bytes.hpp"
#include "nacre/mesh.hpp"

NACRE_FUZZ_TARGET(bytes) {
  using namespace nacre;
  const Points vertices = bytes.points(80);
  Triangles triangles(bytes.integer(0, 120), 3);
  for (Eigen::Index i = 0; i < triangles.size(); ++i) {
    triangles.data()[i] = bytes.byte() % std::max(1, static_cast<int>(vertices.rows()));
  }
  if (bytes.byte() >= 240 && triangles.size() > 0) triangles(0, 0) = bytes.raw<std::int32_t>();
  const MeshTree tree(vertices, triangles);

  const PointsDouble origins = bytes.rows<PointsDouble>(20);
  PointsDouble directions = bytes.rows<PointsDouble>(20);
  if (bytes.byte() < 250) directions.conservativeResize(origins.rows(), 3);
  const MeshTree::Hits hits = tree.cast(origins, directions, bytes.threads());
  for (Eigen::Index i = 0; i < hits.distances.size(); ++i) {
    NACRE_HOLDS(hits.triangles[i] >= -1 && hits.triangles[i] < triangles.rows());
    NACRE_HOLDS(std::isnan(hits.distances[i]) == (hits.triangles[i] < 0) && !(hits.distances[i] < 0.0));
  }
  const MeshTree::ClosestPoints closest = tree.closest(origins, bytes.threads());
  for (Eigen::Index i = 0; i < closest.distances.size(); ++i) {
    const bool is_near = origins.row(i).squaredNorm() < 1e300;
    NACRE_HOLDS(closest.triangles[i] >= 0 ? origins.row(i).allFinite() : !is_near);
    NACRE_HOLDS(std::isfinite(closest.distances[i]) == (closest.triangles[i] >= 0));
    NACRE_HOLDS(closest.triangles[i] < triangles.rows());
  }
  for (std::int32_t i = 0; i < triangles.rows(); ++i) {
    const double length = tree.normal(i).norm();
    NACRE_HOLDS(length == 0.0 || std::abs(length - 1.0) < 1e-9);
  }
}
