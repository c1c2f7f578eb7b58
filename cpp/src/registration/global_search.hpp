// The search of align_global: many short registrations, fewer longer ones, and how well each motion explains the
// clouds.
#pragma once

#include <optional>
#include <vector>

#include "registration/correspondences.hpp"
#include "registration/denoised_cloud.hpp"
#include "registration/range_image.hpp"
#include "registration/view_agreement.hpp"

namespace nacre {

// A cloud in both roles: what moves and what others are matched with.
struct SearchSide {
  DenoisedCloud cloud;
  IcpSource all, few;
  IcpTarget target;
  std::optional<FreeSpace> seen;                     // from the viewpoint
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();  // about that of the body, of which the cloud may show the front

  SearchSide(const GlobalCloud& cloud, const GlobalAlignOptions& options, bool is_noisy);
};

// Whether there is enough to search with.
bool is_enough(const SearchSide& side);

struct SearchCandidate {
  AlignResult alignment;
  ViewAgreement forward, backward;  // of the source's points, of the target's
  double score = -10.0;
};

class GlobalSearch {
 public:
  // Keeps references to its arguments.
  GlobalSearch(const SearchSide& source, const SearchSide& target, const GlobalAlignOptions& options);

  // The best motions that differ from each other, best first.
  std::vector<SearchCandidate> run() const;

  double tolerance() const { return tolerance_; }

 private:
  SearchCandidate start_from(int number) const;
  void refine(SearchCandidate& candidate) const;
  void score(SearchCandidate& candidate, bool with_few, double tolerance) const;
  bool is_same(const Pose& a, const Pose& b) const;
  std::vector<SearchCandidate> best_different(std::vector<SearchCandidate> candidates, std::size_t most) const;

  const SearchSide& source_;
  const SearchSide& target_;
  const GlobalAlignOptions& options_;
  double size_;       // diameter of the smaller cloud [m]
  double tolerance_;  // [m]
};

// What becomes of the candidates of a search.
struct GlobalAcceptance {
  GlobalAlignStatus status;
  SearchCandidate best;
  double overlap, consistency, rivalry;  // see GlobalAlignResult
  std::vector<Pose> rivals;              // the best one, and others that are believed as well as it is
};
GlobalAcceptance accept_motion(const std::vector<SearchCandidate>& candidates, const GlobalAlignOptions& options,
                               double tolerance);

}  // namespace nacre
