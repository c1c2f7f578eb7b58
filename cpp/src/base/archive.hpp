// State as bytes and back. What a struct holds is named once, in its `exchange`, which serves both ways:
//
//   template <class Archive>
//   void exchange(Archive& archive, Thing& thing) { archive(thing.size, thing.points); }
//
// Numbers are little endian. Whole numbers on their own, and counts, take as many bytes as they need: 7 bits a byte,
// the lowest first. Nothing is allocated that the bytes that are left cannot fill.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "nacre/checkpoint.hpp"

namespace nacre {

#if defined(__BYTE_ORDER__) && __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "saved models are little endian: archive.hpp has to turn the bytes of every number around"
#endif

namespace archive_detail {

template <class T>
struct IsFixedMatrix : std::false_type {};
template <class S, int R, int C, int O, int MR, int MC>
struct IsFixedMatrix<Eigen::Matrix<S, R, C, O, MR, MC>>
    : std::bool_constant<R != Eigen::Dynamic && C != Eigen::Dynamic> {};

// Copied byte by byte.
template <class T>
inline constexpr bool is_plain = (std::is_arithmetic_v<T> && !std::is_same_v<T, bool>) || IsFixedMatrix<T>::value;

// Whole numbers: 0, -1, 1, -2, 2, ... are 0, 1, 2, 3, 4, ..., so that small ones are short.
inline std::uint64_t folded(std::int64_t value) {
  return (static_cast<std::uint64_t>(value) << 1) ^ static_cast<std::uint64_t>(value >> 63);
}
inline std::int64_t unfolded(std::uint64_t bits) { return static_cast<std::int64_t>((bits >> 1) ^ (~(bits & 1) + 1)); }

// Written by its own `exchange`.
template <class T>
inline constexpr bool is_struct = std::is_class_v<T> && !std::is_base_of_v<Eigen::EigenBase<T>, T>;

}  // namespace archive_detail

class StateWriter {
 public:
  static constexpr bool is_reading = false;

  explicit StateWriter(std::string& bytes) : bytes_(bytes) {}

  template <class... Ts>
  void operator()(Ts&... values) {
    (put(values), ...);
  }
  template <class Enum>
  void choice(Enum& value, Enum /*last*/) {
    put_plain(static_cast<std::uint8_t>(value));
  }
  // In single precision.
  template <class... Ts>
  void single(Ts&... values) {
    (put_plain(static_cast<float>(values)), ...);
  }
  void require(bool /*condition*/, const char* /*what*/) const {}

 private:
  void put_bytes(const void* data, std::size_t size) {
    if (size > 0) bytes_.append(static_cast<const char*>(data), size);
  }
  template <class T>
  void put_plain(const T& value) {
    put_bytes(&value, sizeof(T));
  }
  void put_number(std::uint64_t number) {
    for (; number >= 0x80; number >>= 7) put_plain(static_cast<std::uint8_t>(number | 0x80));
    put_plain(static_cast<std::uint8_t>(number));
  }

  void put(bool& value) { put_plain(static_cast<std::uint8_t>(value)); }
  void put(std::string& value) {
    put_number(value.size());
    put_bytes(value.data(), value.size());
  }
  template <class T>
  void put(std::optional<T>& value) {
    bool has_value = value.has_value();
    put(has_value);
    if (value) put(*value);
  }
  template <class T>
  void put(std::vector<T>& values) {
    put_number(values.size());
    if constexpr (archive_detail::is_plain<T>) {
      put_bytes(values.data(), values.size() * sizeof(T));
    } else {
      for (T& value : values) put(value);
    }
  }
  template <class T, std::size_t N>
  void put(std::array<T, N>& values) {
    for (T& value : values) put(value);
  }
  template <class Derived>
  void put(Eigen::PlainObjectBase<Derived>& matrix) {
    using Scalar = typename Derived::Scalar;
    if constexpr (Derived::SizeAtCompileTime == Eigen::Dynamic) {
      put_number(static_cast<std::size_t>(matrix.rows()));
      put_number(static_cast<std::size_t>(matrix.cols()));
    }
    put_bytes(matrix.data(), static_cast<std::size_t>(matrix.size()) * sizeof(Scalar));
  }
  template <class T>
  std::enable_if_t<std::is_floating_point_v<T>> put(T& value) {
    put_plain(value);
  }
  template <class T>
  std::enable_if_t<std::is_integral_v<T>> put(T& value) {
    if constexpr (std::is_signed_v<T>) {
      put_number(archive_detail::folded(value));
    } else {
      put_number(value);
    }
  }
  template <class T>
  std::enable_if_t<archive_detail::is_struct<T>> put(T& value) {
    exchange(*this, value);
  }

  std::string& bytes_;
};

class StateReader {
 public:
  static constexpr bool is_reading = true;

  // The numbers that errors tell count from the beginning of all bytes.
  StateReader(std::string_view bytes, std::size_t begin) : bytes_(bytes), next_(begin) {}

