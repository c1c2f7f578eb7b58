/// The loop: depth frames in, a growing point model and a camera trajectory out.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "nacre/camera.hpp"
#include "nacre/checkpoint.hpp"
#include "nacre/depth_calibration.hpp"
#include "nacre/frame_report.hpp"
#include "nacre/model_options.hpp"
#include "nacre/types.hpp"

namespace nacre {

struct Pipeline;

/// How a model that deforms was at a frame, in the world frame [m].
struct ShapeAtFrame {
  std::vector<Eigen::Vector3f> points, normals;  ///< of the model's points, in their order
  std::vector<Eigen::Vector3f> nodes;            ///< of the warp field
};

/// A 3D model that grows with every depth frame. The world is the first camera's frame unless the first frame comes
/// with a guess. Frames that cannot be registered change nothing; where the first explains no other, three frames in a
/// row that explain each other begin the model anew. References to what it has are valid until the next frame is added.
class Model {
 public:
  explicit Model(const Camera& camera, const ModelOptions& options = {});
  ~Model();
  Model(Model&&) noexcept;
  Model& operator=(Model&&) noexcept;

  /// Depth [m], NaN or values that are not positive mean "no measurement". Throws std::invalid_argument when sizes do
  /// not fit or the depth scale cannot be right, before anything is changed. Of a model with points_folder, throws
  /// std::filesystem::filesystem_error where points cannot be written, before anything is changed, or read: the model
  /// then takes no more frames, and is to be loaded as it was saved.
  FrameReport add_frame(const DepthRef& depth, const FrameExtras& extras = {});

  Camera camera() const;                      ///< as given
  const ModelOptions& options() const;        ///< with what the first frame decided
  const ModelOptions& given_options() const;  ///< as given
  const PointModel& cloud() const;            ///< in the world frame; of ModelOptions::points_folder: in memory
  std::int64_t num_points() const;            ///< those on disk, too
  /// All points, in the order in which they came, those on disk too: in parts, whose memory is used again. Throws
  /// std::filesystem::filesystem_error where a file cannot be read, or is damaged.
  void for_each_part(const std::function<void(const PointModel& part)>& visit) const;
  PointModel whole_cloud() const;      ///< the same, at once
  void recall_all();                   ///< all points come back to memory, until more frames are added
  PointModel cloud_in_camera() const;  ///< likewise, in the newest registered camera's frame
  /// Of a model with options().deform, which cloud() has in its canonical shape. What was added later is carried by
  /// what was there; a frame that is lost has the shape of the one before. Throws std::invalid_argument where the model
  /// does not deform, or has no such frame.
  ShapeAtFrame shape_at(std::int64_t frame) const;
  /// One report per frame that was added. Where a later frame corrected it, it says what is known since.
  FrameReports frames() const;
  /// What the views so far say of systematic errors of the depth as it comes. Where it is significant, depth is
  /// corrected from then on, and what was there is moved. Unset where it cannot be calibrated, or is not to be.
  std::optional<DepthCalibration> depth_calibration() const;
  NoiseModel noise() const;   ///< given, or measured from the images so far
  double depth_unit() const;  ///< that depth comes in [m]; 0 where noise hides it
  /// By how much the frames registered so far are noisier than that: errors that neighbouring pixels share do not show
  /// in one image. At least 1; 1 where the noise is given.
  double noise_factor() const;
  double spacing() const;  ///< [m]; 0 before the first frame

  /// All that the model knows, as bytes; a model that is loaded from them goes on to the same bits. `note`: bytes of
  /// the caller's to keep with it. Read by every nacre with the same checkpoint_format, on every machine. To replace a
  /// file safely, write another one, flush it to disk and rename it. Of a model with points_folder, they name files in
  /// it, of which those stay that the two newest saves name.
  std::string save(const std::string& note = {}) const;
  /// Throws CheckpointError where the bytes are damaged, not all there, or of another format. They may come from
  /// anybody: sizes are checked before memory is allocated, and no code is run. points_folder: of a model that had one,
  /// where that is now; std::invalid_argument where it is missing.
  static Model load(std::string_view bytes, std::string* note = nullptr, const std::string& points_folder = {});

 private:
  explicit Model(std::unique_ptr<Pipeline> pipeline);
  std::unique_ptr<Pipeline> pipeline_;
};

}  // namespace nacre
