/// What a frame's registration to the model may come to.
#pragma once

namespace nacre {

/// What became of a frame.
enum class FrameStatus {
  tracked,      ///< registered and folded in
  weak,         ///< registered, but the data leaves a direction of the pose open: not folded in
  lost,         ///< not registered: the model is as it was before
  relocalised,  ///< registered again after being lost, and folded in
};
const char* to_string(FrameStatus status);  ///< TRACKED, WEAK, LOST, RELOCALISED

}  // namespace nacre
