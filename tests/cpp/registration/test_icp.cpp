#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "base/random.hpp"
#include "doctest/doctest.h"
#include "nacre/registration.hpp"
#include "registration/correspondences.hpp"
#include "registration/icp.hpp"
#include "registration/icp_step.hpp"
#include "registration/limits.hpp"

using namespace nacre;

namespace {

constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();
const Metric all_metrics[] = {Metric::point_to_point, Metric::point_to_plane, Metric::symmetric};
const Metric plane_metrics[] = {Metric::point_to_plane, Metric::symmetric};

struct Cloud {
  Points points, normals;
  AlignCloud view() const { return AlignCloud(points, normals); }
};

// A closed surface without symmetry about (0, 0, 0.4), 0.1 m wide; another seed gives other points of it.
Cloud pebble(int count, std::uint64_t seed) {
  Cloud cloud{Points(count, 3), Points(count, 3)};
  for (int i = 0; i < count; ++i) {
    const auto c = static_cast<std::uint64_t>(3 * i);
    const Eigen::Vector3d u =
        Eigen::Vector3d(random_normal(seed, c), random_normal(seed, c + 1), random_normal(seed, c + 2)).normalized();
    // The surface |p| = r(u), whose normal is u - grad r / r for the gradient of r on the unit sphere.
    const Eigen::Vector3d a(0.7, 0.2, -0.4), b(-0.2, 0.8, 0.5), d(0.5, -0.4, 0.7);
    const double r = 0.05 * (1.0 + 0.5 * a.dot(u) + b.dot(u) * d.dot(u) + 0.5 * a.dot(u) * a.dot(u) * u.z());
    const Eigen::Vector3d gradient = 0.05 * (0.5 * a + b * d.dot(u) + d * b.dot(u) + a.dot(u) * u.z() * a +
                                             0.5 * a.dot(u) * a.dot(u) * Eigen::Vector3d::UnitZ());
    const Eigen::Vector3d tangential = gradient - gradient.dot(u) * u;
    cloud.points.row(i) = (r * u + Eigen::Vector3d(0.0, 0.0, 0.4)).cast<float>().transpose();
    cloud.normals.row(i) = (u - tangential / r).normalized().cast<float>().transpose();
  }
  return cloud;
}

Cloud moved(const Cloud& cloud, const Pose& pose) {
  Cloud result = cloud;
  for (Eigen::Index i = 0; i < cloud.points.rows(); ++i) {
    result.points.row(i) = (pose * cloud.points.row(i).transpose().cast<double>()).cast<float>().transpose();
    result.normals.row(i) = (pose.linear() * cloud.normals.row(i).transpose().cast<double>()).cast<float>().transpose();
  }
  return result;
}

// A turn about (0, 0, 0.4), then a shift.
Pose motion(const Eigen::Vector3d& rotation, const Eigen::Vector3d& shift) {
  const Eigen::Vector3d center(0.0, 0.0, 0.4);
  Pose pose = Pose::Identity();
  if (rotation.norm() > 0.0) {
    pose.linear() = Eigen::AngleAxisd(rotation.norm(), rotation.normalized()).toRotationMatrix();
  }
  pose.translation() = center - pose.linear() * center + shift;
  return pose;
}

const Pose truth = motion({0.1, -0.15, 0.05}, {0.004, -0.003, 0.005});

double angle_between(const Pose& a, const Pose& b) {
  return Eigen::AngleAxisd(a.linear().transpose() * b.linear()).angle();
}

double shift_between(const Pose& a, const Pose& b) {
  const Eigen::Vector3d center(0.0, 0.0, 0.4);
  return (a * center - b * center).norm();
}

bool same_bits(const AlignResult& a, const AlignResult& b) {
  return std::memcmp(a.target_from_source.matrix().data(), b.target_from_source.matrix().data(), 16 * sizeof(double)) ==
             0 &&
         std::memcmp(a.information.data(), b.information.data(), 36 * sizeof(double)) == 0 && a.rmse == b.rmse &&
         a.num_inliers == b.num_inliers && a.iterations == b.iterations && a.status == b.status;
}

std::vector<Pair> pairs_of(const Cloud& source, const Cloud& target, Metric metric) {
  std::vector<Pair> pairs;
  for (Eigen::Index i = 0; i < source.points.rows(); ++i) {
    Pair pair;
    pair.p = source.points.row(i).transpose().cast<double>();
    pair.q = target.points.row(i).transpose().cast<double>();
    pair.normal = target.normals.row(i).transpose().cast<double>();
    const Eigen::Vector3d other = source.normals.row(i).transpose().cast<double>();
    pair.half_difference = 0.5 * (other - pair.normal);
    if (metric == Metric::symmetric) pair.normal = 0.5 * (pair.normal + other);
    pair.weight = 1.0;
    pairs.push_back(pair);
  }
  return pairs;
}

}  // namespace

