#include <cmath>
#include <cstring>
#include <limits>
#include <set>

#include "base/random.hpp"
#include "doctest/doctest.h"
#include "nacre/consolidation.hpp"

using namespace nacre;

namespace {

constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();
const ConsolidationMethod all_methods[] = {ConsolidationMethod::wlop, ConsolidationMethod::wlop_plus,
                                           ConsolidationMethod::cgal};

Eigen::Vector3f random_direction(std::uint64_t i) {
  return Eigen::Vector3d(random_normal(1, 3 * i), random_normal(1, 3 * i + 1), random_normal(1, 3 * i + 2))
      .normalized()
      .cast<float>();
}

Points noisy_sphere(int count, double radius, double noise) {
  Points points(count, 3);
  for (int i = 0; i < count; ++i) {
    const auto counter = static_cast<std::uint64_t>(i);
    points.row(i) =
        static_cast<float>(radius + noise * random_normal(2, counter)) * random_direction(counter).transpose();
  }
  return points;
}

// Points of the plane z = 0 with noise, x and y in [0, size].
Points noisy_plane(int count, double size, double noise) {
  Points points(count, 3);
  for (int i = 0; i < count; ++i) {
    const auto counter = static_cast<std::uint64_t>(i);
    points.row(i) << static_cast<float>(size * random_uniform(3, 2 * counter)),
        static_cast<float>(size * random_uniform(3, 2 * counter + 1)),
        static_cast<float>(noise * random_normal(4, counter));
  }
  return points;
}

bool same_bits(const Points& a, const Points& b) {
  return a.rows() == b.rows() &&
         std::memcmp(a.data(), b.data(), static_cast<std::size_t>(a.size()) * sizeof(float)) == 0;
}

// Standard deviation over mean of the distance to the nearest other point.
double unevenness(const Points& points) {
  double sum = 0.0, sum_of_squares = 0.0;
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    float nearest = std::numeric_limits<float>::infinity();
    for (Eigen::Index j = 0; j < points.rows(); ++j) {
      if (j != i) nearest = std::min(nearest, (points.row(i) - points.row(j)).norm());
    }
    sum += nearest;
    sum_of_squares += nearest * nearest;
  }
  const double n = static_cast<double>(points.rows());
  return std::sqrt(sum_of_squares / n - sum * sum / (n * n)) / (sum / n);
}

}  // namespace

TEST_CASE("noise falls and evenness grows on a sphere and on a plane") {
  ConsolidateOptions options;
  options.num_points = 600;
  for (const auto method : {ConsolidationMethod::wlop_plus, ConsolidationMethod::cgal}) {
    options.method = method;
    options.radius = method == ConsolidationMethod::cgal ? 0.008 : 0.016;  // the same theta
    const double radius = 0.04, noise = 0.0005;
    const Points on_sphere = consolidate(noisy_sphere(6000, radius, noise), options).points;
    const Eigen::ArrayXd heights = on_sphere.rowwise().norm().cast<double>().array() - radius;
    CHECK(std::sqrt(heights.square().mean()) < 0.6 * noise);
    CHECK(std::abs(heights.mean()) < 0.5 * noise);
    CHECK(unevenness(on_sphere) < 0.25);  // a random choice has 0.52

    const Points on_plane = consolidate(noisy_plane(6000, 0.12, noise), options).points;
    CHECK(std::sqrt(on_plane.col(2).cast<double>().array().square().mean()) < 0.5 * noise);
  }
}

TEST_CASE("a sample among symmetric points does not move, a shifted one comes back") {
  Points points(8, 3);
  for (int i = 0; i < 8; ++i) {
    points.row(i) << static_cast<float>(i % 2) - 0.5F, static_cast<float>(i / 2 % 2) - 0.5F,
        static_cast<float>(i / 4) - 0.5F;
  }
  ConsolidateOptions options;
  options.radius = 4.0;
  Points samples(1, 3);
  for (const auto method : all_methods) {
    options.method = method;
    samples << 0.0F, 0.0F, 0.0F;
    CHECK(project_samples(samples, points, options).norm() < 1e-6F);
    samples << 0.1F, 0.05F, -0.1F;
    CHECK(project_samples(samples, points, options).norm() < 0.02F);
  }
}

