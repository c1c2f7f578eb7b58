// Numbers that decide which points are joined by triangles.
// Each line: [unit] kind: meaning; what guards it. Kinds: derived, budget, tuned; docs/numbers.md shows them all.
#pragma once

// clang-format off
namespace nacre::mesh_limits {

constexpr int most_neighbors = 20;  // [points] budget: that are asked for the triangles around a point; test_meshing
constexpr int spacing_neighbors = 6;  // [points] derived: around a point of an even surface: their mean distance is its spacing; test_triangulate
constexpr double largest_circle = 1.75;  // [spacing] tuned: radius of a triangle's circle through its corners: larger ones are gaps; test_meshing
constexpr double same_circle = 1e-4;  // [1] derived: of a squared distance: rounding of coordinates hides which of four points on a circle are nearer; test_meshing
constexpr double steepest = 1.5;  // [1] tuned: a neighbour rises at most so much above the tangent plane for its distance along it; test_meshing
constexpr int longest_hole = 10;  // [edges] budget: a hole with more is not closed; test_triangulate
constexpr double largest_filling = 3.0;  // [spacing] tuned: likewise as largest_circle, of the triangles that close a hole; test_triangulate
constexpr double least_turned = 0.2;  // [cosine] tuned: between a triangle that closes a hole and the normals of its corners; test_triangulate

constexpr int covering_neighbors = 64;  // [points] budget: of a point, that may cover it; test_on_surface
constexpr double covering_cosine = 0.5;  // [cosine] derived: between normals on one side of a surface: its layers bend alike within 60 degrees; test_on_surface
constexpr double least_layer = 0.5;  // [spacing] derived: layers that are nearer to each other are one: points in a tangent plane are a spacing apart; test_on_surface
constexpr double covering_width = 1.5;  // [spacing] derived: the ring of nearest neighbours in another layer lies within it; test_on_surface
constexpr int least_part = 30;  // [points] tuned: points that are joined with fewer are no surface; test_on_surface

}  // namespace nacre::mesh_limits
// clang-format on
