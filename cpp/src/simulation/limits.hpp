// Numbers that decide how scenes and clouds are drawn, and how simulated sensors err.
// Each line: [unit] kind: meaning; what guards it. Kinds: derived, budget, tuned; docs/numbers.md shows them all.
#pragma once

// clang-format off
namespace nacre::simulation_limits {

constexpr int max_radius = 40;  // [pixel] budget: of a disk; test_rendering
constexpr float min_radius = 0.75F;  // [pixel] derived: disks of neighbouring pixels meet; test_rendering
constexpr float reverse_radius = 0.7F;  // [1] tuned: of a front's: reverse sides must not stick out at rims; test_rendering
constexpr float least_tilt = 0.2F;  // [cosine] tuned: disks seen more from the side are drawn as if this steep; test_rendering
constexpr float outline_step = 6.0F;  // [pixel] tuned: larger steps in depth are outlines; test_rendering
constexpr double max_depth = 1e30;  // [pixel] derived: farther points are left out; test_rendering
constexpr int rays_per_radius = 4;  // [rays] budget: both ways, over a pixel that mixes what it sees; test_simulation
constexpr double background_room = 0.1;  // [diameter] tuned: from the mesh to a background that nobody has placed; test_simulation

constexpr double farthest_place = 1e15;  // [1] derived: of smooth noise: there doubles still know integers; test_sensors
constexpr double contrast = 0.5;  // [1] tuned: of surfaces, standard deviation of the logarithm of brightness; benchmarks/sensors.py
constexpr double patch_size = 0.05;  // [m] tuned: of a surface, of one brightness; benchmarks/sensors.py
constexpr double hidden_margin = 1e-6;  // [distance] derived: before a point, from where nothing hides it: rounding; test_sensors
constexpr double broad_patch = 15.0;  // [pixel] tuned: of a triangulating sensor, over which it errs alike; benchmarks/sensors.py

constexpr double stereo_baseline = 0.05;  // [m] derived: D435, Intel's data sheet 337029; test_sensors
constexpr double stereo_step = 0.03125;  // [pixel] derived: of disparity: D400, Grunnet-Jepsen et al. 2019; test_sensors
constexpr double stereo_window = 4.5;  // [pixel] tuned: that errs alike, of a matching window; benchmarks/sensors.py
constexpr double stereo_jitter = 0.25;  // [pixel] tuned: of the place that a window shows; benchmarks/sensors.py
constexpr double stereo_rough = 0.002;  // [pixel] tuned: of disparity: of each pixel; benchmarks/sensors.py
constexpr double stereo_fine = 0.018;  // [pixel] tuned: of each window; benchmarks/sensors.py
constexpr double stereo_broad = 0.1;  // [pixel] tuned: of a broad patch; benchmarks/sensors.py
constexpr double stereo_fixed = 0.3;  // [1] tuned: part of the variance of windows and patches that all images share; benchmarks/sensors.py
constexpr double stereo_ripple = 0.012;  // [pixel] tuned: amplitude of what repeats with each pixel of disparity, Grunnet-Jepsen et al. 2019; benchmarks/sensors.py
constexpr double stereo_range = 3.0;  // [m] tuned: where half the signal is left; benchmarks/sensors.py
constexpr double stereo_least_signal = 0.25;  // [1] tuned: of a bright surface in front of the camera; benchmarks/sensors.py

constexpr double light_baseline = 0.075;  // [m] derived: Kinect v1, Khoshelham and Elberink 2012; test_sensors
constexpr double light_step = 0.125;  // [pixel] derived: of disparity, Khoshelham and Elberink 2012; test_sensors
constexpr double light_window = 3.6;  // [pixel] tuned: that errs alike: nine pixels are matched; benchmarks/sensors.py
constexpr double light_jitter = 0.5;  // [pixel] derived: of the place that a window shows, Handa et al. 2014; benchmarks/sensors.py
constexpr double light_rough = 0.01;  // [pixel] tuned: of disparity, of each pixel; benchmarks/sensors.py
constexpr double light_fine = 0.03;  // [pixel] tuned: of each window; benchmarks/sensors.py
constexpr double light_broad = 0.03;  // [pixel] tuned: of a broad patch; benchmarks/sensors.py
constexpr double light_fixed = 0.4;  // [1] tuned: part of the variance of windows and patches that all images share; benchmarks/sensors.py
constexpr double light_ripple = 0.0;  // [pixel] derived: none is known; benchmarks/sensors.py
constexpr double light_range = 4.0;  // [m] tuned: where half the signal is left; benchmarks/sensors.py
constexpr double light_least_signal = 0.12;  // [1] tuned: of a bright surface in front of the camera; benchmarks/sensors.py

constexpr double flying_radius = 1.0;  // [pixel] tuned: of what a pixel at an edge mixes; test_sensors
constexpr int flying_reach = 3;  // [pixel] budget: beside that, where rays that err to the side are mixed; test_sensors
constexpr double lateral_constant = 0.8;  // [pixel] derived: Nguyen et al. 2012, of the Kinect v1; test_sensors
constexpr double lateral_slant = 0.035;  // [pixel] derived: likewise, by angle / (pi/2 - angle); test_sensors
constexpr double axial_slant = 0.0001;  // [m^1.5] derived: likewise, by its square, over sqrt(z); test_sensors
constexpr double flight_range = 4.0;  // [m] tuned: where half the signal is left; test_sensors
constexpr double flight_least_signal = 0.05;  // [1] tuned: of a bright surface in front of the camera; test_sensors
constexpr double albedo = 0.5;  // [1] derived: of walls in infrared: some four to six tenths; test_sensors
constexpr int num_bounces = 4;  // [rays] budget: from a pixel to what may light it; test_sensors
constexpr int bounce_blur = 3;  // [pixel] budget: around a pixel, whose rays tell together; test_sensors
constexpr double bounce_gap = 1e-6;  // [distance] derived: from the surface to where they start: rounding; test_sensors

constexpr int lidar_points = 24;  // [1] derived: each way: 576 points, Luetzenburg, Kroon and Bjork 2021; test_sensors
constexpr double lidar_rough = 0.003;  // [z] tuned: error of a point; benchmarks/sensors.py
constexpr double lidar_broad = 0.005;  // [z] tuned: of the points of a broad patch; benchmarks/sensors.py
constexpr double lidar_fine = 0.0008;  // [z] tuned: of what is filled in, of a window; benchmarks/sensors.py
constexpr double lidar_window = 3.0;  // [pixel] tuned: that errs alike; benchmarks/sensors.py
constexpr double lidar_alone = 0.5;  // [points] derived: over less, points err independently; benchmarks/sensors.py
constexpr double lidar_patch = 4.0;  // [points] tuned: over which they err alike; benchmarks/sensors.py
constexpr double lidar_fixed = 0.8;  // [1] tuned: part of the variance that all images share; benchmarks/sensors.py
constexpr int lidar_bits = 10;  // [bits] derived: of a depth, after the leading one: ARKit gives half precision; test_sensors
constexpr int lidar_reach = 2;  // [points] budget: each way, that a pixel is filled in from; benchmarks/sensors.py
constexpr double lidar_blur = 0.5;  // [points^2] tuned: squared distance over which their weight falls; benchmarks/sensors.py
constexpr int guide_radius = 1;  // [pixel] tuned: by which edges are blurred, twice; benchmarks/sensors.py
constexpr double guide_tolerance = 0.04;  // [1/z] tuned: of points on one surface; benchmarks/sensors.py
constexpr double least_weight = 1e-6;  // [1] derived: of points on others, that fill in what none is on; test_sensors
constexpr double level_weight = 0.01;  // [1] tuned: that keeps planes level that few points hold; benchmarks/sensors.py
constexpr double least_cover = 0.3;  // [1] tuned: of a pixel's surroundings, that show something; test_sensors

}  // namespace nacre::simulation_limits
// clang-format on
