// Colour decides what shape leaves open: the directions of a pose that geometry does not determine.
#pragma once

#include <cstdint>
#include <memory>

#include "registration/color_field.hpp"
#include "registration/icp.hpp"

namespace nacre {

// The colours of two clouds that are registered. Target and options outlive it.
class ColorRegistration {
 public:
  ColorRegistration(const IcpTarget& target, IcpSource source, BrightCloud target_colors, BrightCloud source_colors,
                    const AlignOptions& options);
  ~ColorRegistration();
  ColorRegistration(ColorRegistration&&) noexcept;
  ColorRegistration& operator=(ColorRegistration&&) noexcept;

  std::int64_t num_samples() const;

  // What colours tell of a pose: see WeakTest.
  Matrix6 information(const IcpResult& geometric) const;

  // Where colours would move a registration, along its weak directions, in one step at the coarse level.
  Pose one_step(const IcpResult& geometric) const;

  // Continues a registration that has weak directions: moves the source along them until the brightness of the matched
  // points agrees, and brings it back onto the surface after each step. Directions that the brightness determines are
  // no longer weak; along the others, and where too few points have one, the pose stays as it was. What geometry
  // determines is never left to colour. Gain and offset between the two brightnesses are found along the way.
  IcpResult determine(const IcpResult& geometric) const;

 private:
  class Search;
  std::unique_ptr<Search> search_;  // none without normals
};

}  // namespace nacre
