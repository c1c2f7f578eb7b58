// Argument checks: the message names the argument, what was expected and what came.
#pragma once

#include <cmath>
#include <sstream>
#include <stdexcept>
#include <string>

namespace nacre {

template <class Value>
[[noreturn]] void throw_invalid(const std::string& name, const std::string& expected, const Value& value) {
  std::ostringstream message;
  message << name << " must be " << expected << ", got " << value;
  throw std::invalid_argument(message.str());
}

template <class Value>
void require(bool condition, const std::string& name, const std::string& expected, const Value& value) {
  if (!condition) throw_invalid(name, expected, value);
}

}  // namespace nacre