TEST_CASE("the same bits for any number of threads") {
  Points points = noisy_sphere(3000, 0.05, 0.001);
  points.row(5).setConstant(not_a_number);
  Attributes attributes(points.rows(), 2);
  for (Eigen::Index i = 0; i < points.rows(); ++i) attributes.row(i) << points(i, 0), static_cast<float>(i);
  ConsolidateOptions options;
  options.num_points = 500;
  for (const auto method : all_methods) {
    options.method = method;
    options.num_threads = 1;
    const Consolidated one = consolidate(points, options, attributes);
    for (const int threads : {2, 3, 4, 7, 8}) {
      options.num_threads = threads;
      const Consolidated many = consolidate(points, options, attributes);
      CHECK(same_bits(one.points, many.points));
      CHECK(one.sources == many.sources);
      CHECK(one.attributes == many.attributes);
    }
  }
}

TEST_CASE("isolated samples, and samples that are not finite, stay; points that are not finite do not count") {
  Points points = noisy_plane(400, 0.05, 0.0002);
  const Points clean = points;
  points.conservativeResize(402, 3);
  points.row(400) << not_a_number, 0.0F, 0.0F;
  points.row(401) << 0.02F, std::numeric_limits<float>::infinity(), 0.0F;
  Points samples(3, 3);
  samples << 0.02F, 0.02F, 0.001F, 0.5F, 0.5F, 0.5F, not_a_number, 1.0F, 2.0F;
  ConsolidateOptions options;
  for (const auto method : all_methods) {
    options.method = method;
    const Points moved = project_samples(samples, points, options);
    CHECK(moved.row(0) != samples.row(0));
    CHECK(moved.row(1) == samples.row(1));
    CHECK(std::memcmp(moved.row(2).data(), samples.row(2).data(), 3 * sizeof(float)) == 0);
    CHECK(moved.row(0) == project_samples(samples, clean, options).row(0));
  }
}

TEST_CASE("empty sets") {
  const Points none(0, 3);
  CHECK(consolidate(none).points.rows() == 0);
  CHECK(consolidate(Points::Constant(3, 3, not_a_number)).sources.empty());
  CHECK(project_samples(none, noisy_plane(10, 1.0, 0.0)).rows() == 0);
  const Points samples = noisy_plane(10, 1.0, 0.0);
  CHECK(project_samples(samples, none) == samples);
}

TEST_CASE("the choice is without replacement, nested, of distinct places first, and clipped") {
  Points points = noisy_plane(300, 1.0, 0.1);
  points.bottomRows(100) = points.topRows(100);
  points.row(250).setConstant(not_a_number);
  ConsolidateOptions options;
  options.iterations = 0;
  options.num_points = 150;
  const Consolidated some = consolidate(points, options);
  const std::set<std::int64_t> sources(some.sources.begin(), some.sources.end());
  CHECK(sources.size() == 150);
  std::set<std::array<float, 3>> places;
  for (Eigen::Index i = 0; i < 150; ++i) {
    CHECK(some.points.row(i) == points.row(some.sources[static_cast<std::size_t>(i)]));
    places.insert({some.points(i, 0), some.points(i, 1), some.points(i, 2)});
  }
  CHECK(places.size() == 150);

  options.num_points = 180;
  const Consolidated more = consolidate(points, options);
  CHECK(std::includes(more.sources.begin(), more.sources.end(), some.sources.begin(), some.sources.end()));

  options.num_points = 100000;
  const Consolidated all = consolidate(points, options);
  CHECK(all.sources.size() == 299);
  CHECK(std::set<std::int64_t>(all.sources.begin(), all.sources.end()).size() == 299);

  options.num_points = 150;
  options.seed = 1;
  CHECK(consolidate(points, options).sources != some.sources);
}