TEST_CASE("one step from true pairs: point_to_point is exact, symmetric nearly, point_to_plane to first order") {
  const Cloud target = pebble(2000, 1);
  for (const double size : {0.02, 0.2}) {
    const Pose pose = motion(size * Eigen::Vector3d(0.6, -0.64, 0.48), {0.0, 0.0, 0.0});
    const Cloud source = moved(target, pose.inverse());
    const auto error = [&](Metric metric) {
      return angle_between(solve_step(pairs_of(source, target, metric), metric, {}, {}, 1).motion, pose);
    };
    CHECK(error(Metric::point_to_point) < 1e-6);
    CHECK(error(Metric::symmetric) < 0.02 * size * size);
    CHECK(error(Metric::point_to_plane) < 2.0 * size * size);
    CHECK(error(Metric::point_to_plane) > error(Metric::symmetric));
  }
}

TEST_CASE("a step is a rigid motion, and says how far it moves the pairs") {
  const Cloud target = pebble(500, 1);
  for (const Metric metric : all_metrics) {
    const Cloud source = moved(target, motion({0, 0, 0}, {0.003, 0, 0}).inverse());
    const IcpStep step = solve_step(pairs_of(source, target, metric), metric, {0.01}, {}, 1);
    CHECK((step.motion.linear() * step.motion.linear().transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-12);
    CHECK(step.size == doctest::Approx(0.003).epsilon(0.01));
    CHECK(step.weak_directions.cols() == 0);
  }
  CHECK(solve_step({}, Metric::symmetric, {0.01}, {}, 1).motion.isApprox(Pose::Identity()));
}

TEST_CASE(
    "of a plane with noisy normals noise feigns what they tell; of another shape, or without noise, it does not") {
  const auto step_of = [](const Cloud& source, const Cloud& target, double least_signal) {
    return solve_step(pairs_of(source, target, Metric::symmetric), Metric::symmetric, {0.002, least_signal}, {}, 1);
  };
  const auto with_noise = [](Cloud cloud, std::uint64_t seed) {
    for (Eigen::Index i = 0; i < cloud.points.rows(); ++i) {
      for (int axis = 0; axis < 3; ++axis) {
        const auto counter = static_cast<std::uint64_t>(3 * i + axis);
        cloud.normals(i, axis) += static_cast<float>(0.2 * random_normal(seed, counter));
      }
      cloud.normals.row(i).normalize();
    }
    return cloud;
  };
  Cloud plane = pebble(2000, 1);
  plane.points.col(2).setConstant(0.4f);
  plane.normals.rowwise() = Eigen::RowVector3f(0.0f, 0.0f, -1.0f);
  const Cloud round = pebble(2000, 1);

  const IcpStep noisy = step_of(with_noise(plane, 2), with_noise(plane, 3), 1.0);
  CHECK(noisy.signal < 0.3);
  CHECK(noisy.weak_directions.cols() == 3);
  CHECK(step_of(plane, plane, 1.0).weak_directions.cols() == 3);
  CHECK(step_of(with_noise(round, 2), with_noise(round, 3), 1.0).weak_directions.cols() == 0);
  CHECK(step_of(round, round, 3.0).signal > 3.0);

  const Cloud shared = with_noise(plane, 2);  // which nothing tells from shape
  CHECK(step_of(shared, shared, 1.0).weak_directions.cols() == 0);
}

TEST_CASE("a direction of which something else tells more is weak, and held") {
  const Cloud target = pebble(2000, 1);
  const Cloud source = moved(target, motion({0, 0, 0}, {0.003, 0.002, 0}).inverse());
  WeakTest test{0.002};
  test.told_otherwise(4, 4) = 100.0;  // of a shift along y
  const IcpStep step =
      solve_step(pairs_of(source, target, Metric::point_to_plane), Metric::point_to_plane, test, {}, 1);
  REQUIRE(step.weak_directions.cols() > 0);
  const Vector6 along_y = Vector6::Unit(4);
  CHECK((step.weak_directions.transpose() * along_y).norm() > 0.9);
  test.told_otherwise(4, 4) = 1e-6;
  CHECK(solve_step(pairs_of(source, target, Metric::point_to_plane), Metric::point_to_plane, test, {}, 1)
            .weak_directions.cols() == 0);
}

TEST_CASE("independent residuals count as one each, shared ones as one together") {
  const std::size_t cells = 500, cell = registration_limits::cell_pairs;
  std::vector<double> independent, shared;
  for (std::size_t i = 0; i < cells * cell; ++i) {
    independent.push_back(random_normal(1, i));
    shared.push_back(random_normal(2, i / cell));
  }
  CHECK(design_effect(independent) == doctest::Approx(1.0).epsilon(0.15));
  CHECK(design_effect(shared) == doctest::Approx(static_cast<double>(cell)));
  CHECK(design_effect({}) == 1.0);
}

TEST_CASE("the hessian is the second derivative of half the squared residuals") {
  const Cloud target = pebble(300, 1);
  const std::vector<Pair> pairs = pairs_of(target, target, Metric::point_to_plane);
  const IcpStep step = solve_step(pairs, Metric::point_to_plane, {0.01}, {}, 1);
  const auto cost = [&](const Vector6& twist) {
    double sum = 0.0;
    for (const Pair& pair : pairs) {
      const Eigen::Vector3d turn = twist.head<3>(), shift = twist.tail<3>();
      const Eigen::Vector3d p = pair.p + turn.cross(pair.p - step.center) + shift;
      sum += 0.5 * std::pow((p - pair.q).dot(pair.normal), 2);
    }
    return sum;
  };
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j <= i; ++j) {
      const double h = 1e-3;
      const Vector6 a = h * Vector6::Unit(i), b = h * Vector6::Unit(j);
      const double second = (cost(a + b) - cost(a - b) - cost(b - a) + cost(-a - b)) / (4.0 * h * h);
      CHECK(step.hessian(i, j) == doctest::Approx(second).epsilon(1e-6).scale(1e-3));
      CHECK(step.hessian(i, j) == step.hessian(j, i));
    }
  }
}

