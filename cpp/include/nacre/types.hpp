/// The few types that every part of nacre shares.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>

// Memory of Eigen objects passes between the library and its client, so both must allocate it alike, whatever vector
// flags each is built with. CMake and pkg-config give the definitions.
static_assert(EIGEN_MAX_ALIGN_BYTES <= 16 && EIGEN_MALLOC_ALREADY_ALIGNED,
              "to use nacre, compile with -DEIGEN_MAX_ALIGN_BYTES=16 -DEIGEN_MALLOC_ALREADY_ALIGNED=1");

namespace nacre {

/// N x 3 float coordinates [m], one point a row, contiguous: the layout of a NumPy array.
using Points = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;
/// Such an array of the caller's, not copied.
using PointsRef = Eigen::Ref<const Points>;

/// The same in double precision, for coordinates far from the origin.
using PointsDouble = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
using PointsDoubleRef = Eigen::Ref<const PointsDouble>;

/// N x 3 colours, red green blue.
using Colors = Eigen::Matrix<std::uint8_t, Eigen::Dynamic, 3, Eigen::RowMajor>;
using ColorsRef = Eigen::Ref<const Colors>;

/// N x A values that travel with points (normals, colours, intensities), one point a row.
using Attributes = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using AttributesRef = Eigen::Ref<const Attributes>;

/// One value a point.
using Values = Eigen::Matrix<float, Eigen::Dynamic, 1>;
using ValuesRef = Eigen::Ref<const Values>;

/// height x width float depth [m]; NaN means "no measurement".
using DepthImage = Eigen::Array<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using DepthRef = Eigen::Ref<const DepthImage>;

/// height x width; a pixel is used where the mask is not 0. An empty mask uses every pixel.
using MaskImage = Eigen::Array<std::uint8_t, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using MaskRef = Eigen::Ref<const MaskImage>;

/// A rigid motion, named target_from_source: p_target = target_from_source * p_source.
/// Unaligned, so that a client built with other vector flags shares its layout.
using Pose = Eigen::Transform<double, 3, Eigen::Isometry, Eigen::DontAlign>;

/// Of twists: rotation [rad] first, then translation [m].
using Matrix6 = Eigen::Matrix<double, 6, 6, Eigen::DontAlign>;
/// A twist: rotation [rad] first, then translation [m].
using Vector6 = Eigen::Matrix<double, 6, 1, Eigen::DontAlign>;

}  // namespace nacre