TEST_CASE("attributes are weighted as positions: without repulsion, positions carried along equal the positions") {
  const Points points = noisy_sphere(1500, 0.03, 0.0005);
  Attributes attributes(points.rows(), 4);
  attributes.leftCols(3) = points;
  attributes.col(3).setConstant(2.5F);
  attributes(10, 0) = not_a_number;
  attributes.col(3).head(700).setConstant(not_a_number);
  ConsolidateOptions options;
  options.num_points = 200;
  options.mu = 0.0;
  for (const auto method : {ConsolidationMethod::wlop, ConsolidationMethod::cgal}) {
    options.method = method;
    const Consolidated result = consolidate(points, options, attributes);
    CHECK((result.attributes.col(1) - result.points.col(1)).cwiseAbs().maxCoeff() < 1e-6F);
    CHECK((result.attributes.col(2) - result.points.col(2)).cwiseAbs().maxCoeff() < 1e-6F);
    CHECK(result.attributes.col(0).allFinite());
    CHECK((result.attributes.col(3).array() == 2.5F).all());
  }
  options.iterations = 0;
  const Consolidated chosen = consolidate(points, options, attributes);
  CHECK(chosen.attributes.middleCols(1, 2) == chosen.points.rightCols(2));
}

TEST_CASE("wlop_plus: frozen samples stay and repel") {
  const Points points = noisy_plane(2000, 0.05, 0.0001);
  Points samples(2, 3);
  samples << 0.0250F, 0.025F, 0.0F, 0.0265F, 0.025F, 0.0F;
  ConsolidateOptions options;
  options.method = ConsolidationMethod::wlop_plus;
  ProjectionHints hints;
  hints.frozen = {1, 0};
  const Points moved = project_samples(samples, points, options, hints);
  CHECK(moved.row(0) == samples.row(0));
  CHECK(moved(1, 0) > samples(1, 0) + 0.0005F);
  const Points alone = project_samples(samples.bottomRows(1), points, options);
  CHECK(moved(1, 0) > alone(0, 0) + 0.0005F);
}

TEST_CASE("wlop_plus: samples repel each other along the surface only") {
  // Two layers of samples over a plane of points: nothing but the attraction moves them in height.
  const Points points = noisy_plane(4000, 0.05, 0.0);
  Points samples = noisy_plane(300, 0.05, 0.0005);
  ConsolidateOptions options;
  options.iterations = 1;
  options.method = ConsolidationMethod::wlop_plus;
  const Points moved = project_samples(samples, points, options);
  CHECK(moved.col(2).cwiseAbs().maxCoeff() < 1e-7F);

  ProjectionHints hints;
  hints.sample_normals = Points::Zero(samples.rows(), 3);
  CHECK(same_bits(project_samples(samples, points, options, hints), moved));
  hints.sample_normals.col(2).setConstant(-3.0F);
  CHECK((project_samples(samples, points, options, hints) - moved).cwiseAbs().maxCoeff() < 1e-7F);
  hints.sample_normals.col(2).setConstant(0.0F);
  hints.sample_normals.col(0).setConstant(1.0F);
  const Points sideways = project_samples(samples, points, options, hints);
  CHECK((sideways - moved).col(0).cwiseAbs().maxCoeff() > 1e-4F);
  CHECK(sideways.col(2).cwiseAbs().maxCoeff() > 1e-5F);
}

TEST_CASE("wlop_plus: a point of weight 3 is three points, a point of weight 0 is none") {
  const Points points = noisy_plane(300, 0.03, 0.0005);
  const Points samples = points.topRows(40);
  ConsolidateOptions options;
  options.method = ConsolidationMethod::wlop_plus;
  ProjectionHints hints;
  hints.point_weights = Values::Ones(300);
  hints.point_weights.head(50).setConstant(3.0F);
  hints.point_weights.tail(50).setZero();
  Points repeated(350, 3);
  repeated << points.topRows(250), points.topRows(50), points.topRows(50);
  const Points weighted = project_samples(samples, points, options, hints);
  CHECK((weighted - project_samples(samples, repeated, options)).cwiseAbs().maxCoeff() < 1e-6F);
  CHECK((weighted - project_samples(samples, points, options)).cwiseAbs().maxCoeff() > 1e-5F);
}

