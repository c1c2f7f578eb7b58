// Raw images of 16 bits and any scale.
#include "options.hpp"

NACRE_FUZZ_TARGET(bytes) {
  using Raw = Eigen::Array<std::uint16_t, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Raw raw(bytes.integer(0, 20), bytes.integer(0, 20));
  for (Eigen::Index i = 0; i < raw.size(); ++i) raw.data()[i] = bytes.raw<std::uint16_t>();
  const double scale = bytes.number();
  const nacre::DepthImage depth = nacre::depth_from_raw(raw, scale);
  NACRE_HOLDS(depth.rows() == raw.rows() && depth.cols() == raw.cols());
  for (Eigen::Index i = 0; i < raw.size(); ++i) {
    const bool is_missing = raw.data()[i] == 0 || raw.data()[i] == 65535;
    NACRE_HOLDS(std::isnan(depth.data()[i]) == is_missing);
  }
}
