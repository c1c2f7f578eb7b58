// Points and normals of any image, cleaned or not; its noise.
#include "options.hpp"

NACRE_FUZZ_TARGET(bytes) {
  using namespace nacre;
  const Camera camera = bytes.camera();
  const DepthImage depth = bytes.depth(camera);
  const int threads = bytes.threads();
  std::optional<NoiseModel> noise;
  if (bytes.boolean()) noise = nacre_fuzz::noise_model(bytes);

  Frame frame;
  if (bytes.boolean()) make_frame(bytes.depth(camera), camera, noise, threads, frame);  // memory that is used again
  make_frame(depth, camera, noise, threads, frame);
  NACRE_HOLDS(frame.width == camera.width() && frame.height == camera.height());
  const Eigen::Index count = depth.size();
  NACRE_HOLDS(frame.points.rows() == count && frame.normals.rows() == count && frame.sigma.size() == count);
  std::int32_t last = -1;
  for (const std::int32_t row : frame.valid) {
    NACRE_HOLDS(row > last && row < count);
    NACRE_HOLDS(frame.points.row(row).allFinite());
    NACRE_HOLDS(std::abs(frame.normals.row(row).norm() - 1.0F) < 1e-3F);
    last = row;
  }
  const Points normals = depth_normals(depth, camera, noise, threads);
  NACRE_HOLDS(std::memcmp(normals.data(), frame.normals.data(), static_cast<std::size_t>(count) * 12) == 0);

  const NoiseModel measured = estimate_noise(depth, camera, threads);
  measured.check();
  NACRE_HOLDS(measured.sigma(1.0) > 0.0 && std::isfinite(measured.sigma(1.0)));
  NoiseCalibration calibration(camera);
  for (int i = 0; i < 3; ++i) calibration.add(i == 1 ? bytes.depth(camera) : depth, threads);
  calibration.model().check();
}
