// Where flat surfaces end: found in depth images, and what they tell of a pose that shape leaves open.
#include <Eigen/Eigenvalues>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>

#include "base/numbers.hpp"
#include "base/random.hpp"
#include "doctest/doctest.h"
#include "nacre/model.hpp"
#include "outlines/occluding_edges.hpp"
#include "outlines/refinement.hpp"

using namespace nacre;

namespace {

constexpr float missing = std::numeric_limits<float>::quiet_NaN();
constexpr double pixel = 0.002, far_off = 0.6, noise = 0.0005;
const Camera camera = Camera::orthographic(200, 160, pixel);

// The height of a surface above the plane z = 0.6 m, over its own x and y; NaN where it ends.
using Shape = std::function<double(double x, double y)>;

double wall(double, double) { return 0.0; }
double strip(double, double y) { return std::abs(y) < 0.08 ? 0.0 : std::nan(""); }
double plate(double x, double y) { return std::hypot(x, y) < 0.09 ? 0.0 : std::nan(""); }
double square(double x, double y) { return std::abs(x) < 0.08 && std::abs(y) < 0.08 ? 0.0 : std::nan(""); }
double l_shape(double x, double y) {
  return std::abs(x) < 0.1 && std::abs(y) < 0.09 && !(x > -0.02 && y > -0.01) ? 0.0 : std::nan("");
}
double triangle(double x, double y) { return y > -0.09 && y < 0.09 - 1.8 * std::abs(x) ? 0.0 : std::nan(""); }
Shape ball(double radius) {
  return [=](double x, double y) { return std::sqrt(radius * radius - x * x - y * y); };
}
Shape cylinder(double radius) {
  return [=](double, double y) { return std::sqrt(radius * radius - y * y); };
}
double box_before_wall(double x, double y) { return std::isnan(square(x, y)) ? -0.3 : 0.0; }

// world_from_camera of a camera that turned and slid in the plane of its image.
Pose slid(double degrees, double x, double y) {
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::AngleAxisd(degrees * pi / 180.0, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  pose.translation() = Eigen::Vector3d(x, y, 0.0);
  return pose;
}

DepthImage view(const Shape& shape, const Pose& pose, std::uint64_t seed) {
  DepthImage depth(camera.height(), camera.width());
  for (int v = 0; v < camera.height(); ++v) {
    for (int u = 0; u < camera.width(); ++u) {
      const Ray ray = camera.ray(u, v);
      const Eigen::Vector3d at = pose * Eigen::Vector3d(ray.origin_x, ray.origin_y, 0.0);
      const double height = shape(at.x(), at.y());
      const auto index = static_cast<std::uint64_t>(v * camera.width() + u);
      depth(v, u) =
          std::isnan(height) ? missing : static_cast<float>(far_off - height + noise * random_normal(seed, index));
    }
  }
  return depth;
}

FrameReport second_frame(const Shape& first, const Shape& second, const Pose& pose, int num_threads = 1) {
  ModelOptions options;
  options.num_threads = num_threads;
  Model model(camera, options);
  model.add_frame(view(first, Pose::Identity(), 1));
  return model.add_frame(view(second, pose, 2));
}

double angle_of(const Pose& pose) { return Eigen::AngleAxisd(pose.linear()).angle() * 180.0 / pi; }

std::vector<OutlinePoint> outline_of(const Shape& shape) {
  const DepthImage depth = view(shape, Pose::Identity(), 1);
  DepthView view;
  view.depth = Eigen::Map<const Values>(depth.data(), depth.size());
  view.sigma = Values::Constant(depth.size(), static_cast<float>(noise));
  return find_outline(view, camera, 100000, 1);
}

// Pairs of surface points have found the origin; of a turn about the viewing axis they know little.
IcpResult found_by_shape(double roll_information) {
  IcpResult result;
  result.center = Eigen::Vector3d(0.0, 0.0, far_off);
  result.shape_information = 1e12 * Matrix6::Identity();
  result.shape_information(2, 2) = roll_information;
  return result;
}

// Of a camera that looks at the square from elsewhere.
std::vector<OutlinePoint> square_from(const Pose& pose) {
  std::vector<OutlinePoint> outline = outline_of(square);
  const Pose back = pose.inverse();
  for (OutlinePoint& edge : outline) {
    edge = {back * edge.point, back.linear() * edge.normal, back.linear() * edge.outward, edge.pixel};
  }
  return outline;
}

}  // namespace

TEST_CASE("the outline of a square lies on its sides and points away from it") {
  const auto outline = outline_of(square);
  CHECK(outline.size() > 250);  // of 4 x 80 pixels
  for (const OutlinePoint& edge : outline) {
    const double x = std::abs(edge.point.x()), y = std::abs(edge.point.y());
    if (std::min(x, y) < 0.06) CHECK(std::abs(std::max(x, y) - 0.08) < 0.6 * pixel);
    CHECK(std::abs(std::max(x, y) - 0.08) < 1.1 * pixel);
    CHECK(edge.normal.z() < -0.99);
    CHECK(edge.outward.dot(edge.point) > 0.0);
    if (std::min(x, y) < 0.06) CHECK((x > y ? std::abs(edge.outward.x()) : std::abs(edge.outward.y())) > 0.98);
    CHECK(edge.pixel == doctest::Approx(pixel).epsilon(0.1));
  }
}

TEST_CASE("an outline lies between what was kept and what is beyond, however much cleaning took") {
  DepthImage measured = view(square, Pose::Identity(), 1);
  DepthImage clean = measured;
  const auto index = [](double at, int count) { return static_cast<int>(std::lround(at / pixel + 0.5 * (count - 1))); };
  const int left = index(-0.08, camera.width()), right = index(0.08, camera.width()), removed = 3;
  for (int v = 0; v < camera.height(); ++v) {
    for (int u = 0; u < camera.width(); ++u) {
      if (u < left + removed || u > right - removed) clean(v, u) = missing;
    }
  }
  DepthView view;
  view.depth = Eigen::Map<const Values>(clean.data(), clean.size());
  view.sigma = Values::Constant(clean.size(), static_cast<float>(noise));
  for (const bool knows_measured : {false, true}) {
    CAPTURE(knows_measured);
    if (knows_measured) view.measured = Eigen::Map<const Values>(measured.data(), measured.size());
    double sum = 0.0;
    int count = 0;
    for (const OutlinePoint& edge : find_outline(view, camera, 100000, 1)) {
      if (std::abs(edge.point.y()) > 0.06) continue;
      sum += std::abs(edge.point.x()) - 0.08;
      ++count;
    }
    REQUIRE(count > 80);
    if (knows_measured) CHECK(std::abs(sum / count) < 0.55 * pixel);
    if (!knows_measured) CHECK(sum / count < -2.0 * pixel);
  }
}

TEST_CASE("a surface behind another does not end where it is hidden") {
  const auto outline = outline_of(box_before_wall);
  CHECK(outline.size() > 250);
  for (const OutlinePoint& edge : outline) CHECK(std::abs(edge.point.z() - far_off) < 0.01);
}

TEST_CASE("neither the image's border nor where a surface bends away is an outline") {
  CHECK(outline_of(wall).empty());
  CHECK(outline_of(strip).size() > 200);
  for (const double radius : {0.03, 0.05, 0.08, 0.12}) {
    CAPTURE(radius);
    CHECK(outline_of(ball(radius)).size() < 10);
    CHECK(outline_of(cylinder(radius)).size() < 10);
  }
}

TEST_CASE("a board that slides and turns in its plane is recovered to a fraction of a pixel") {
  for (const Pose& truth : {slid(1.5, 5.3 * pixel, 0.0), slid(4.0, -3.4 * pixel, 2.7 * pixel),
                            slid(10.0, 8.5 * pixel, -6.2 * pixel), slid(20.0, 22.4 * pixel, -9.2 * pixel)}) {
    const FrameReport report = second_frame(l_shape, l_shape, truth);
    CHECK(report.status == FrameStatus::tracked);
    CHECK(report.weak_directions.cols() == 0);
    const Pose off = truth.inverse() * report.world_from_camera;
    CHECK(off.translation().head<2>().norm() < 0.25 * pixel);
    CHECK(angle_of(off) < 0.25);
    // What it knows of the pose is finite in every direction.
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> eigen(report.information);
    CHECK(eigen.eigenvalues().minCoeff() > 0.0);
  }
}

TEST_CASE("a round plate leaves its own rotation open") {
  const Pose truth = slid(15.0, 4.3 * pixel, -2.6 * pixel);
  const FrameReport report = second_frame(plate, plate, truth);
  CHECK(report.status == FrameStatus::weak);
  REQUIRE(report.weak_directions.cols() == 1);
  CHECK(std::abs(report.weak_directions(2, 0)) > 0.95);  // about its normal
  // Its middle, at the world's origin, is known.
  const Eigen::Vector3d seen = truth.inverse() * Eigen::Vector3d(0.0, 0.0, far_off);
  CHECK((report.world_from_camera * seen).head<2>().norm() < 0.25 * pixel);
}

TEST_CASE("a strip across the image leaves the direction along it open") {
  const FrameReport report = second_frame(strip, strip, slid(0.0, 4.0 * pixel, 3.3 * pixel));
  CHECK(report.status == FrameStatus::weak);
  REQUIRE(report.weak_directions.cols() == 1);
  CHECK(std::abs(report.weak_directions(3, 0)) > 0.95);
  CHECK(std::abs(report.world_from_camera.translation().y() - 3.3 * pixel) < 0.5 * pixel);  // rows of pixels
}

TEST_CASE("where there are no outlines nothing more is known") {
  const Pose moved = slid(3.0, 4.0 * pixel, 2.0 * pixel);
  const FrameReport of_wall = second_frame(wall, wall, moved);
  CHECK(of_wall.status == FrameStatus::weak);
  CHECK(of_wall.weak_directions.cols() == 3);
  CHECK(of_wall.world_from_camera.translation().head<2>().norm() < 0.1 * pixel);  // as it was
  CHECK(second_frame(ball(0.1), ball(0.1), slid(5.0, 0.0, 0.0)).weak_directions.cols() == 3);
  CHECK(second_frame(cylinder(0.1), cylinder(0.1), slid(0.0, 4.0 * pixel, 0.0)).weak_directions.cols() == 2);
}

TEST_CASE("the outline of something else decides nothing") {
  const FrameReport report = second_frame(l_shape, triangle, Pose::Identity());
  CHECK(report.status != FrameStatus::tracked);
}

TEST_CASE("outlines give the same bits for any number of threads") {
  const Pose truth = slid(6.0, 5.0 * pixel, 3.0 * pixel);
  const FrameReport one = second_frame(l_shape, l_shape, truth, 1);
  for (const int num_threads : {2, 4}) {
    const FrameReport more = second_frame(l_shape, l_shape, truth, num_threads);
    CHECK(std::memcmp(one.world_from_camera.matrix().data(), more.world_from_camera.matrix().data(),
                      16 * sizeof(double)) == 0);
    CHECK(std::memcmp(one.information.data(), more.information.data(), 36 * sizeof(double)) == 0);
    CHECK(one.status == more.status);
  }
}

TEST_CASE("outlines add to what shape says: as much as it leaves open") {
  const Pose truth = slid(0.4, 0.0, 0.0);
  const auto refined = [&](double roll_information) {
    IcpResult result = found_by_shape(roll_information);
    refine_by_outlines(result, square_from(truth), {outline_of(square)}, 1);
    return result;
  };
  const IcpResult open = refined(1.0), certain = refined(1e12), between = refined(5e6);
  CHECK(angle_of(truth.inverse() * open.target_from_source) < 0.03);
  CHECK(open.information(2, 2) > 0.0);
  CHECK(angle_of(certain.target_from_source) < 0.01);
  CHECK(angle_of(between.target_from_source) > 0.1);
  CHECK(angle_of(between.target_from_source) < 0.3);
}

TEST_CASE("an outline as a whole is not believed more than half a pixel") {
  IcpResult result = found_by_shape(1.0);
  result.shape_information(0, 0) = result.shape_information(1, 1) = 1e12;
  const double sigma = 0.5 * pixel;
  result.shape_information(3, 3) = 30.0 / (sigma * sigma);  // shape knows it to half a pixel, too
  refine_by_outlines(result, square_from(slid(0.0, pixel, 0.0)), {outline_of(square)}, 1);
  CHECK(result.target_from_source.translation().x() == doctest::Approx(0.5 * pixel).epsilon(0.1));
}

TEST_CASE("outlines that do not lie on each other leave the pose as it is") {
  const auto smaller = [](double x, double y) { return square(x * 1.05, y * 1.05); };  // 2 pixels on each side
  IcpResult result = found_by_shape(1.0);
  refine_by_outlines(result, square_from(slid(0.4, 0.0, 0.0)), {outline_of(smaller)}, 1);
  CHECK(result.target_from_source.matrix() == Pose::Identity().matrix());
  CHECK(result.information == Matrix6::Zero());
  refine_by_outlines(result, square_from(slid(0.4, 0.0, 0.0)), {}, 1);
  refine_by_outlines(result, {}, {outline_of(square)}, 1);
  CHECK(result.target_from_source.matrix() == Pose::Identity().matrix());
}
