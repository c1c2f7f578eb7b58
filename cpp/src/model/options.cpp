#include "base/check.hpp"
#include "base/pose_check.hpp"
#include "nacre/model_options.hpp"

namespace nacre {

ModelOptions ModelOptions::preset(const std::string& name) {
  ModelOptions options;
  if (name == "default") return options;
  if (name != "paper") throw std::invalid_argument("preset must be 'default' or 'paper', got '" + name + "'");

  // Blackburn, Kubacki and Stratton 2010.
  options.depth.edge_test = EdgeTest::gradient;
  options.registration.method = Metric::point_to_plane;
  options.registration.sample_fraction = 0.05;
  options.registration.max_distance = 0.005;
  options.registration.final_distance = 0.005;
  options.registration.gate_decay = 1.0;
  options.registration.max_angle = 3.141592653589793;
  options.registration.max_iterations = 15;
  options.registration.keep_best = true;
  options.registration.robust = false;
  options.registration.coarse_samples = 0;
  options.registration.max_points = 0;
  options.registration.max_samples = 0;
  options.registration.weak_threshold = 0.0;
  options.fold_in = FoldIn::wlop;
  options.consolidation.radius = 0.008;
  options.consolidation.mu = 0.4;
  options.consolidation.iterations = 10;
  options.normals.max_radius = 0.008;
  options.max_points = 2000;
  options.first_fraction = 0.5;
  options.kept_fraction = 0.9;
  options.new_fraction = 0.2;
  options.predict_motion = false;
  options.relocalise = false;
  options.denoise_samples = false;
  options.loop_closure = false;
  options.verify = false;
  return options;
}

void ModelOptions::check() const {
  depth.check();
  region.check();
  registration.check();
  fusion.check();
  consolidation.check();
  require(normals.k >= 3, "normals.k", "at least 3", normals.k);
  require(normals.max_radius > 0.0, "normals.max_radius", "a positive distance in metres", normals.max_radius);
  require(spacing >= 0.0 && spacing < farthest_place, "spacing",
          "0 (automatic) or a positive distance in metres below 1e30", spacing);
  require(max_points >= 100, "max_points", "at least 100", max_points);
  require(min_evidence >= 0.0, "min_evidence", "0 or more", min_evidence);
  require(first_fraction > 0.0 && first_fraction <= 1.0, "first_fraction", "in (0, 1]", first_fraction);
  require(kept_fraction > 0.0 && kept_fraction <= 1.0, "kept_fraction", "in (0, 1]", kept_fraction);
  require(new_fraction >= 0.0 && new_fraction <= 1.0, "new_fraction", "in [0, 1]", new_fraction);
  require(num_threads >= 0, "num_threads", "0 (all) or more", num_threads);
}

}  // namespace nacre
