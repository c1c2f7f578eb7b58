#include "doctest/doctest.h"
#include "model/paper_loop.hpp"

using namespace nacre;

namespace {

// A square of side x side points in the plane z = 0, so far apart [m].
PointModel square(int side, float spacing) {
  PointModel model;
  for (int i = 0; i < side * side; ++i) {
    model.points.emplace_back(spacing * static_cast<float>(i % side), spacing * static_cast<float>(i / side), 0.0F);
    model.normals.emplace_back(0.0F, 0.0F, -1.0F);
  }
  const std::size_t size = model.points.size();
  model.confidence.assign(size, 1.0F);
  model.last_seen.assign(size, 0);
  model.observations.assign(size, 1);
  model.free_space_violations.assign(size, 0);
  return model;
}

}  // namespace

TEST_CASE("A point has a normal where k points are near, so the model's rims have none") {
  const ModelOptions options = ModelOptions::preset("paper");
  REQUIRE(options.wlop.normal_neighbors == 10);
  REQUIRE(options.wlop.normal_radius == 0.010);
  // 5 mm apart: inside, thirteen points are within 10 mm; at the rim nine, at a corner six.
  const PointModel model = square(10, 0.0049F);
  const Points normals = PaperLoop{options, 1}.model_normals(model);
  for (int i = 0; i < 100; ++i) {
    const bool is_rim = i % 10 == 0 || i % 10 == 9 || i < 10 || i >= 90;
    CHECK(normals.row(i).allFinite() == !is_rim);
    if (!is_rim) CHECK(normals(i, 2) == doctest::Approx(-1.0));  // on the side where the model's was
  }
}

TEST_CASE("Samples are half of the first view; then nine tenths of the model, and a fifth of it anew; 2000 at most") {
  const ModelOptions options = ModelOptions::preset("paper");
  const PaperLoop loop{options, 3};
  CHECK(loop.samples({}, square(20, 0.001F)).size() == 200);
  CHECK(loop.samples(square(10, 0.001F), square(20, 0.001F)).size() == 110);
  CHECK(loop.samples(square(44, 0.001F), square(60, 0.001F)).size() == 2000);
  CHECK(loop.samples(square(10, 0.001F), square(3, 0.001F)).size() == 99);
}

TEST_CASE("The choice of samples follows from the seed and the frame") {
  ModelOptions options = ModelOptions::preset("paper");
  const PointModel model = square(20, 0.001F);
  const auto chosen = [&](std::int32_t frame) { return PaperLoop{options, frame}.samples({}, model).points; };
  const std::vector<Eigen::Vector3f> first = chosen(0);
  CHECK(chosen(0) == first);
  CHECK(chosen(1) != first);
  options.wlop.seed = 1;
  CHECK(chosen(0) != first);
}
