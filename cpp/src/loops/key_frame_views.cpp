#include "loops/key_frame_views.hpp"

#include "loops/limits.hpp"

namespace nacre {

std::shared_ptr<const KeyFrameView> KeyFrameViews::operator[](int key_frame) const {
  Place& place = places_[static_cast<std::size_t>(key_frame)];
  place.last_use = ++num_uses_;
  std::shared_ptr<KeyFrameView> view = place.view;
  if (!view) {
    const auto no_more = [](const StateReader&, const KeyFrameView&) {};
    view = std::make_shared<KeyFrameView>(files_.read<KeyFrameView>(place.file, no_more));
    place.view = view;
    ++num_read_;
    forget_longest_unused();
  }
  return view;
}

void KeyFrameViews::replace(int key_frame, KeyFrameView view) {
  Place& place = places_[static_cast<std::size_t>(key_frame)];
  if (!place.file.empty()) {
    std::string file = files_.write(view);
    files_.release(place.file);
    place.file = std::move(file);
  }
  if (place.view) place.view = std::make_shared<KeyFrameView>(std::move(view));
}

bool KeyFrameViews::park() {
  if (!files_.is_on()) return false;
  const std::size_t num_before = num_written_;
  for (; num_written_ + loops_limits::newest_key_frames < places_.size(); ++num_written_) {
    Place& place = places_[num_written_];
    place.file = files_.write(*place.view);
    ++num_read_;
    forget_longest_unused();
  }
  return num_written_ > num_before;
}

void KeyFrameViews::forget_longest_unused() const {
  while (num_read_ > loops_limits::recalled_key_frames) {
    Place* longest = nullptr;
    for (std::size_t k = 0; k < num_written_; ++k) {
      Place& place = places_[k];
      if (place.view && (longest == nullptr || place.last_use < longest->last_use)) longest = &place;
    }
    longest->view.reset();
    --num_read_;
  }
}

}  // namespace nacre
