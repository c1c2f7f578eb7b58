// A camera that goes round a scene and is covered, carried off or deceived: it is lost and found, and loops close.
#include <string>

#include "meshes.hpp"
#include "nacre/simulation.hpp"
#include "options.hpp"

namespace {

using namespace nacre;
using nacre_test::quad;
using nacre_test::together;

// What befalls a frame, or the camera after it.
enum class Event { none, other_image, damaged_image, mask, guess, given_pose, saved, jump, back, other_distance };

struct Scene {
  explicit Scene(const Mesh& mesh, double distance_in, double height_in, bool is_object_in = false)
      : tree(mesh.vertices, mesh.triangles), distance(distance_in), height(height_in), is_object(is_object_in) {}

  // Around the origin, which it looks at; from the middle of a cave (distance 0), outwards.
  Pose camera(double angle, double farther) const {
    const Eigen::Vector3d out(std::sin(angle), 0.0, -std::cos(angle));
    const Eigen::Vector3d place = distance > 0.0 ? Eigen::Vector3d((1.0 + farther) * distance * out) : farther * out;
    const Eigen::Vector3d ahead =
        (distance > 0.0 ? Eigen::Vector3d(-height * Eigen::Vector3d::UnitY() - place) : out).normalized();
    const Eigen::Vector3d right = Eigen::Vector3d::UnitY().cross(-ahead).normalized();
    Pose pose = Pose::Identity();
    pose.linear() << right, ahead.cross(right), ahead;
    pose.translation() = place + height * Eigen::Vector3d::UnitY();
    return pose;
  }

  MeshTree tree;
  double distance, height;
  bool is_object;  // that stands on a plane
};

// Its wall is nowhere the same, so that each place can be told from the others.
Mesh cave() {
  constexpr int around = 60, rows = 20;
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<std::int32_t, 3>> triangles;
  for (int i = 0; i < around * rows; ++i) {
    const double a = 2.0 * static_cast<double>(EIGEN_PI) / around * (i / rows), y = 0.1 * (i % rows) - 0.95;
    const double radius = 1.0 + 0.12 * std::sin(5.0 * a + y) * std::cos(5.0 * y) + 0.1 * std::sin(3.0 * a - 7.0 * y);
    vertices.emplace_back(radius * std::sin(a), y, -radius * std::cos(a));
    if (i % rows == 0) continue;
    const int j = (i + rows) % (around * rows);
    triangles.push_back({i, i - 1, j});
    triangles.push_back({j, i - 1, j - 1});
  }
  return nacre_test::to_mesh(vertices, triangles);
}

// As the cave; it stands on the plane y = 0, 0.16 m high.
Mesh boulder() {
  Mesh mesh = nacre_test::sphere({0, 0, 0}, 1.0, 4);
  for (Eigen::Index i = 0; i < mesh.vertices.rows(); ++i) {
    const Eigen::Vector3f p = mesh.vertices.row(i);
    const float bump =
        std::sin(4.0F * p.x() + 1.0F) * std::cos(5.0F * p.y()) + 0.7F * std::sin(3.0F * p.z() - 4.0F * p.x());
    mesh.vertices.row(i) *= 0.07F + 0.015F * bump;
  }
  mesh.vertices.col(1).array() -= mesh.vertices.col(1).minCoeff();
  return mesh;
}

// The last three leave directions open, but for an edge.
const std::vector<Scene>& scenes() {
  static const std::vector<Scene> all = [] {
    std::vector<Scene> made;
    made.emplace_back(boulder(), 0.25, 0.1);
    made.emplace_back(together(boulder(), quad({-0.4, 0, -0.4}, {0, 0, 0.8}, {0.8, 0, 0})), 0.3, 0.2, true);
    made.emplace_back(cave(), 0.0, 0.0);
    made.emplace_back(
        together(quad({-2, -2, 0.2}, {4, 0, 0}, {0, 4, 0}), quad({-0.2, -0.1, 0}, {0.3, 0, 0}, {0, 2, 0})), 1.0, 0.0);
    made.emplace_back(nacre_test::sphere({0, 0, 0}, 0.1, 3), 0.3, 0.0);
    made.emplace_back(
        together(quad({-0.1, -1, 0}, {0.1, 0, 0.1}, {0, 2, 0}), quad({0, -1, 0.1}, {0.1, 0, -0.1}, {0, 2, 0})), 0.4,
        0.0);
    return made;
  }();
  return all;
}

DepthImage damaged(nacre_fuzz::Bytes& bytes, DepthImage depth) {
  switch (bytes.byte() % 4) {
    case 0:
      return DepthImage::Constant(depth.rows(), depth.cols(), bytes.coordinate());
    case 1:
      return depth * bytes.coordinate();
    case 2:
      depth.topRows(bytes.byte() % depth.rows()).setConstant(bytes.coordinate());
      return depth;
    default:
      depth.leftCols(bytes.byte() % depth.cols()).setConstant(bytes.coordinate());
      return depth;
  }
}

// By where the camera stands and looks, so that the colours of a place are those of its surface.
Colors colors_of(const DepthImage& depth, const Camera& camera, const Pose& pose) {
  Colors colors = Colors::Zero(depth.size(), 3);
  for (Eigen::Index i = 0; i < depth.size(); ++i) {
    const Ray ray = camera.ray(static_cast<int>(i % camera.width()), static_cast<int>(i / camera.width()));
    const Eigen::Vector3d point =
        pose * Eigen::Vector3d(static_cast<double>(depth.data()[i]) *
                               Eigen::Vector3d(ray.direction_x, ray.direction_y, ray.direction_z));
    if (point.allFinite() && point.norm() < 100.0) {
      colors.row(i).setConstant(static_cast<std::uint8_t>(128.0 + 100.0 * std::sin(30.0 * point.sum())));
    }
  }
  return colors;
}

}  // namespace

