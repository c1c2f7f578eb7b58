/// What can be wrong with a saved model.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

namespace nacre {

/// Of saved models. It changes with what a model keeps.
constexpr std::uint32_t checkpoint_format = 24;

/// Bytes that are no saved model, or not all of one, or one of another format; the message says which.
class CheckpointError : public std::runtime_error {
 public:
  CheckpointError(const std::string& reason, std::int64_t offset);
  ~CheckpointError() override;
  std::int64_t offset() const { return offset_; }  ///< of the first byte that is wrong, from 0

 private:
  std::int64_t offset_;
};

}  // namespace nacre