TEST_CASE("known motions are found") {
  const Cloud target = pebble(3000, 1);
  for (const Metric metric : all_metrics) {
    for (const bool with_normals : {true, false}) {
      const Cloud source = moved(target, truth.inverse());
      AlignOptions options;
      options.method = metric;
      options.max_iterations = 200;
      const AlignResult result =
          with_normals ? align(source.view(), target.view(), Pose::Identity(), options)
                       : align(AlignCloud(source.points), AlignCloud(target.points), Pose::Identity(), options);
      CAPTURE(static_cast<int>(metric));
      CAPTURE(with_normals);
      CHECK(result.converged());
      CHECK(angle_between(result.target_from_source, truth) < 1e-5);
      CHECK(shift_between(result.target_from_source, truth) < 1e-6);
      CHECK(result.overlap > 0.98);
    }
  }
}

TEST_CASE("other points of the same surface") {
  const Cloud target = pebble(4000, 1), source = moved(pebble(3000, 2), truth.inverse());
  const AlignResult result = align(source.view(), target.view());
  CHECK(result.converged());
  CHECK(angle_between(result.target_from_source, truth) < 1e-3);
  CHECK(shift_between(result.target_from_source, truth) < 2e-5);
  CHECK(result.weak_directions.cols() == 0);
  CHECK((result.center - Eigen::Vector3d(0.0, 0.0, 0.4)).norm() < 0.02);
}

