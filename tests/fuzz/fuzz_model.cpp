// The whole loop: any frames with any extras, and the model holds together.
#include "options.hpp"

namespace {

using namespace nacre;

ModelOptions model_options(nacre_fuzz::Bytes& bytes) {
  ModelOptions options = bytes.byte() >= 192 ? ModelOptions::preset("paper") : ModelOptions();
  if (bytes.byte() >= 128) {
    options.depth = nacre_fuzz::depth_options(bytes);
    options.region = nacre_fuzz::region_options(bytes);
    options.registration = nacre_fuzz::align_options(bytes);
    options.fusion = nacre_fuzz::fusion_options(bytes);
    options.consolidation = nacre_fuzz::consolidate_options(bytes);
  }
  bytes.change_to(options.fold_in, 3);
  bytes.change(options.region.object), bytes.change(options.spacing), bytes.change(options.max_points, -1, 400);
  bytes.change(options.predict_motion), bytes.change(options.relocalise), bytes.change(options.loop_closure);
  bytes.change(options.denoise_samples), bytes.change(options.verify), bytes.change(options.min_evidence);
  bytes.change(options.first_fraction), bytes.change(options.kept_fraction), bytes.change(options.new_fraction);
  options.num_threads = bytes.threads();
  return options;
}

void check_cloud(const PointModel& cloud, const ModelOptions& options) {
  NACRE_HOLDS(cloud.size() <= options.max_points);
  NACRE_HOLDS(cloud.normals.size() == cloud.points.size());
  NACRE_HOLDS(cloud.colors.empty() || cloud.colors.size() == cloud.points.size());
  for (const Eigen::Vector3f& point : cloud.points) NACRE_HOLDS(point.allFinite());
}

}  // namespace

NACRE_FUZZ_TARGET(bytes) {
  const Camera camera = bytes.camera(32);
  Model model(camera, model_options(bytes));
  DepthImage depth;
  const int num_frames = 1 + bytes.byte() % 6;
  for (int index = 0; index < num_frames; ++index) {
    if (index == 0 || bytes.boolean()) depth = bytes.depth(camera);
    FrameExtras extras;
    const int kind = bytes.byte();
    if ((kind & 1) != 0) extras.colors = Colors::Constant(depth.size(), 3, bytes.byte());
    if ((kind & 2) != 0) {
      extras.attributes.push_back(
          {"heat", Attributes::Constant(depth.size(), 1 + bytes.byte() % 2, bytes.coordinate())});
    }
    if ((kind & 4) != 0) extras.mask = bytes.mask(camera);
    if ((kind & 8) != 0) extras.guess = bytes.pose();
    if ((kind & 16) != 0) extras.timestamp = bytes.number();
    extras.keep_guess = (kind & 32) != 0;
    const std::size_t before = model.frames().size();
    const bool added = nacre_fuzz::runs([&] {
      const FrameReport report = model.add_frame(depth, extras);
      NACRE_HOLDS(report.world_from_camera.matrix().allFinite());
      NACRE_HOLDS(report.num_points == model.cloud().size());
      NACRE_HOLDS((report.status == FrameStatus::weak || report.status == FrameStatus::lost) == !report.reason.empty());
    });
    NACRE_HOLDS(model.frames().size() == before + (added ? 1 : 0));
    check_cloud(model.cloud(), model.options());
  }
  check_cloud(model.cloud_in_camera(), model.options());
}
