#include "base/check.hpp"
#include "base/pose_check.hpp"
#include "nacre/model_options.hpp"

namespace nacre {

ModelOptions ModelOptions::preset(const std::string& name) {
  ModelOptions options;
  if (name == "default") return options;
  if (name != "paper") throw std::invalid_argument("preset must be 'default' or 'paper', got '" + name + "'");

  // Blackburn, Kubacki and Stratton 2010, as printed.
  options.depth.edge_test = EdgeTest::gradient;
  options.registration.method = Metric::paper;
  options.registration.sample_fraction = 0.05;
  options.registration.max_distance = 0.005;
  options.registration.max_iterations = 15;
  options.registration.keep_best = true;
  options.fusion_method = FusionMethod::wlop;
  options.wlop.theta = Theta::printed;
  options.wlop.radius = 0.008;
  options.wlop.mu = 0.4;
  options.wlop.iterations = 10;
  options.wlop.first_fraction = 0.5;
  options.wlop.kept_fraction = 0.9;
  options.wlop.new_fraction = 0.2;
  options.max_points = 2000;

  // What it leaves open: the middle of where benchmarks/paper.py completes the turn.
  options.registration.max_angle = 0.6;
  options.wlop.normal_neighbors = 10;
  options.wlop.normal_radius = 0.010;
  options.predict_motion = true;

  // What it does not have.
  options.registration.final_distance = 0.005;
  options.registration.gate_decay = 1.0;
  options.registration.robust = false;
  options.registration.coarse_samples = 0;
  options.registration.max_points = 0;
  options.registration.max_samples = 0;
  options.registration.weak_threshold = 0.0;
  options.binning = 1;
  options.relocalise = false;
  options.calibrate_depth = false;
  options.denoise_samples = false;
  options.loop_closure = false;
  options.verify = false;
  return options;
}

void WlopOptions::check() const {
  require(radius >= 1e-12 && radius <= 1e12, "wlop.radius", "a length from 1e-12 to 1e12", radius);
  require(iterations >= 0, "wlop.iterations", "at least 0", iterations);
  require(mu >= 0.0 && mu <= 0.5, "wlop.mu", "0 to 0.5", mu);
  require(first_fraction > 0.0 && first_fraction <= 1.0, "wlop.first_fraction", "in (0, 1]", first_fraction);
  require(kept_fraction > 0.0 && kept_fraction <= 1.0, "wlop.kept_fraction", "in (0, 1]", kept_fraction);
  require(new_fraction >= 0.0 && new_fraction <= 1.0, "wlop.new_fraction", "in [0, 1]", new_fraction);
  require(normal_neighbors >= 3, "wlop.normal_neighbors", "at least 3", normal_neighbors);
  require(normal_radius > 0.0, "wlop.normal_radius", "a positive distance in metres", normal_radius);
}

void ModelOptions::check() const {
  depth.check();
  region.check();
  registration.check();
  fusion.check();
  wlop.check();
  require(binning >= 0, "binning", "0 (automatic) or more", binning);
  require(spacing >= 0.0 && spacing < farthest_place, "spacing",
          "0 (automatic) or a positive distance in metres below 1e30", spacing);
  require(!deform || fusion_method == FusionMethod::fuse, "fusion_method", "fuse for a model that deforms",
          fusion_method == FusionMethod::wlop ? "wlop" : "wlop+");
  require(!deform || registration.method != Metric::paper, "registration.method",
          "another than paper for a model that deforms", "paper");
  require(points_folder.empty() || !deform, "points_folder", "empty for a model that deforms", points_folder);
  require(points_folder.empty() || (loop_closure && fusion_method == FusionMethod::fuse), "points_folder",
          "used with loop_closure and fusion_method fuse", points_folder);
  require(max_points >= 100, "max_points", "at least 100", max_points);
  require(min_score >= 0.0, "min_score", "0 or more", min_score);
  require(num_threads >= 0, "num_threads", "0 (all) or more", num_threads);
}

}  // namespace nacre
