// Grows a model of the built-in object from twelve simulated views, and measures how far it is from the truth.
//
//   turntable [NOISE]     NOISE of the depth in millimetres, 0.5 where it is not given
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "nacre/model.hpp"
#include "nacre/simulation.hpp"

int main(int argc, char** argv) {
  constexpr double pi = 3.14159265358979;
  const double noise = (argc > 1 ? std::atof(argv[1]) : 0.5) / 1000.0;
  const nacre::Mesh thing = nacre::built_in_object();
  const nacre::MeshTree surface(thing.vertices, thing.triangles);
  const nacre::Camera camera = nacre::Camera::pinhole(320, 240, 400, 400, 159.5, 119.5);
  const Eigen::Vector3d center = (surface.lower() + surface.upper()) / 2;

  nacre::Model model(camera);
  nacre::Pose world_from_first;  // the model's world is the first camera's frame
  for (int view = 0; view < 12; ++view) {
    // The camera looks at the centre from 0.4 m, y down: half a turn about x, then about the vertical.
    nacre::Pose pose = nacre::Pose::Identity();
    pose.linear() =
        (Eigen::AngleAxisd(view * pi / 6, Eigen::Vector3d::UnitY()) * Eigen::AngleAxisd(pi, Eigen::Vector3d::UnitX()))
            .toRotationMatrix();
    pose.translation() = center - 0.4 * pose.linear().col(2);
    if (view == 0) world_from_first = pose;

    nacre::SimulationOptions options;
    options.noise.constant = noise;
    options.seed = static_cast<std::uint64_t>(view);
    const nacre::FrameReport report = model.add_frame(nacre::simulate_depth(surface, camera, pose, options));
    std::printf("%2d  %-8s overlap %.2f  %lld points\n", view, nacre::to_string(report.status), report.overlap,
                static_cast<long long>(report.num_points));
  }

  double sum = 0.0;
  for (const Eigen::Vector3f& point : model.cloud().points) {
    sum += std::pow(surface.closest(world_from_first * point.cast<double>()).distance, 2);
  }
  std::printf("%.3f mm from the surface (RMS)\n", 1000.0 * std::sqrt(sum / static_cast<double>(model.cloud().size())));
}
