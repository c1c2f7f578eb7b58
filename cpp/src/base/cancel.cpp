#include "nacre/cancel.hpp"

#include <utility>

namespace nacre {
namespace {

constexpr std::chrono::milliseconds between_questions{100};

thread_local CancelScope* innermost = nullptr;

}  // namespace

Cancelled::Cancelled() : std::runtime_error("the call was cancelled") {}
Cancelled::~Cancelled() = default;

CancelScope::CancelScope(std::function<bool()> wanted)
    : wanted_(std::move(wanted)), asked_(std::chrono::steady_clock::now()), outer_(std::exchange(innermost, this)) {}

CancelScope::~CancelScope() { innermost = outer_; }

void CancelScope::check() {
  CancelScope* const scope = innermost;
  if (scope == nullptr || !scope->wanted_) return;
  const auto now = std::chrono::steady_clock::now();
  if (now - scope->asked_ < between_questions) return;
  scope->asked_ = now;
  if (scope->wanted_()) throw Cancelled();
}

}  // namespace nacre