TEST_CASE("results have the same bits for any number of threads") {
  const Cloud target = pebble(1500, 1), source = moved(pebble(1500, 2), truth.inverse());
  for (const Metric metric : all_metrics) {
    AlignOptions options;
    options.method = metric;
    const auto with_normals = [&](int num_threads) {
      options.num_threads = num_threads;
      return align(source.view(), target.view(), Pose::Identity(), options);
    };
    const auto without_normals = [&](int num_threads) {
      options.num_threads = num_threads;
      return align(AlignCloud(source.points), AlignCloud(target.points), Pose::Identity(), options);
    };
    const AlignResult expected = with_normals(1), bare = without_normals(1);
    for (const int num_threads : {0, 2, 3, 4, 7, 8}) {
      CHECK(same_bits(with_normals(num_threads), expected));
      CHECK(same_bits(without_normals(num_threads), bare));
    }
  }
}

TEST_CASE("directions that the data does not determine keep their initial value") {
  const auto flat = [](std::uint64_t seed) {
    Cloud cloud{Points(2000, 3), Points(2000, 3)};
    for (int i = 0; i < 2000; ++i) {
      const auto c = static_cast<std::uint64_t>(2 * i);
      cloud.points.row(i) << static_cast<float>(0.2 * random_uniform(seed, c) - 0.1),
          static_cast<float>(0.2 * random_uniform(seed, c + 1) - 0.1), 0.4F;
      cloud.normals.row(i) << 0.0F, 0.0F, -1.0F;
    }
    return cloud;
  };
  const Cloud target = flat(1), source = flat(2);
  const Pose initial = motion({0.03, -0.02, 0.05}, {0.004, -0.006, 0.003});
  for (const Metric metric : plane_metrics) {
    AlignOptions options;
    options.method = metric;
    const AlignResult result = align(source.view(), target.view(), initial, options);
    REQUIRE(result.weak_directions.cols() == 3);
    // Turns about x and y and shifts along z are determined: no weak direction has a part in them.
    for (const int row : {0, 1, 5}) CHECK(result.weak_directions.row(row).norm() < 0.01);
    CHECK((result.weak_directions.transpose() * result.weak_directions - Eigen::Matrix3d::Identity()).norm() < 1e-9);
    const Eigen::Vector3d moved_center = result.target_from_source * Eigen::Vector3d(0.0, 0.0, 0.4);
    CHECK((moved_center - Eigen::Vector3d(0.004, -0.006, 0.4)).norm() < 3e-4);
    CHECK((result.target_from_source.linear() * Eigen::Vector3d::UnitZ()).z() == doctest::Approx(1.0).epsilon(1e-6));
    CHECK(std::atan2(result.target_from_source.linear()(1, 0), result.target_from_source.linear()(0, 0)) ==
          doctest::Approx(0.05).epsilon(0.02));
  }
}

TEST_CASE("data that allows no answer is never called converged") {
  const Cloud good = pebble(500, 1);
  Cloud far = good, holes = good;
  far.points.col(0).array() += 100.0F;
  holes.points.setConstant(not_a_number);
  const Cloud nothing{Points(0, 3), Points(0, 3)};
  const Cloud one{good.points.topRows(1), good.normals.topRows(1)};
  const Pose initial = motion({0.1, 0.2, 0.3}, {0.1, 0.2, 0.3});
  const Cloud* const clouds[] = {&far, &holes, &nothing, &one};
  for (const Metric metric : all_metrics) {
    AlignOptions options;
    options.method = metric;
    for (const Cloud* other : clouds) {
      for (const bool swapped : {false, true}) {
        const AlignResult result = swapped ? align(good.view(), other->view(), initial, options)
                                           : align(other->view(), good.view(), initial, options);
        CHECK(result.status == AlignStatus::too_few_pairs);
        CHECK_FALSE(result.converged());
        CHECK(result.target_from_source.matrix() == initial.matrix());
        CHECK(result.num_inliers == 0);
        CHECK(result.overlap == 0.0);
        CHECK(std::isnan(result.rmse));
        CHECK(result.information.norm() == 0.0);
      }
    }
  }
  CHECK(std::string(to_string(AlignStatus::too_few_pairs)) == "too_few_pairs");
  CHECK(std::string(to_string(AlignStatus::max_iterations)) == "max_iterations");
  CHECK(std::string(to_string(AlignStatus::converged)) == "converged");
}

