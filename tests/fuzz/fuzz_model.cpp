// The whole loop: any frames with any extras, and the model holds together.
#include "options.hpp"

using namespace nacre;

NACRE_FUZZ_TARGET(bytes) {
  const Camera camera = bytes.camera(32);
  Model model(camera, nacre_fuzz::model_options(bytes));
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
    nacre_fuzz::check_cloud(model.cloud(), model.options());
  }
  nacre_fuzz::check_cloud(model.cloud_in_camera(), model.options());
}
