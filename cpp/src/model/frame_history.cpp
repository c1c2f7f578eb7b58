#include "model/frame_history.hpp"

#include "model/checkpoint/fields.hpp"

namespace nacre {

void move_uncertainty(FrameReport& report, const Pose& motion) {
  Matrix6 turn = Matrix6::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = motion.linear();
  if (!report.information.isZero(0.0)) report.center = motion * report.center;
  report.information = turn * report.information * turn.transpose();
  report.weak_directions = turn * report.weak_directions;
}

void FrameHistory::add(const FrameReport& report) {
  if (size() % per_chunk == 0) chunks_.emplace_back();
  if (report.status != FrameStatus::lost) registered_.push_back(static_cast<std::int32_t>(size()));
  FrameReport kept = report;
  move_uncertainty(kept, report.world_from_camera.inverse());
  Chunk& chunk = chunks_.back();
  chunk.poses.emplace_back(report.world_from_camera.matrix().topRows<3>());
  StateWriter archive(chunk.bytes);
  archive(kept);
  chunk.ends.push_back(static_cast<std::uint32_t>(chunk.bytes.size()));
  if (chunk.ends.size() == per_chunk) chunk.bytes.shrink_to_fit();
}

Pose FrameHistory::pose(std::size_t index) const {
  Pose pose = Pose::Identity();
  pose.matrix().topRows<3>() = chunks_[index / per_chunk].poses[index % per_chunk];
  return pose;
}

FrameReport FrameHistory::operator[](std::size_t index) const {
  const Chunk& chunk = chunks_[index / per_chunk];
  const std::size_t place = index % per_chunk;
  StateReader archive(std::string_view(chunk.bytes).substr(0, chunk.ends[place]),
                      place > 0 ? chunk.ends[place - 1] : 0);
  FrameReport report;
  archive(report);
  archive.require_end();
  report.index = static_cast<std::int64_t>(index);
  report.world_from_camera = pose(index);
  move_uncertainty(report, report.world_from_camera);
  return report;
}

void FrameHistory::move(const std::vector<Pose>& motions) {
  for (std::size_t i = 0; i < size(); ++i) {
    chunks_[i / per_chunk].poses[i % per_chunk] = (motions[i] * pose(i)).matrix().topRows<3>();
  }
}

FrameReports::FrameReports(const FrameHistory& history) : history_(&history), size_(history.size()) {}
FrameReport FrameReports::operator[](std::size_t index) const { return (*history_)[index]; }

}  // namespace nacre
