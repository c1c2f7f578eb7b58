// What left a model's memory, on disk.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "base/archive.hpp"
#include "base/seal.hpp"

namespace nacre {

// Files in a folder. One is complete before anything names it, is checked when it is read, and is never changed: one
// that a checkpoint names stays until two later ones do without it. std::filesystem::filesystem_error names one that
// cannot be written or read, or is damaged.
class ParkedFiles {
 public:
  explicit ParkedFiles(const std::string& folder);  // "": nothing leaves memory
  ~ParkedFiles();                                   // what no checkpoint names nobody will ask for
  ParkedFiles(const ParkedFiles&) = delete;
  ParkedFiles& operator=(const ParkedFiles&) = delete;

  bool is_on() const { return !folder_.empty(); }

  // Writes what `exchange` says of a value; returns the file's name.
  template <class Value>
  std::string write(Value& value) {
    std::string bytes(sealed_header_size, '\0');
    StateWriter archive(bytes);
    archive(value);
    return write_bytes(sealed(std::move(bytes)));
  }
  // check(archive, value) requires what must hold of it.
  template <class Value, class Check>
  Value read(const std::string& file, Check&& check) const {
    const std::string bytes = read_bytes(file);
    try {
      check_seal(bytes);
      StateReader archive(bytes, sealed_header_size);
      Value value{};
      archive(value);
      archive.require_end();
      check(archive, value);
      return value;
    } catch (const CheckpointError& error) {
      fail_to_read(file, error);
    }
  }
  // It is needed no more.
  void release(const std::string& file);
  // A checkpoint is about to name the files that there are: they are flushed to disk.
  void note_checkpoint();

 private:
  friend struct PrivateState;
  struct Released {
    std::string file;
    std::int64_t checkpoint;  // the last that names it
  };

  std::string write_bytes(const std::string& bytes);
  std::string read_bytes(const std::string& file) const;
  [[noreturn]] void fail_to_read(const std::string& file, const CheckpointError& error) const;
  void remove(const std::string& file) const;

  std::string folder_;
  std::string token_;  // in the names of the files of this model's
  std::int64_t next_ = 0;
  std::int64_t num_checkpoints_ = 0;
  std::map<std::string, bool> is_named_;  // by a checkpoint, of the files that are needed
  std::vector<Released> released_;        // that are not, but were named
};

}  // namespace nacre
