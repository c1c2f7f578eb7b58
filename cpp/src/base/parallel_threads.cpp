// A pool of threads that sleep when there is nothing to do, and that a forked process makes anew.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <cstdlib>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

#include "base/parallel_backend.hpp"

#if defined(__unix__) || defined(__APPLE__)
#define NACRE_POSIX
#include <pthread.h>
#include <signal.h>
#endif
#ifdef __linux__
#include <sched.h>
#endif
#if defined(__x86_64__) || defined(_M_X64)
#include <emmintrin.h>
#endif

namespace nacre::threads {
namespace {

// A loop often follows another at once: waking a thread takes about as long.
constexpr std::chrono::microseconds spin_time{30};

void pause_briefly() {
#if defined(__x86_64__) || defined(_M_X64)
  _mm_pause();
#endif
}

// Waits a short time for a condition; returns whether it holds.
template <class Condition>
bool spin_until(Condition&& condition) {
  const auto end = std::chrono::steady_clock::now() + spin_time;
  do {
    for (int i = 0; i < 32; ++i) {
      if (condition()) return true;
      pause_briefly();
    }
  } while (std::chrono::steady_clock::now() < end);
  return false;
}

// One loop.
struct Job {
  TeamWork work;
  void* context;
  int free_places;                  // for threads that may still join; guarded by the pool's mutex
  std::atomic<int> num_helpers{0};  // who have joined and not left
};

class ThreadPool {
 public:
  void run(Job& job) {
    const int num_helpers = job.free_places;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      while (num_workers_ < num_helpers && start_worker()) {
      }
      jobs_.push_back(&job);
      num_posted_.fetch_add(1, std::memory_order_relaxed);
    }
    for (int i = 0; i < num_helpers; ++i) posted_.notify_one();
    job.work(job.context);
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      jobs_.erase(std::find(jobs_.begin(), jobs_.end(), &job));
    }
    const auto is_done = [&] { return job.num_helpers.load(std::memory_order_acquire) == 0; };
    if (!spin_until(is_done)) {
      std::unique_lock<std::mutex> lock(mutex_);
      left_.wait(lock, is_done);
    }
  }

  // Around a fork, so that the child gets a mutex that nobody holds.
  void lock() { mutex_.lock(); }
  void unlock() { mutex_.unlock(); }

 private:
  bool start_worker() {
#ifdef NACRE_POSIX
    // Signals are for the threads of the program.
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
#endif
    bool started = true;
    try {
      std::thread([this] { serve(); }).detach();
      ++num_workers_;
    } catch (const std::system_error&) {  // no more threads: fewer do
      started = false;
    }
#ifdef NACRE_POSIX
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
#endif
    return started;
  }

  void serve() {
    std::unique_lock<std::mutex> lock(mutex_);
    for (;;) {
      const auto job = std::find_if(jobs_.begin(), jobs_.end(), [](const Job* open) { return open->free_places > 0; });
      if (job == jobs_.end()) {
        const std::uint64_t seen = num_posted_.load(std::memory_order_relaxed);
        const auto is_posted = [&] { return num_posted_.load(std::memory_order_relaxed) != seen; };
        lock.unlock();
        const bool spun = spin_until(is_posted);
        lock.lock();
        if (!spun) posted_.wait(lock, is_posted);
        continue;
      }
      Job& joined = **job;
      --joined.free_places;
      joined.num_helpers.fetch_add(1, std::memory_order_relaxed);
      lock.unlock();
      joined.work(joined.context);
      lock.lock();
      // The caller may return, and the job be gone, as soon as the count is 0.
      joined.num_helpers.fetch_sub(1, std::memory_order_release);
      left_.notify_all();
    }
  }

  std::mutex mutex_;
  std::condition_variable posted_, left_;
  std::vector<Job*> jobs_;  // the loops that run, oldest first; guarded by the mutex
  std::atomic<std::uint64_t> num_posted_{0};
  int num_workers_ = 0;
};

// Never destroyed: its threads sleep in it until the process ends.
ThreadPool* the_pool = nullptr;

ThreadPool& pool() {
  static const bool once = [] {
    the_pool = new ThreadPool;
#ifdef NACRE_POSIX
    // A child process has none of its parent's threads, so it starts with a pool of its own.
    pthread_atfork([] { the_pool->lock(); }, [] { the_pool->unlock(); }, [] { the_pool = new ThreadPool; });
#endif
    return true;
  }();
  (void)once;
  return *the_pool;
}

int count_usable() {
  if (const char* text = std::getenv("OMP_NUM_THREADS")) {
    const int number = std::atoi(text);
    if (number > 0) return number;
  }
#ifdef __linux__
  cpu_set_t processors;
  if (sched_getaffinity(0, sizeof processors, &processors) == 0) return CPU_COUNT(&processors);
#endif
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

}  // namespace

int usable_threads() {
  static const int usable = count_usable();
  return usable;
}

void run_team(int num_threads, TeamWork work, void* context) {
  Job job;
  job.work = work;
  job.context = context;
  job.free_places = num_threads - 1;
  pool().run(job);
}

}  // namespace nacre::threads
