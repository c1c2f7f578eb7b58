// Large arrays that live as long as a call, from memory that the calling thread keeps for the next one: to get fresh
// pages from the system costs more than most loops over an image.
#pragma once

#include <cstddef>
#include <type_traits>
#include <utility>

namespace nacre {

struct ScratchBlock {
  void* memory = nullptr;
  std::size_t size = 0;  // [bytes]
};

ScratchBlock take_scratch(std::size_t size);
void give_back_scratch(ScratchBlock block) noexcept;

// `size` values, not initialised, at a multiple of 64 bytes.
template <class T>
class Scratch {
  static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);

 public:
  explicit Scratch(std::size_t size) : block_(take_scratch(size * sizeof(T))) {}
  ~Scratch() { give_back_scratch(block_); }
  Scratch(Scratch&& other) noexcept : block_(std::exchange(other.block_, {})) {}
  Scratch& operator=(Scratch&& other) noexcept {
    std::swap(block_, other.block_);
    return *this;
  }

  T* data() const { return static_cast<T*>(block_.memory); }

 private:
  ScratchBlock block_;
};

}  // namespace nacre
