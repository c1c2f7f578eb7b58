#include "depth_images.hpp"
#include "doctest/doctest.h"
#include "region/coarse_frame.hpp"

using namespace nacre;
using namespace nacre_test;

TEST_CASE("what a camera shows moves by as many pixels as it turns or goes sideways") {
  const DepthImage wall = DepthImage::Constant(height, width, 2.0F);
  const CoarseFrame cells(make_frame(wall, pinhole, NoiseModel{0.001, 0.0}), pinhole, MaskImage());
  CHECK(mean_pixel_motion(cells, Pose::Identity()) == 0.0);

  Pose sideways = Pose::Identity();
  sideways.translation().x() = 0.04;
  CHECK(mean_pixel_motion(cells, sideways) == doctest::Approx(pinhole.fx() * 0.04 / 2.0).epsilon(0.1));

  Pose turned = Pose::Identity();
  turned.linear() = Eigen::AngleAxisd(0.02, Eigen::Vector3d::UnitY()).toRotationMatrix();
  CHECK(mean_pixel_motion(cells, turned) == doctest::Approx(pinhole.fx() * 0.02).epsilon(0.1));

  Pose forward = Pose::Identity();
  forward.translation().z() = 0.04;
  CHECK(mean_pixel_motion(cells, forward) < 0.5 * mean_pixel_motion(cells, sideways));
}

TEST_CASE("nothing in view has not moved") { CHECK(mean_pixel_motion(CoarseFrame(), Pose::Identity()) == 0.0); }
