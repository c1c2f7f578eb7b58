// What a fuzz target reads from the fuzzer's bytes: numbers of every kind, and clouds, images and options made of them.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <vector>

#include "nacre/camera.hpp"
#include "nacre/cancel.hpp"
#include "nacre/kdtree.hpp"
#include "nacre/types.hpp"

#define NACRE_HOLDS(condition)                                                            \
  do {                                                                                    \
    if (!(condition)) {                                                                   \
      std::fprintf(stderr, "%s:%d: does not hold: %s\n", __FILE__, __LINE__, #condition); \
      std::abort();                                                                       \
    }                                                                                     \
  } while (false)

namespace nacre_fuzz {

using namespace nacre;

// Calls what may throw std::invalid_argument; anything else that is thrown ends the process.
template <class Call>
bool runs(Call&& call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    NACRE_HOLDS(*error.what() != '\0');
    return false;
  }
  return true;
}

// After the last byte come zeros, so that every input is complete.
class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : next_(data), end_(data + size) {}

  std::uint8_t byte() { return next_ == end_ ? std::uint8_t{0} : *next_++; }
  bool boolean() { return (byte() & 1) != 0; }
  template <class T>
  T raw() {
    unsigned char bytes[sizeof(T)];
    for (unsigned char& one : bytes) one = byte();
    T value;
    std::memcpy(&value, bytes, sizeof value);
    return value;
  }
  int integer(int from, int to) { return from + static_cast<int>(raw<std::uint16_t>() % (to - from + 1)); }
  template <class Enum>
  Enum one_of(int count) {
    return static_cast<Enum>(byte() % count);
  }

  // Of every kind: ordinary ones of either sign, limits, denormals, not finite, any bits.
  double number() {
    constexpr double inf = std::numeric_limits<double>::infinity();
    static const double special[] = {0.0,
                                     -0.0,
                                     1.0,
                                     -1.0,
                                     0.5,
                                     2.0,
                                     1e-3,
                                     1e-12,
                                     1e12,
                                     1e-30,
                                     1e30,
                                     1e38,
                                     -1e38,
                                     3.5e38,
                                     1e-45,
                                     1e150,
                                     1e-150,
                                     1e300,
                                     -1e300,
                                     5e-324,
                                     1e-308,
                                     inf,
                                     -inf,
                                     std::nan(""),
                                     2147483647.0,
                                     -2147483648.0,
                                     4294967296.0,
                                     1e10,
                                     16777216.0,
                                     1e-7,
                                     3.1415926535897931,
                                     255.0};
    const int kind = byte();
    if (kind < 128) return (static_cast<double>(raw<std::uint16_t>()) - 32768.0) / 4096.0;
    if (kind < 192) return raw<std::uint16_t>() / 65536.0;
    if (kind < 240) return special[byte() % (sizeof special / sizeof *special)];
    if (kind < 248) return static_cast<double>(raw<float>());
    return raw<double>();
  }
  // An option: most often as it is.
  void change(double& option) {
    if (byte() >= 224) option = number();
  }
  void change(bool& option) {
    if (byte() >= 192) option = !option;
  }
  void change(int& option, int from, int to) {
    if (byte() >= 208) option = integer(from, to);
  }
  template <class Enum>
  void change_to(Enum& option, int count) {
    if (byte() >= 128) option = one_of<Enum>(count);
  }

  float coordinate() { return static_cast<float>(limited(number())); }

  // Up to `most` rows: scattered, on a plane, a line, a grid, in one place, far off; some of them anything.
  template <class Matrix>
  Matrix rows(int most) {
    using Scalar = typename Matrix::Scalar;
    const int count = integer(0, most);
    Matrix points(count, 3);
    const int shape = byte() % 6;
    std::uint64_t state = byte();
    const double size = boolean() ? 1.0 : number(), center = boolean() ? 0.0 : number();
    for (int i = 0; i < count; ++i) {
      for (int axis = 0; axis < 3; ++axis) {
        const int number_on_grid = axis == 0 ? i % 7 : axis == 1 ? i / 7 % 7 : i / 49;
        double value = random(state);
        if (shape == 1 && axis == 2) value = 0.0;
        if (shape == 2) value = axis == 0 ? value : 0.25;
        if (shape == 3) value = 0.125 * number_on_grid;
        if (shape == 4) value = 0.25;
        if (shape == 5) value = axis == 2 ? 0.1 * static_cast<double>(points(i, 0) * points(i, 0)) : value;
        points(i, axis) = static_cast<Scalar>(limited<Scalar>(center + size * value));
      }
    }
    for (int left = byte() % 16; left > 0 && count > 0; --left) {
      const int row = integer(0, count - 1), axis = byte() % 3;
      points(row, axis) = static_cast<Scalar>(limited<Scalar>(number()));
    }
    return points;
  }
  Points points(int most) { return rows<Points>(most); }

  // As many unit vectors, or none, or too few; some of them anything.
  Points normals(Eigen::Index count) {
    const int kind = byte() % 8;
    if (kind == 0) return Points(0, 3);
    if (kind == 1) return Points::Constant(count / 2, 3, 1.0F);
    Points normals(count, 3);
    std::uint64_t state = byte();
    for (Eigen::Index i = 0; i < count; ++i) {
      const Eigen::Vector3d any(random(state) - 0.5, random(state) - 0.5, random(state) - 0.5);
      normals.row(i) = (kind < 5 ? any.normalized() : Eigen::Vector3d::UnitZ().eval()).cast<float>().transpose();
    }
    for (int left = byte() % 4; left > 0 && count > 0; --left) {
      normals(integer(0, static_cast<int>(count) - 1), byte() % 3) = coordinate();
    }
    return normals;
  }

  Values values(Eigen::Index count) {
    const int kind = byte() % 4;
    if (kind == 0) return Values(0);
    Values values = Values::Constant(kind == 1 ? count : kind == 2 ? count + 1 : count, coordinate());
    for (int left = byte() % 8; left > 0 && count > 0; --left) {
      values(integer(0, static_cast<int>(count) - 1)) = coordinate();
    }
    return values;
  }

  // A motion, or a matrix that is none.
  Pose pose() {
    Pose pose = Pose::Identity();
    if (boolean()) return pose;
    const Eigen::Vector3d axis(number(), number(), number());
    const double length = axis.norm();
    if (length > 0.0 && length < 10.0) {
      pose.linear() = Eigen::AngleAxisd(length, axis / length).toRotationMatrix();
    }
    if (boolean()) pose.translation() << number(), number(), number();
    if (byte() >= 240) pose.matrix()(byte() % 4, byte() % 4) = number();
    return pose;
  }

  // Throws std::invalid_argument where there is no such camera.
  Camera camera(int largest = 48) {
    const bool any = byte() >= 224;
    const int width = any ? integer(-1, 3) : integer(1, largest), height = any ? integer(-1, 3) : integer(1, largest);
    if (byte() >= 208) return Camera::orthographic(width, height, boolean() ? 0.002 : number());
    Camera::Distortion distortion{};
    if (byte() >= 192) {
      for (double& coefficient : distortion) coefficient = boolean() ? 0.1 * number() : number();
    }
    double fx = 1.2 * width, fy = 1.2 * width, cx = 0.5 * width, cy = 0.5 * height;
    change(fx), change(fy), change(cx), change(cy);
    return Camera::pinhole(width, height, fx, fy, cx, cy, distortion, one_of<DepthKind>(2));
  }

  // Of a camera's size, hardly ever of another: planes, steps, waves, noise; some pixels anything.
  DepthImage depth(const Camera& camera) {
    const bool other = byte() >= 252;
    const Eigen::Index width = camera.width() + (other ? integer(-1, 1) : 0);
    const Eigen::Index height = camera.height() + (other ? integer(-1, 1) : 0);
    DepthImage depth(height, width);
    const int scene = byte() % 8;
    double base = 1.0;
    change(base);
    double slope_x = raw<std::int8_t>() / 4096.0, slope_y = raw<std::int8_t>() / 4096.0;
    double noise = byte() / 65536.0;
    change(slope_x), change(noise);
    std::uint64_t state = byte();
    for (Eigen::Index v = 0; v < height; ++v) {
      for (Eigen::Index u = 0; u < width; ++u) {
        const auto x = static_cast<double>(u), y = static_cast<double>(v);
        double z = base * (1.0 + slope_x * x + slope_y * y);
        if (scene == 1 && u > width / 3 && v > height / 3 && u < 2 * width / 3) z *= 0.8;
        if (scene == 2) z += 0.05 * std::sin(0.4 * x) * std::cos(0.3 * y);
        if (scene == 3) z = random(state) * base;
        if (scene == 4 && (u + v) % 3 == 0) z = std::nan("");
        if (scene == 5) z = std::nan("");
        if (scene == 6)
          z -= 0.3 * std::sqrt(std::max(0.0, 1.0 - std::pow(x / 12.0 - 2.0, 2) - std::pow(y / 12.0 - 2.0, 2)));
        depth(v, u) = static_cast<float>(limited(z + noise * (random(state) - 0.5)));
      }
    }
    for (int left = byte() % 32; left > 0 && depth.size() > 0; --left) {
      const Eigen::Index v = byte() % height, u = byte() % width;
      const Eigen::Index rows = std::min<Eigen::Index>(1 + byte() % 4, height - v);
      depth.block(v, u, rows, std::min<Eigen::Index>(rows, width - u)).setConstant(coordinate());
    }
    return depth;
  }

  // None, of the camera's size, or of another.
  MaskImage mask(const Camera& camera) {
    const int kind = byte();
    if (kind < 160) return {};
    MaskImage mask = MaskImage::Constant(camera.height() + (kind >= 252), camera.width(), std::uint8_t{boolean()});
    for (int left = byte() % 8; left > 0 && mask.size() > 0; --left) {
      mask.bottomRightCorner(byte() % mask.rows(), byte() % mask.cols()).setConstant(byte());
    }
    return mask;
  }

  int threads() { return byte() < 224 ? 1 : integer(0, 3); }

 private:
  // What a conversion to Scalar is defined for.
  template <class Scalar = float>
  static double limited(double value) {
    const double largest = static_cast<double>(std::numeric_limits<Scalar>::max());
    if (value > largest) return std::numeric_limits<double>::infinity();
    return value < -largest ? -std::numeric_limits<double>::infinity() : value;
  }
  static double random(std::uint64_t& state) {
    state = state * 6364136223846793005U + 1442695040888963407U;
    return static_cast<double>(state >> 11) / 9007199254740992.0;
  }

  const std::uint8_t* next_;
  const std::uint8_t* end_;
};

}  // namespace nacre_fuzz

// What a target defines; misuse that is documented to throw ends an input, not the run.
#define NACRE_FUZZ_TARGET(bytes)                                                      \
  static void fuzz(nacre_fuzz::Bytes& bytes);                                         \
  extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);  \
  extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) { \
    nacre_fuzz::Bytes input(data, size);                                              \
    nacre_fuzz::runs([&] { fuzz(input); });                                           \
    return 0;                                                                         \
  }                                                                                   \
  static void fuzz(nacre_fuzz::Bytes& bytes)
