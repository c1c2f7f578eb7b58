#include "model/new_start.hpp"

#include <cstddef>
#include <stdexcept>

#include "base/limits.hpp"
#include "model/limits.hpp"

namespace nacre {
namespace {

// What became of a frame that the model no longer holds, or does not hold yet.
FrameReport without_model(FrameReport report, const char* reason) {
  if (report.status != FrameStatus::lost) {
    static_cast<TrackingReport&>(report) = TrackingReport();
    report.status = FrameStatus::lost;
    report.reason = reason;
    report.fusion = FusionReport();
  }
  report.world_from_camera = Pose::Identity();
  report.num_points = 0;
  report.spacing = 0.0;
  return report;
}

std::unique_ptr<Pipeline> begun_with(const std::vector<StartFrame>& frames, const Pipeline& model) {
  auto begun = std::make_unique<Pipeline>(model.given_camera, model.given, model.options.binning);
  begun->is_trial = true;
  begun->carried = model.carried;
  for (const StartFrame& frame : frames) {
    for (auto i = begun->history.size(); i < static_cast<std::size_t>(frame.index); ++i) {
      begun->history.add(without_model(model.history[i], "no other frame fits it: the model begins with a later one"));
      if (begun->shape) begun->shape->end_frame();
    }
    try {
      if (begun->add_frame(frame.depth, frame.extras).status != FrameStatus::tracked) return nullptr;
    } catch (const std::invalid_argument&) {  // attributes fit the model's, and not each other
      return nullptr;
    }
  }
  return begun;
}

// What the camera carries decided of the model, and was taken for its scene.
std::unique_ptr<Pipeline> begun_without_carried(const Pipeline& model, const DepthRef& depth,
                                                const FrameExtras& extras) {
  const FrameHistory& history = model.history;
  const bool is_young = model.carried.since() == 0 && history.size() <= model_limits::start_frames;
  if (model.carried.found().size() == 0 || !is_young || !history.pose(0).isApprox(Pose::Identity())) return nullptr;
  auto begun = std::make_unique<Pipeline>(model.given_camera, model.given, model.options.binning);
  begun->carried = model.carried;
  for (std::size_t i = 0; i + 1 < history.size(); ++i) {
    begun->history.add(without_model(history[i], "the camera carries a part of what it sees: the model begins later"));
  }
  begun->forgets_earlier = true;
  begun->add_frame(depth, extras);
  begun->start_frames.push_back({depth, extras, begun->history.back().index});
  return begun;
}

}  // namespace

std::unique_ptr<Pipeline> begin_anew(Pipeline& model, const DepthRef& depth, const FrameExtras& extras) {
  const FrameReport newest = model.history.back();
  const bool is_first = newest.status == FrameStatus::tracked && model.history.num_registered() == 1;
  const bool is_wanted = model.options.relocalise && model.options.verify &&
                         model.options.registration.method != Metric::paper && !(is_first && extras.guess);
  if (is_wanted && !extras.guess) {
    if (auto begun = begun_without_carried(model, depth, extras)) return begun;
  }
  std::vector<StartFrame>& frames = model.start_frames;
  const bool is_lost = newest.status == FrameStatus::lost;
  const bool adds_nothing = is_lost || newest.status == FrameStatus::weak;
  if (!is_wanted || !(is_first || adds_nothing)) frames.clear();
  if (!is_wanted || (frames.empty() && !is_first) || model.frame.valid.size() < base_limits::least_points) {
    return nullptr;
  }
  frames.push_back({depth, extras, newest.index});
  if (frames.size() < model_limits::start_frames) return nullptr;
  std::unique_ptr<Pipeline> begun = is_lost ? begun_with(frames, model) : nullptr;
  frames.erase(frames.begin());
  return begun;
}

}  // namespace nacre
