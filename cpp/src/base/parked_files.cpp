#include "base/parked_files.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <random>
#include <system_error>

#ifdef _WIN32
#include <io.h>
#else
#include <unistd.h>
#endif

namespace nacre {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const char* what, const fs::path& path) {
  throw fs::filesystem_error(what, path, std::error_code(errno, std::generic_category()));
}

constexpr const char* ending = ".points";
constexpr const char* cannot_write = "what leaves the model's memory cannot be written";
constexpr const char* cannot_read = "what left the model's memory cannot be read";

void write_file(const fs::path& path, const std::string& bytes) {
  errno = 0;
  std::FILE* const file = std::fopen(path.string().c_str(), "wb");
  if (file == nullptr) fail(cannot_write, path);
  bool is_good = std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size();
  is_good = std::fclose(file) == 0 && is_good;
  if (is_good) return;
  const int error = errno;
  std::remove(path.string().c_str());
  errno = error;
  fail(cannot_write, path);
}

// Until the power may go.
void flush_to_disk(const fs::path& path) {
  errno = 0;
  std::FILE* const file = std::fopen(path.string().c_str(), "rb+");
  if (file == nullptr) fail(cannot_write, path);
#ifdef _WIN32
  const bool is_good = _commit(_fileno(file)) == 0;
#else
  const bool is_good = fsync(fileno(file)) == 0;
#endif
  const int error = errno;
  std::fclose(file);
  errno = error;
  if (!is_good) fail(cannot_write, path);
}

std::string new_token() {
  std::random_device device;
  char text[17];
  std::snprintf(text, sizeof(text), "%08x%08x", static_cast<unsigned>(device()), static_cast<unsigned>(device()));
  return text;
}

}  // namespace

ParkedFiles::ParkedFiles(const std::string& folder)
    : folder_(folder.empty() ? folder : fs::absolute(folder).string()), token_(new_token()) {}

ParkedFiles::~ParkedFiles() {
  for (const auto& [file, is_named] : is_named_) {
    if (!is_named) remove(file);
  }
}

std::string ParkedFiles::write_bytes(const std::string& bytes) {
  fs::create_directories(folder_);
  const std::string file = token_ + "-" + std::to_string(next_++) + ending;
  write_file(fs::path(folder_) / file, bytes);
  is_named_.emplace(file, false);
  return file;
}

std::string ParkedFiles::read_bytes(const std::string& file) const {
  const fs::path path = fs::path(folder_) / file;
  errno = 0;
  std::ifstream stream(path, std::ios::binary | std::ios::ate);
  if (!stream) fail(cannot_read, path);
  std::string bytes(static_cast<std::size_t>(stream.tellg()), '\0');
  stream.seekg(0);
  if (!stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()))) fail(cannot_read, path);
  return bytes;
}

void ParkedFiles::fail_to_read(const std::string& file, const CheckpointError& error) const {
  throw fs::filesystem_error(std::string(cannot_read) + ": " + error.what(), fs::path(folder_) / file,
                             std::make_error_code(std::errc::io_error));
}

void ParkedFiles::remove(const std::string& file) const {
  std::error_code ignored;
  fs::remove(fs::path(folder_) / file, ignored);
}

void ParkedFiles::release(const std::string& file) {
  const auto found = is_named_.find(file);
  if (found->second) {
    released_.push_back({file, num_checkpoints_});
  } else {
    remove(file);
  }
  is_named_.erase(found);
}

void ParkedFiles::note_checkpoint() {
  for (const auto& [file, is_named] : is_named_) {
    if (!is_named) flush_to_disk(fs::path(folder_) / file);
  }
  ++num_checkpoints_;
  for (auto& [file, is_named] : is_named_) is_named = true;
  const auto is_old = [&](const Released& released) { return released.checkpoint + 2 <= num_checkpoints_; };
  for (const Released& released : released_) {
    if (is_old(released)) remove(released.file);
  }
  released_.erase(std::remove_if(released_.begin(), released_.end(), is_old), released_.end());
}

}  // namespace nacre
