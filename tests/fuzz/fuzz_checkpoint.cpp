// Saved models whose bytes were changed by somebody who knows the checksum.
#include <string>

#include "base/random.hpp"
#include "options.hpp"

namespace {

using namespace nacre;

constexpr int width = 16, height = 12;

DepthImage bumps(float distance) {
  DepthImage depth(height, width);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const auto x = static_cast<float>(u), y = static_cast<float>(v);
      depth(v, u) = distance + 0.02F * std::sin(0.5F * x) + 0.02F * std::cos(0.7F * y);
    }
  }
  return depth;
}

// Before the first frame, after some, with extras, while a lost camera is followed, of the paper's loop.
std::vector<std::string> saved_models() {
  std::vector<std::string> saved;
  saved.push_back(Model(Camera::pinhole(width, height, 20, 20, 8, 6, {}, DepthKind::radial)).save());
  const Camera camera = Camera::pinhole(width, height, 20, 20, 8, 6);
  for (const char* preset : {"default", "paper"}) {
    ModelOptions options = ModelOptions::preset(preset);
    options.num_threads = 1;
    options.spacing = 0.05;
    options.max_points = 100;
    Model model(camera, options);
    FrameExtras extras;
    extras.keep_guess = true;
    for (int i = 0; i < 3; ++i) {
      extras.guess = Pose::Identity();
      model.add_frame(bumps(1.0F + 0.001F * static_cast<float>(i)), extras);
    }
    saved.push_back(model.save("a note"));
    for (int i = 0; i < 2; ++i) model.add_frame(bumps(1.5F));
    saved.push_back(model.save());
  }
  ModelOptions options;
  options.num_threads = 1;
  options.spacing = 0.05;
  Model model(camera, options);
  FrameExtras extras;
  extras.colors = Colors::Constant(width * height, 3, 100);
  extras.attributes.push_back({"heat", Attributes::Constant(width * height, 2, 1.0F)});
  extras.timestamp = 1.0;
  model.add_frame(bumps(1.0F), extras);
  saved.push_back(model.save());
  return saved;
}

// With the length and the checksum that fit: see model_checkpoint.cpp.
void seal(std::string& bytes) {
  constexpr std::size_t length_at = 32, checksum_at = 40, header_size = 48;
  if (bytes.size() < header_size) return;
  const std::uint64_t length = bytes.size();
  std::uint64_t sum = length - header_size;
  for (std::size_t i = header_size; i < bytes.size(); i += sizeof sum) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + i, std::min(sizeof word, bytes.size() - i));
    sum = mix64(sum ^ word);
  }
  std::memcpy(bytes.data() + length_at, &length, sizeof length);
  std::memcpy(bytes.data() + checksum_at, &sum, sizeof sum);
}

template <class T>
void replace(std::string& bytes, std::size_t place, T value) {
  std::memcpy(bytes.data() + place, &value, std::min(sizeof value, bytes.size() - place));
}

void damage(nacre_fuzz::Bytes& choices, std::string& bytes) {
  for (int left = choices.byte() % 8; left > 0 && !bytes.empty(); --left) {
    const std::size_t place = choices.raw<std::uint16_t>() % bytes.size();
    switch (choices.byte() % 8) {
      case 0:
        bytes[place] = static_cast<char>(choices.byte());
        break;
      case 1:
        replace(bytes, place, choices.raw<std::int32_t>());
        break;
      case 2:
        replace(bytes, place, choices.raw<std::uint64_t>());
        break;
      case 3:
        replace(bytes, place, std::uint64_t{choices.byte()});
        break;
      case 4:
        replace(bytes, place, choices.number());
        break;
      case 5:
        replace(bytes, place, choices.coordinate());
        break;
      case 6:
        bytes.erase(place, choices.byte());
        break;
      default:
        bytes.insert(place, choices.byte(), '\0');
    }
  }
}

// A forger may ask for any amount of work, too.
bool is_quick(const ModelOptions& options) {
  const AlignOptions& registration = options.registration;
  return registration.max_iterations <= 100 && registration.max_samples <= 20000 &&
         registration.coarse_samples <= 20000 && options.wlop.iterations <= 20 && options.wlop.normal_neighbors <= 100;
}

}  // namespace

NACRE_FUZZ_TARGET(bytes) {
  static const std::vector<std::string> saved = saved_models();
  std::string changed = saved[bytes.byte() % saved.size()];
  const bool goes_on = bytes.byte() < 64;
  damage(bytes, changed);
  if (bytes.byte() < 240) seal(changed);
  std::optional<Model> model;
  try {
    model = Model::load(changed);
  } catch (const CheckpointError& error) {
    NACRE_HOLDS(*error.what() != '\0' && error.offset() >= 0);
    NACRE_HOLDS(error.offset() <= static_cast<std::int64_t>(changed.size()));
    return;
  }
  const std::string again = model->save();
  NACRE_HOLDS(Model::load(again).save() == again);
  NACRE_HOLDS(model->cloud_in_camera().size() == model->cloud().size());
  if (!goes_on || !is_quick(model->given_options()) ||
      !(model->camera() == Camera::pinhole(width, height, 20, 20, 8, 6)))
    return;
  const std::size_t before = model->frames().size();
  const FrameReport report = model->add_frame(bumps(1.002F));
  NACRE_HOLDS(model->frames().size() == before + 1 && report.world_from_camera.matrix().allFinite());
  for (const Eigen::Vector3f& point : model->cloud().points) NACRE_HOLDS(point.allFinite());
}
