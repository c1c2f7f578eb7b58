// Is a registration right? The only place where a pose is believed or not: of a frame, of a loop, of the best motion
// that a search found, of a place that several views speak for. It rests on what the two sides say about each other,
// not on ICP's own opinion.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "nacre/global_registration.hpp"
#include "registration/icp.hpp"

namespace nacre {

// What speaks for a place before anything is registered there: the less, the more is asked of the registration.
enum class Expectation {
  expected,    // near a guess, from the frame before
  near_lost,   // near the last pose, but frames have been lost since
  beside,      // at one of several places beside the last pose
  only_near,   // of these and those near the guesses, the only one that comes near fitting
  confirmed,   // where registration to the frame before leads, too
  unexpected,  // far from all guesses
  only_place,  // of all places, which a search has compared, the only one: see accept_best
};

// How far the brightness of two sides goes together: see tracking/likeness.hpp.
struct Likeness {
  double agreement = 0.0;    // at most 1; by chance 0, with a standard deviation of 1 / sqrt(num_squares)
  double num_squares = 0.0;  // of the image, that tell; 0: nothing is known
};

// Of what either side should see of the other, the part that it does not see through.
struct Consistency {
  double of_target = 1.0;  // of the target's points, in the source's image
  double of_source = 1.0;  // of the source's points, in the last image of the target; 1 where that shows too few
  Likeness likeness = {};

  // What both see through, together.
  double contradiction() const { return (1.0 - of_target) + (1.0 - of_source); }
};

struct AcceptanceOptions {
  double min_score;
  bool verify;
  std::optional<Consistency> usual;  // the mean of what has been accepted, where it is known
  double moving = 0.0;               // part of the source that is left out, since it moves
};

enum class Decision {
  rejected,
  undetermined,  // right as far as it goes: directions of the pose are open
  accepted,
};

// The test of one registration.
struct Acceptance {
  Decision decision = Decision::rejected;
  std::string reason;  // why it is not accepted
  double score = 0.0;
  double relocalisation_score = 0.0;
  // Most of the source matches, closely, and nothing contradicts: no other guess needs to be tried.
  bool is_clear_cut = false;
  // Neither score comes near what is asked of any place: where a few points say so, all need not be asked.
  bool is_hopeless = false;
};

// The registration score is what the matches tell against chance: for each a residual that is small among those that
// would have matched, ln(0.58 / ratio), where chance gives a ratio of 0.58; times overlap^2, since any two surfaces
// touch somewhere, and consistency^4, since true ones contradict nowhere; by misfit^2 where it is above 1, since a
// shape that only resembles is bent another way. Once it is known how much right places contradict, near a guess
// the usual contradictions to these ones, of either side, take the place of consistency^4, and overlap that of its
// square: what is new is told from what should match and does not. After a loss more is asked for. Beside the last
// pose misfit above half counts, too; far from all guesses, where many places resemble, so does consistency^12, and the
// score is the lower, the more of the matches lie on three planes: see share_off_planes.
//
// Where the two sides look alike, as the brightness of registered frames and what they fit has done, a place is as good
// as one that another registration confirms, wherever it is. Where they look no more alike than chance makes them,
// though registered frames did, it is none: but near a guess, unless noise tells more there than the shapes do.
//
// What is left out, since it moves, tells nothing: both scores count as much as is left.
//
// The relocalisation score is that of a place that nothing but the source speaks for. New surface does not speak
// against it (overlap, not its square), contradictions and misfit do the more (consistency^12, misfit^4), and what the
// residuals tell counts as much as the normals agree (see normal_information) and as matches are off three planes.
//
// Where the camera makes few contradictions, few are believed far from all guesses: taken as exponentially distributed,
// with one mean where places are right, as has been seen, and another where they are wrong, both scores are multiplied
// by the ratio of the two likelihoods where it speaks against the place.
//
// Directions that the source leaves open (weak) are taken from a guess; far from all guesses there is none, and the
// pose is rejected.
//
// A source that is clearly larger or smaller than what it fits is lost: its depth is wrong, or it is another thing.
//
// A registration score of min_score is enough where everything speaks for the place; without `verify` whatever matches
// is accepted.
Acceptance accept(const IcpResult& alignment, const Consistency& consistency, Expectation expectation,
                  const AcceptanceOptions& options);

// Views of one place, each of which may say too little alone (a sequential test, Wald 1945).
class PlaceOdds {
 public:
  // A view with a relocalisation score, as far from those before as `novelty` says (1: another view altogether).
  void add(double relocalisation_score, double novelty);
  // Whether there is enough to believe in the place, after this view: which speaks for it, too.
  bool is_enough(double relocalisation_score, Expectation expectation) const;
  bool is_against() const { return log_odds_ < 0.0; }

  // Whether a view says more than chance does.
  static bool is_for(double relocalisation_score);

 private:
  friend struct PrivateState;
  double log_odds_ = 0.0;
  int num_views_ = 0;
};

// One of the motions that a search found, and how well the two sides explain each other there.
struct SearchFit {
  double score, overlap, consistency;
  bool is_close;  // its residuals are within what the search takes for one surface; others are no rivals
};

struct SearchAcceptance {
  GlobalAlignStatus status;  // found, ambiguous or not_found
  std::size_t best;          // the first close one, or the first of all
  double rivalry;            // score of the next close one, as a part of the best's
};

// Fits differ from each other, the one of the highest score first. The best is believed where it agrees, and no other
// comes near it: all places have been compared.
SearchAcceptance accept_best(const std::vector<SearchFit>& fits, double min_overlap, double min_consistency,
                             double max_rivalry);

// The same, and where others come near the best one these, too: each of which would be believed without the others.
std::vector<std::size_t> accept_rivals(const std::vector<SearchFit>& fits, double min_overlap, double min_consistency,
                                       double max_rivalry);

// Of rivals the only one that looks more alike than chance makes it; a single fit needs not.
std::optional<std::size_t> only_alike(const std::vector<Likeness>& rivals);

}  // namespace nacre
