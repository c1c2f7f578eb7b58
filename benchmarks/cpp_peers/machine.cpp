// What this machine gives: memory bandwidth, float operations, and the time of a load that depends on the one before.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <numeric>
#include <random>
#include <thread>
#include <vector>

namespace {

template <class Body>
double seconds(int threads, Body body) {
  const auto start = std::chrono::steady_clock::now();
  std::vector<std::thread> others;
  for (int t = 1; t < threads; ++t) others.emplace_back(body, t);
  body(0);
  for (auto& thread : others) thread.join();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

typedef float Vector __attribute__((vector_size(32)));

volatile float sink_value;
volatile std::uint32_t sink_index;

}  // namespace

// a = b + s c over 3 arrays of 256 MiB in all; bytes a second, counting three arrays, best of five.
extern "C" double triad(int threads) {
  const std::size_t size = (std::size_t{256} << 20) / 3 / sizeof(float);
  std::vector<float> a(size, 1.0F), b(size, 2.0F), c(size, 3.0F);
  double best = 1e9;
  for (int repeat = 0; repeat < 5; ++repeat) {
    const float s = static_cast<float>(repeat);
    best = std::min(best, seconds(threads, [&](int t) {
                      const std::size_t last = size * (t + 1) / threads;
                      float* __restrict x = a.data();
                      const float* __restrict y = b.data(), * __restrict z = c.data();
                      for (std::size_t i = size * t / threads; i < last; ++i) x[i] = y[i] + s * z[i];
                    }));
  }
  sink_value = a[size / 2];
  return 3.0 * static_cast<double>(size * sizeof(float)) / best;
}

// Multiply-adds of float on 12 independent registers of 8; operations a second (two each), best of five.
extern "C" double multiply_add(int threads) {
  constexpr int rounds = 4000000, registers = 12;
  double best = 1e9;
  for (int repeat = 0; repeat < 5; ++repeat) {
    best = std::min(best, seconds(threads, [](int t) {
                      Vector sums[registers], factor, term;
                      for (int lane = 0; lane < 8; ++lane) factor[lane] = 0.999F, term[lane] = 0.001F * t;
                      for (int r = 0; r < registers; ++r) sums[r] = term + static_cast<float>(r);
                      for (int round = 0; round < rounds; ++round) {
#pragma GCC unroll 12
                        for (int r = 0; r < registers; ++r) sums[r] = sums[r] * factor + term;
                      }
                      for (int r = 1; r < registers; ++r) sums[0] += sums[r];
                      sink_value = sums[0][0] + sums[0][7];
                    }));
  }
  return 2.0 * 8 * registers * static_cast<double>(rounds) * threads / best;
}

// Seconds a load whose address comes from the load before, in a random cycle through `bytes`.
extern "C" double load_latency(std::int64_t bytes) {
  const auto size = static_cast<std::size_t>(bytes) / 64;
  struct alignas(64) Line {
    std::uint32_t next;
  };
  std::vector<std::uint32_t> order(size);
  std::iota(order.begin(), order.end(), 0U);
  std::shuffle(order.begin(), order.end(), std::mt19937(1));
  std::vector<Line> lines(size);
  for (std::size_t i = 0; i < size; ++i) lines[order[i]].next = order[(i + 1) % size];
  constexpr int steps = 1000000;
  std::uint32_t at = 0;
  for (std::size_t i = 0; i < std::min<std::size_t>(size, steps); ++i) at = lines[at].next;
  const double time = seconds(1, [&](int) {
    for (int i = 0; i < steps; ++i) at = lines[at].next;
  });
  sink_index = at;
  return time / steps;
}
