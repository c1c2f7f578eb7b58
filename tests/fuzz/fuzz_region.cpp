// What of any frame belongs to a region.
#include "options.hpp"

NACRE_FUZZ_TARGET(bytes) {
  using namespace nacre;
  const Camera camera = bytes.camera();
  const DepthImage depth = bytes.depth(camera);
  const RegionOptions options = nacre_fuzz::region_options(bytes);
  const int threads = bytes.threads();
  Frame frame = make_frame(depth, camera, NoiseModel::kinect(), threads);
  RegionReport report;
  const MaskImage region = select_region(frame, camera, options, bytes.mask(camera), &report, threads);
  NACRE_HOLDS(region.rows() == camera.height() && region.cols() == camera.width());
  NACRE_HOLDS(report.support >= -1 && report.support < static_cast<int>(report.planes.size()));
  NACRE_HOLDS(report.num_inside >= 0 && report.num_outside >= 0);
  const std::size_t before = frame.valid.size();
  keep_region(region, frame);
  NACRE_HOLDS(frame.valid.size() <= before);
  for (const std::int32_t row : frame.valid) NACRE_HOLDS(region.data()[row] != 0);
}
