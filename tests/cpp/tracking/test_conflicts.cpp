#include <cmath>

#include "depth_images.hpp"
#include "doctest/doctest.h"
#include "tracking/conflicts.hpp"
#include "tracking/limits.hpp"

using namespace nacre;
using namespace nacre_test;

namespace {

constexpr double margin = 0.01;

// Of a wall two metres away, and a board before it, a metre away, from one column of the image to another.
DepthView wall_with_board(int first, int last) {
  DepthImage depth = DepthImage::Constant(height, width, 2.0F);
  for (int u = first; u < last; ++u) depth.col(u).setConstant(1.0F);
  DepthView view;
  view.depth = Eigen::Map<const Values>(depth.data(), depth.size());
  view.sigma = Values::Constant(depth.size(), 0.001F);
  return view;
}

}  // namespace

TEST_CASE("a board that moved hides what was seen on its one side, and uncovers as much on its other") {
  const DepthView before = wall_with_board(30, 60), now = wall_with_board(34, 64);
  const Points hides = seen_through(now, before, pinhole, margin);
  const Points uncovers = seen_through(before, now, pinhole, margin);
  REQUIRE(hides.rows() > 0);
  CHECK(hides.rows() == uncovers.rows());
  const auto column = [](float x) { return pinhole.fx() * static_cast<double>(x) + pinhole.cx(); };  // a metre away
  for (Eigen::Index i = 0; i < hides.rows(); ++i) {
    CHECK(hides(i, 2) == 1.0F);
    CHECK(std::round(column(hides(i, 0))) >= 60);
    CHECK(std::round(column(uncovers(i, 0))) < 34);
  }
  CHECK(seen_through(before, before, pinhole, margin).rows() == 0);
}

TEST_CASE("where conflicts crowd their surroundings are left out, as large as they are far") {
  const int crowd = tracking_limits::least_conflicts;
  const auto reach = static_cast<float>(tracking_limits::conflict_reach);
  Points conflicts(crowd + 1, 3);
  conflicts.topRows(crowd).rowwise() = Eigen::RowVector3f(0.1F, 0.1F, 2.0F);
  conflicts.bottomRows(1) << 1.1F, 0.1F, 2.0F;  // alone
  const ConflictZones zones(conflicts, Eigen::Vector3d::Zero());
  CHECK(zones.include({0.1F, 0.1F, 2.0F}));
  CHECK(zones.include({0.1F, 0.1F, 2.0F + 1.9F * reach}));
  CHECK(!zones.include({0.1F, 0.1F, 2.0F + 2.1F * reach}));
  CHECK(!zones.include({1.1F, 0.1F, 2.0F}));
  CHECK(ConflictZones(conflicts.bottomRows(1), Eigen::Vector3d::Zero()).empty());
  CHECK(ConflictZones(Points(0, 3), Eigen::Vector3d::Zero()).empty());
}