TEST_CASE("wlop_plus: no step is longer than a quarter of the radius") {
  const Points points = noisy_plane(500, 0.05, 0.0);
  Points samples(1, 3);
  samples << 0.025F, 0.025F, 0.007F;
  ConsolidateOptions options;
  options.method = ConsolidationMethod::wlop_plus;
  options.iterations = 1;
  CHECK((project_samples(samples, points, options) - samples).norm() == doctest::Approx(0.002));
}

TEST_CASE("scale and shift do not matter") {
  const Points points = noisy_sphere(800, 0.03, 0.0005);
  ConsolidateOptions options;
  options.num_points = 100;
  for (const auto method : all_methods) {
    options.method = method;
    options.radius = 0.008;
    const Points moved = consolidate(points, options).points;
    options.radius = 0.008 * 1024.0;
    CHECK(same_bits(consolidate(points * 1024.0F, options).points, moved * 1024.0F));
    options.radius = 0.008;
    const Points shifted = consolidate((points.array() + 0.125F).matrix(), options).points;
    CHECK(((shifted.array() - 0.125F).matrix() - moved).cwiseAbs().maxCoeff() < 1e-5F);
  }
}

TEST_CASE("double precision keeps the digits of coordinates that are far away") {
  const PointsDouble points = noisy_sphere(1500, 0.03, 0.0005).cast<double>();
  const PointsDouble shifted = points.rowwise() + Eigen::RowVector3d(4.4e6, -1.2e6, 3.3e3);
  ConsolidateOptions options;
  options.num_points = 200;
  options.iterations = 2;
  for (const auto method : all_methods) {
    options.method = method;
    const ConsolidatedDouble near = consolidate(points, options), far = consolidate(shifted, options);
    CHECK(near.sources == far.sources);
    const PointsDouble back = far.points.rowwise() - Eigen::RowVector3d(4.4e6, -1.2e6, 3.3e3);
    CHECK((back - near.points).cwiseAbs().maxCoeff() < 1e-8);
    const Points single = consolidate(points.cast<float>(), options).points;
    CHECK((single.cast<double>() - near.points).cwiseAbs().maxCoeff() < 1e-7);
  }
}

TEST_CASE("samples stay with their digits among strays") {
  Points points = noisy_sphere(3000, 0.03, 0.0005);
  ConsolidateOptions options;
  options.iterations = 2;
  const Points samples = points.topRows(100);
  const Points moved = project_samples(samples, points, options);
  points.conservativeResize(3002, 3);
  points.row(3000) << 1e9F, 1e9F, -1e9F;
  points.row(3001) << -1e30F, 1e9F, 0.0F;
  CHECK((project_samples(samples, points, options) - moved).cwiseAbs().maxCoeff() < 1e-7F);
}

TEST_CASE("coordinates beyond what the radius can measure do no harm") {
  for (const double size : {1e30, 3e38, 1e300}) {
    PointsDouble points(40, 3);
    for (int i = 0; i < 120; ++i) points.data()[i] = size * (random_uniform(7, static_cast<std::uint64_t>(i)) - 0.5);
    for (const ConsolidationMethod method : all_methods) {
      ConsolidateOptions options;
      options.method = method;
      options.radius = 1e-3;
      options.num_points = 20;
      if (size < 3e38) {
        CHECK(consolidate(points, options).points.rows() == 20);
        CHECK(consolidate(Points(points.cast<float>()), options).points.rows() == 20);
      } else {
        CHECK_THROWS_WITH_AS(consolidate(points, options), doctest::Contains("points must be within"),
                             std::invalid_argument);
      }
    }
  }
}

TEST_CASE("what is finite stays finite, or is refused") {
  int num_refused = 0;
  for (const double size : {1e15, 1e27, 1e33, 1e38, 1e45, 1e120}) {
    PointsDouble points(40, 3);
    for (int i = 0; i < 120; ++i) points.data()[i] = size * (random_uniform(5, static_cast<std::uint64_t>(i)) - 0.5);
    for (const double radius : {1e-12, 1.0, 1e12}) {
      for (const ConsolidationMethod method : all_methods) {
        for (const Theta theta : {Theta::huang, Theta::printed}) {
          ConsolidateOptions options;
          options.method = method;
          options.theta = theta;
          options.radius = radius;
          CAPTURE(size);
          CAPTURE(radius);
          try {
            const PointsDouble thinned = consolidate(points, options).points;
            const PointsDouble moved = project_samples(points, points, options);
            CHECK(thinned.allFinite());
            CHECK(moved.allFinite());
          } catch (const std::invalid_argument&) {
            ++num_refused;
          }
        }
      }
    }
  }
  CHECK(num_refused > 0);
  CHECK(num_refused < 80);
}

