// Frames fused into a model, from anywhere.
#include "options.hpp"

NACRE_FUZZ_TARGET(bytes) {
  using namespace nacre;
  const Camera camera = bytes.camera(32);
  const FusionOptions options = nacre_fuzz::fusion_options(bytes);
  double spacing = 0.01;
  bytes.change(spacing);
  const int threads = bytes.threads();
  PointModel model;
  for (int index = 0; index < 3; ++index) {
    const Frame frame = make_frame(bytes.depth(camera), camera, NoiseModel::kinect(), threads);
    Colors colors(0, 3);
    if (bytes.boolean()) colors = Colors::Constant(frame.points.rows(), 3, bytes.byte());
    std::vector<FrameAttribute> attributes;
    if (bytes.byte() >= 192) {
      attributes.push_back({bytes.boolean() ? "heat" : "",
                            Attributes::Constant(frame.points.rows(), bytes.integer(0, 3), bytes.coordinate())});
    }
    const FusionReport report =
        fuse(model, frame, camera, bytes.pose(), spacing, index, options, colors, threads, attributes);
    NACRE_HOLDS(report.num_updated >= 0 && report.num_inserted >= 0 && report.num_removed >= 0);
    const auto size = static_cast<std::size_t>(model.size());
    NACRE_HOLDS(model.normals.size() == size && model.confidence.size() == size && model.last_seen.size() == size);
    NACRE_HOLDS(model.observations.size() == size && model.free_space_violations.size() == size);
    NACRE_HOLDS(model.colors.empty() || model.colors.size() == size);
    for (const PointAttribute& attribute : model.attributes) {
      NACRE_HOLDS(attribute.values.size() == size * static_cast<std::size_t>(attribute.num_channels));
    }
    for (const Eigen::Vector3f& point : model.points) NACRE_HOLDS(point.allFinite());
  }
  const std::int64_t before = model.size();
  thin(model, bytes.boolean() ? 0.02 : bytes.number());
  NACRE_HOLDS(model.size() <= before);
  model.keep(std::vector<std::uint8_t>(static_cast<std::size_t>(model.size()), std::uint8_t{0}));
  NACRE_HOLDS(model.size() == 0);
}
