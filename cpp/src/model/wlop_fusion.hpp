// The paper's way to fuse a frame into the model: WLOP of the model's and the frame's points.
#pragma once

#include "nacre/model_options.hpp"

namespace nacre {

// Fuses a registered frame by WLOP (options.fusion_method: the literal or the repaired form). The first frame makes the
// model. Normals of points that are new, or moved, are those of their frame until renew_normals.
void consolidate_frame(PointModel& model, const Frame& frame, const Pose& world_from_camera,
                       const ModelOptions& options, double spacing, std::int32_t frame_index);

// Normals of the model from the nearest neighbours of each point, turned to the side they pointed to before.
void renew_normals(PointModel& model, const ModelOptions& options);

}  // namespace nacre
