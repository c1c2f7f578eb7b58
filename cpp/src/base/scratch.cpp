#include "base/scratch.hpp"

#include <algorithm>
#include <new>
#include <numeric>
#include <vector>

namespace nacre {
namespace {

constexpr std::align_val_t cache_line{64};
constexpr std::size_t most_kept = std::size_t{64} << 20;  // bytes a thread

void release(const ScratchBlock& block) { ::operator delete(block.memory, cache_line); }

// The blocks that a thread keeps, oldest first.
class Store {
 public:
  ~Store() {
    for (const ScratchBlock& block : blocks_) release(block);
  }

  // The smallest block that is large enough, unless it is far too large.
  ScratchBlock take(std::size_t size) {
    auto best = blocks_.end();
    for (auto block = blocks_.begin(); block != blocks_.end(); ++block) {
      if (block->size < size || block->size / 2 > size) continue;
      if (best == blocks_.end() || block->size < best->size) best = block;
    }
    if (best == blocks_.end()) return {};
    const ScratchBlock taken = *best;
    blocks_.erase(best);
    return taken;
  }

  void keep(const ScratchBlock& block) {
    blocks_.push_back(block);
    std::size_t total = 0;
    for (const ScratchBlock& kept : blocks_) total += kept.size;
    auto first_kept = blocks_.begin();
    for (; total > most_kept; ++first_kept) {
      total -= first_kept->size;
      release(*first_kept);
    }
    blocks_.erase(blocks_.begin(), first_kept);
  }

 private:
  std::vector<ScratchBlock> blocks_;
};

thread_local Store store;

}  // namespace

ScratchBlock take_scratch(std::size_t size) {
  const ScratchBlock kept = store.take(size);
  if (kept.memory != nullptr) return kept;
  return {::operator new(size, cache_line), size};
}

void give_back_scratch(ScratchBlock block) noexcept {
  if (block.memory == nullptr) return;
  try {
    store.keep(block);
  } catch (...) {  // no memory to note it
    release(block);
  }
}

}  // namespace nacre
