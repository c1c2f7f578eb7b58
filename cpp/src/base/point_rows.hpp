// Rows of three coordinates, one after the other, whatever matrix they come from.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <vector>

namespace nacre {

template <class T>
using PointMatrix = Eigen::Matrix<T, Eigen::Dynamic, 3, Eigen::RowMajor>;

// The given rows of a matrix or vector, in this order; nothing where it is empty.
template <class Matrix, class Index>
Matrix take_rows(const Eigen::Ref<const Matrix>& values, const std::vector<Index>& rows) {
  if (values.rows() == 0) return Matrix(0, values.cols());
  Matrix chosen(static_cast<Eigen::Index>(rows.size()), values.cols());
  for (std::size_t i = 0; i < rows.size(); ++i) chosen.row(static_cast<Eigen::Index>(i)) = values.row(rows[i]);
  return chosen;
}

template <class T>
class Rows {
 public:
  Rows(const Eigen::Ref<const PointMatrix<T>>& points) : data_(points.data()), size_(points.rows()) {
    if (points.outerStride() == 3 || size_ < 2) return;
    copy_ = points;
    data_ = copy_.data();
  }
  Rows(const Rows&) = delete;
  Rows& operator=(const Rows&) = delete;

  const T* data() const { return data_; }
  std::int64_t size() const { return size_; }
  const T* operator[](std::int64_t row) const { return data_ + 3 * row; }
  Eigen::Vector3d position(std::int64_t row) const {
    return Eigen::Map<const Eigen::Matrix<T, 3, 1>>(data_ + 3 * row).template cast<double>();
  }
  bool is_finite(std::int64_t row) const { return position(row).allFinite(); }

 private:
  PointMatrix<T> copy_;
  const T* data_;
  std::int64_t size_;
};

}  // namespace nacre
