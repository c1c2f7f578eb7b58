// Folders that states are parked in, and the bytes of a state.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/archive.hpp"

namespace nacre_test {

template <class State>
std::string bytes_of(State state) {
  std::string bytes;
  nacre::StateWriter archive(bytes);
  archive(state);
  return bytes;
}

// Empty before and gone after a test.
struct ParkingFolder {
  std::filesystem::path path;

  explicit ParkingFolder(const std::string& name) : path(std::filesystem::temp_directory_path() / name) {
    std::filesystem::remove_all(path);
  }
  ParkingFolder(const ParkingFolder&) = delete;
  ParkingFolder& operator=(const ParkingFolder&) = delete;
  ~ParkingFolder() { std::filesystem::remove_all(path); }

  std::vector<std::filesystem::path> files() const {
    std::vector<std::filesystem::path> all;
    if (!std::filesystem::exists(path)) return all;
    for (const auto& entry : std::filesystem::directory_iterator(path)) all.push_back(entry.path());
    return all;
  }
};

}  // namespace nacre_test
