/// Stopping calls that take long.
#pragma once

#include <chrono>
#include <functional>
#include <stdexcept>

namespace nacre {

/// What a call throws that was stopped before its end.
class Cancelled : public std::runtime_error {
 public:
  Cancelled();
  ~Cancelled() override;
};

/// While it lives, the calls of its thread ask `wanted` now and then whether to stop, and throw Cancelled where it says
/// so: a button, an atomic flag, a deadline.
///
/// `wanted` is asked on the thread that calls, about ten times a second; what it throws comes out of the call. A call
/// that is not stopped gives the same bits as without. Const objects are untouched, memory that a call writes to (as
/// KdTree::query_into does) is in parts. Model::add_frame is always brought to its end. Scopes may be nested: the
/// innermost is asked, and one without a function stops nothing.
class CancelScope {
 public:
  explicit CancelScope(std::function<bool()> wanted);
  ~CancelScope();
  CancelScope(const CancelScope&) = delete;
  CancelScope& operator=(const CancelScope&) = delete;

  /// Throws Cancelled where the innermost scope of this thread wants it; a loop of the caller's own may ask too.
  static void check();

 private:
  std::function<bool()> wanted_;
  std::chrono::steady_clock::time_point asked_;
  CancelScope* outer_;
};

}  // namespace nacre