TEST_CASE("only the ratios of weights matter, however large they are") {
  const Points points = noisy_sphere(500, 0.03, 0.0005);
  ConsolidateOptions options;
  options.method = ConsolidationMethod::wlop_plus;
  ProjectionHints hints;
  hints.point_weights = Values::Ones(points.rows());
  hints.point_weights.head(100) *= 3.0F;
  const Points samples = points.topRows(60), moved = project_samples(samples, points, options, hints);
  CHECK(moved != samples);
  for (const float scale : {0x1p-120F, 0x1p126F}) {
    ProjectionHints scaled = hints;
    scaled.point_weights *= scale;
    CHECK(project_samples(samples, points, options, scaled) == moved);
  }
}

TEST_CASE("cgal: one neighbour alone does not repel, two do") {
  const Points points = noisy_plane(3000, 0.05, 0.0);
  ConsolidateOptions options;
  options.method = ConsolidationMethod::cgal;
  options.iterations = 1;
  Points samples(3, 3);
  samples << 0.0250F, 0.025F, 0.0F, 0.0265F, 0.025F, 0.0F, 0.0258F, 0.026F, 0.0F;
  const Points single = project_samples(samples.topRows(1), points, options);
  CHECK(project_samples(samples.topRows(2), points, options).row(0) == single.row(0));
  CHECK((project_samples(samples, points, options).row(0) - single.row(0)).norm() > 0.0003F);
}

TEST_CASE("misuse raises") {
  const Points points = noisy_plane(20, 1.0, 0.0);
  const auto with = [](auto change) {
    ConsolidateOptions options;
    change(options);
    return options;
  };
  CHECK_THROWS_AS(consolidate(points, with([](auto& o) { o.radius = 0.0; })), std::invalid_argument);
  CHECK_THROWS_AS(consolidate(points, with([](auto& o) { o.radius = not_a_number; })), std::invalid_argument);
  CHECK_THROWS_AS(consolidate(points, with([](auto& o) { o.num_points = 0; })), std::invalid_argument);
  CHECK_THROWS_AS(consolidate(points, with([](auto& o) { o.iterations = -1; })), std::invalid_argument);
  CHECK_THROWS_AS(consolidate(points, with([](auto& o) { o.mu = 0.6; })), std::invalid_argument);
  CHECK_THROWS_AS(consolidate(points, with([](auto& o) { o.num_threads = -1; })), std::invalid_argument);
  CHECK_THROWS_AS(consolidate(points, {}, Attributes::Zero(19, 1)), std::invalid_argument);

  const auto plus = with([](auto& o) { o.method = ConsolidationMethod::wlop_plus; });
  const auto hinted = [](auto change) {
    ProjectionHints hints;
    change(hints);
    return hints;
  };
  const auto one_weight = hinted([](auto& h) { h.point_weights = Values::Ones(1); });
  const auto bad_weight = hinted([](auto& h) { h.point_weights = Values::Constant(20, -1.0F); });
  const auto one_normal = hinted([](auto& h) { h.sample_normals = Points::Ones(1, 3); });
  const auto one_frozen = hinted([](auto& h) { h.frozen = {1}; });
  for (const auto& hints : {one_weight, bad_weight, one_normal, one_frozen}) {
    CHECK_THROWS_AS(project_samples(points, points, plus, hints), std::invalid_argument);
  }
  const auto weights = hinted([](auto& h) { h.point_weights = Values::Ones(20); });
  CHECK_THROWS_AS(project_samples(points, points, ConsolidateOptions(), weights), std::invalid_argument);
}
