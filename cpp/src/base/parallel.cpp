#include "base/parallel.hpp"

#include <atomic>
#include <exception>

#include "base/parallel_backend.hpp"
#include "nacre/cancel.hpp"

namespace nacre {
namespace {

#ifdef NACRE_OPENMP
namespace backend = openmp;
constexpr const char* backend_name = "openmp";
#else
namespace backend = threads;
constexpr const char* backend_name = "threads";
#endif

constexpr std::int64_t most_threads = 256;

// The blocks of a loop: each thread of its team takes the next, until there is none.
class Blocks {
 public:
  Blocks(std::int64_t count, void (*run)(void*, std::int64_t), void* context)
      : count_(count), run_(run), context_(context) {}

  static void work_on(void* blocks) { static_cast<Blocks*>(blocks)->work(); }

  void rethrow() const {
    if (error_) std::rethrow_exception(error_);
  }

 private:
  void work() {
    try {
      for (;;) {
        const std::int64_t block = next_.fetch_add(1, std::memory_order_relaxed);
        if (block >= count_) return;
        CancelScope::check();  // of the caller: the other threads have none
        run_(context_, block);
      }
    } catch (...) {
      next_.store(count_, std::memory_order_relaxed);
      if (!has_error_.exchange(true)) error_ = std::current_exception();
    }
  }

  const std::int64_t count_;
  void (*const run_)(void*, std::int64_t);
  void* const context_;
  std::atomic<std::int64_t> next_{0};
  std::atomic<bool> has_error_{false};
  std::exception_ptr error_;  // the first one; read when the team is done
};

}  // namespace

const char* thread_backend() { return backend_name; }

int resolve_threads(int num_threads) { return num_threads > 0 ? num_threads : backend::usable_threads(); }

void run_blocks(std::int64_t num_blocks, int num_threads, void (*run)(void*, std::int64_t), void* context) {
  const std::int64_t threads = std::min<std::int64_t>({num_blocks, resolve_threads(num_threads), most_threads});
  if (threads <= 1) {
    for (std::int64_t block = 0; block < num_blocks; ++block) {
      CancelScope::check();
      run(context, block);
    }
    return;
  }
  Blocks blocks(num_blocks, run, context);
  backend::run_team(static_cast<int>(threads), Blocks::work_on, &blocks);
  blocks.rethrow();
}

}  // namespace nacre