  template <class... Ts>
  void operator()(Ts&... values) {
    (get(values), ...);
  }
  template <class Enum>
  void choice(Enum& value, Enum last) {
    std::uint8_t number = 0;
    get_plain(number);
    require(number <= static_cast<std::uint8_t>(last), "a choice is none of those there are");
    value = static_cast<Enum>(number);
  }
  template <class... Ts>
  void single(Ts&... values) {
    (get_single(values), ...);
  }
  void require(bool condition, const char* what) const {
    if (!condition) fail(what);
  }
  [[noreturn]] void fail(const std::string& what) const {
    throw CheckpointError(what, static_cast<std::int64_t>(next_));
  }
  void require_end() const { require(next_ == bytes_.size(), "there is more than the model"); }
  std::size_t left() const { return bytes_.size() - next_; }

 private:
  void get_bytes(void* data, std::size_t size) {
    require(size <= left(), "it ends within an array");
    if (size > 0) std::memcpy(data, bytes_.data() + next_, size);
    next_ += size;
  }
  template <class T>
  void get_plain(T& value) {
    get_bytes(&value, sizeof(T));
  }
  void get_single(double& value) {
    float single = 0.0F;
    get_plain(single);
    value = static_cast<double>(single);
  }
  std::uint64_t get_number() {
    std::uint64_t number = 0;
    std::uint8_t byte = 0x80;
    for (int shift = 0; (byte & 0x80) != 0; shift += 7) {
      get_plain(byte);
      const auto bits = static_cast<std::uint64_t>(byte & 0x7F);
      require(shift < 63 || (shift == 63 && bits <= 1), "a whole number has more than 64 bits");
      number |= bits << shift;
    }
    return number;
  }
  // Of items that take at least so many bytes each.
  std::size_t get_count(std::size_t item) {
    const std::uint64_t count = get_number();
    require(count <= left() / item, "an array is longer than what is left");
    return static_cast<std::size_t>(count);
  }

  void get(bool& value) {
    std::uint8_t number = 0;
    get_plain(number);
    require(number <= 1, "a yes or no is neither");
    value = number == 1;
  }
  void get(std::string& value) {
    value.resize(get_count(1));
    get_bytes(value.data(), value.size());
  }
  template <class T>
  void get(std::optional<T>& value) {
    bool has_value = false;
    get(has_value);
    value.reset();
    if (!has_value) return;
    T kept{};  // emplace() of a nested class with default values is what Clang does not compile
    get(kept);
    value = std::move(kept);
  }
  template <class T>
  void get(std::vector<T>& values) {
    values.clear();
    if constexpr (archive_detail::is_plain<T>) {
      values.resize(get_count(sizeof(T)));
      get_bytes(values.data(), values.size() * sizeof(T));
    } else {
      const std::size_t count = get_count(1);  // of unknown size: they are allocated one by one
      for (std::size_t i = 0; i < count; ++i) get(values.emplace_back());
    }
  }
  template <class T, std::size_t N>
  void get(std::array<T, N>& values) {
    for (T& value : values) get(value);
  }
  template <class Derived>
  void get(Eigen::PlainObjectBase<Derived>& matrix) {
    using Scalar = typename Derived::Scalar;
    if constexpr (Derived::SizeAtCompileTime == Eigen::Dynamic) {
      constexpr std::uint64_t largest = std::uint64_t{1} << 40;
      const std::uint64_t rows = get_number(), cols = get_number();
      const bool has_rows = Derived::RowsAtCompileTime == Eigen::Dynamic ||
                            rows == static_cast<std::uint64_t>(Derived::RowsAtCompileTime);
      const bool has_cols = Derived::ColsAtCompileTime == Eigen::Dynamic ||
                            cols == static_cast<std::uint64_t>(Derived::ColsAtCompileTime);
      require(has_rows && has_cols, "a matrix has another shape");
      require(rows < largest && cols < largest && (rows == 0 || cols <= left() / sizeof(Scalar) / rows),
              "a matrix is larger than what is left");
      matrix.resize(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(cols));
    }
    get_bytes(matrix.data(), static_cast<std::size_t>(matrix.size()) * sizeof(Scalar));
  }
  template <class T>
  std::enable_if_t<std::is_floating_point_v<T>> get(T& value) {
    get_plain(value);
  }
  template <class T>
  std::enable_if_t<std::is_integral_v<T>> get(T& value) {
    const std::uint64_t bits = get_number();
    if constexpr (std::is_signed_v<T>) {
      const std::int64_t number = archive_detail::unfolded(bits);
      value = static_cast<T>(number);
      require(value == number, "a whole number is too large");
    } else {
      value = static_cast<T>(bits);
      require(value == bits, "a whole number is too large");
    }
  }
  template <class T>
  std::enable_if_t<archive_detail::is_struct<T>> get(T& value) {
    exchange(*this, value);
  }

  std::string_view bytes_;
  std::size_t next_;
};

}  // namespace nacre