TEST_CASE("rows that are not finite are never matched") {
  Cloud target = pebble(2000, 1), source = moved(pebble(1500, 2), truth.inverse());
  for (Eigen::Index i = 0; i < 1500; i += 5) source.points(i, i % 3) = not_a_number;
  for (Eigen::Index i = 0; i < 1500; i += 7) source.normals(i, i % 3) = std::numeric_limits<float>::infinity();
  for (Eigen::Index i = 0; i < 2000; i += 5) target.points(i, i % 3) = not_a_number;
  for (Eigen::Index i = 0; i < 2000; i += 6) target.normals(i, i % 3) = not_a_number;
  const AlignResult result = align(source.view(), target.view());
  CHECK(result.converged());
  CHECK(angle_between(result.target_from_source, truth) < 2e-3);
  CHECK(result.num_inliers <= 1500 * 4 / 5);
}

TEST_CASE("matches are the nearest points, whatever was matched before") {
  const Cloud target = pebble(800, 1), source = pebble(600, 2);
  AlignOptions options;
  const IcpTarget icp_target(target.view(), options);
  const IcpSource icp_source(source.view(), options);
  std::vector<std::uint32_t> nearest(600, no_slot);
  for (const double size : {0.3, 0.1, 0.0}) {
    const Pose pose = motion({size, 0.0, -size}, {0.0, 0.02 * size, 0.0});
    const std::vector<Pair> pairs = icp_target.match(icp_source, 600, pose, Gate{1.0, -2.0, false}, nearest);
    REQUIRE(pairs.size() == 600);
    for (const Pair& pair : pairs) {
      const double least = (target.points.cast<double>().rowwise() - pair.p.transpose()).rowwise().norm().minCoeff();
      CHECK((pair.p - pair.q).norm() == doctest::Approx(least).epsilon(1e-9));
    }
  }
}

TEST_CASE("options out of range are named") {
  const Cloud cloud = pebble(100, 1);
  const auto message = [&](auto&& change) {
    AlignOptions options;
    change(options);
    try {
      align(cloud.view(), cloud.view(), Pose::Identity(), options);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string("nothing thrown");
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(message([](AlignOptions& o) { o.max_iterations = 0; }).rfind("max_iterations must be", 0) == 0);
  CHECK(message([](AlignOptions& o) { o.max_distance = -1.0; }).rfind("max_distance must be", 0) == 0);
  CHECK(message([&](AlignOptions& o) { o.max_distance = nan; }).rfind("max_distance must be", 0) == 0);
  CHECK(message([&](AlignOptions& o) { o.final_distance = nan; }).rfind("final_distance must be", 0) == 0);
  CHECK(message([](AlignOptions& o) { o.gate_decay = 1.1; }).rfind("gate_decay must be", 0) == 0);
  CHECK(message([](AlignOptions& o) { o.max_angle = 0.0; }).rfind("max_angle must be", 0) == 0);
  CHECK(message([](AlignOptions& o) { o.sample_fraction = 0.0; }).rfind("sample_fraction must be", 0) == 0);
  CHECK(message([](AlignOptions& o) { o.max_samples = -1; }).rfind("max_samples must be", 0) == 0);
  CHECK(message([](AlignOptions& o) { o.coarse_samples = -1; }).rfind("coarse_samples must be", 0) == 0);
  CHECK(message([&](AlignOptions& o) { o.weak_threshold = nan; }).rfind("weak_threshold must be", 0) == 0);
  CHECK(message([](AlignOptions& o) { o.num_threads = -1; }).rfind("num_threads must be", 0) == 0);
  CHECK_THROWS_WITH(AlignCloud(cloud.points, cloud.normals.topRows(7)), doctest::Contains("normals must be"));
  CHECK_THROWS_WITH(AlignCloud(cloud.points, Points(), Values::Ones(3)), doctest::Contains("sigma must be"));
}