NACRE_FUZZ_TARGET(bytes) {
  const Scene& scene = scenes()[bytes.byte() % scenes().size()];
  const int width = 48 + bytes.byte() % 4 * 16, height = width * 3 / 4;
  const double focal = 1.2 * width, cx = 0.5 * width, cy = 0.5 * height;
  const Camera sees = Camera::pinhole(width, height, focal, focal, cx, cy);
  // What the model is told of the camera may be wrong: what it sees drifts.
  const double told = focal * (1.0 + bytes.raw<std::int8_t>() / 2048.0);
  const Camera camera = Camera::pinhole(width, height, told, told, cx, cy);
  const double step = 0.02 + bytes.byte() / 400.0;
  SimulationOptions simulation;
  simulation.noise.constant = bytes.byte() / 1e6;
  simulation.edge_mixing = bytes.byte() >= 192 ? 1.0 : 0.0;
  simulation.num_threads = 1;
  const bool has_colors = bytes.byte() >= 128;

  ModelOptions options;
  options.registration.max_samples = 1000;
  if (bytes.byte() >= 192) options = nacre_fuzz::model_options(bytes);
  options.region.object = scene.is_object;
  options.num_threads = 1;
  Model model(camera, options);
  double angle = 0.0, farther = 0.0;
  // Frames that are not tracked take ten times as long.
  const int num_frames = 1 + bytes.byte() % 80;
  int num_hard = 0;
  for (int index = 0; index < num_frames && num_hard < 8; ++index) {
    const Event event = bytes.byte() < 160 ? Event::none : bytes.one_of<Event>(10);
    const Pose pose = scene.camera(angle, farther);
    simulation.seed = static_cast<std::uint64_t>(index);
    DepthImage depth = simulate_depth(scene.tree, sees, pose, simulation);
    FrameExtras extras;
    if (has_colors) extras.colors = colors_of(depth, sees, pose);
    if (event == Event::other_image) depth = bytes.depth(camera);
    if (event == Event::damaged_image) depth = damaged(bytes, depth);
    if (event == Event::mask) extras.mask = bytes.mask(camera);
    extras.keep_guess = event == Event::given_pose;
    if (event == Event::guess || extras.keep_guess) extras.guess = scene.camera(0.0, 0.0).inverse() * pose;
    if (event == Event::saved) {
      const std::string saved = model.save();
      model = Model::load(saved);
      NACRE_HOLDS(model.save() == saved);
    }

    const std::size_t before = model.frames().size();
    const bool added = nacre_fuzz::runs([&] {
      const FrameReport report = model.add_frame(depth, extras);
      NACRE_HOLDS(report.world_from_camera.matrix().allFinite());
      NACRE_HOLDS((report.world_from_camera.linear() * report.world_from_camera.linear().transpose()).isIdentity(1e-6));
      NACRE_HOLDS(report.num_points == model.cloud().size());
      NACRE_HOLDS((report.status == FrameStatus::weak || report.status == FrameStatus::lost) == !report.reason.empty());
      num_hard += report.status == FrameStatus::tracked ? 0 : 1;
    });
    NACRE_HOLDS(model.frames().size() == before + (added ? 1 : 0));
    nacre_fuzz::check_cloud(model.cloud(), model.options());
    angle += event == Event::jump ? bytes.byte() / 40.0 : event == Event::back ? -step : step;
    if (event == Event::other_distance) farther = bytes.raw<std::int8_t>() / 512.0;
  }
}
