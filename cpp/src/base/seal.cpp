#include "base/seal.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <sstream>

#include "base/random.hpp"
#include "nacre/checkpoint.hpp"
#include "nacre/version.hpp"

namespace nacre {
namespace {

constexpr char magic[] = {'n', 'a', 'c', 'r', 'e', 'm', 'd', 'l'};
constexpr std::size_t version_at = 12, length_at = 32, checksum_at = 40;

std::uint64_t checksum_of(std::string_view bytes) {
  std::uint64_t sum = bytes.size();
  for (std::size_t i = 0; i < bytes.size(); i += sizeof(std::uint64_t)) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + i, std::min(sizeof(word), bytes.size() - i));
    sum = mix64(sum ^ word);
  }
  return sum;
}

template <class Number>
Number number_at(std::string_view bytes, std::size_t offset) {
  Number number;
  std::memcpy(&number, bytes.data() + offset, sizeof(number));
  return number;
}

template <class Number>
void set_number(std::string& bytes, std::size_t offset, Number number) {
  std::memcpy(bytes.data() + offset, &number, sizeof(number));
}

}  // namespace

std::string sealed(std::string bytes) {
  std::copy(std::begin(magic), std::end(magic), bytes.begin());
  set_number(bytes, sizeof(magic), checkpoint_format);
  const std::string version = NACRE_VERSION;
  version.copy(bytes.data() + version_at, length_at - version_at - 1);
  set_number(bytes, length_at, static_cast<std::uint64_t>(bytes.size()));
  set_number(bytes, checksum_at, checksum_of(std::string_view(bytes).substr(sealed_header_size)));
  return bytes;
}

void check_seal(std::string_view bytes) {
  if (bytes.size() < sealed_header_size || !std::equal(std::begin(magic), std::end(magic), bytes.begin())) {
    throw CheckpointError("it is no model that nacre saved", 0);
  }
  const auto format = number_at<std::uint32_t>(bytes, sizeof(magic));
  if (format != checkpoint_format) {
    std::string writer(bytes.substr(version_at, length_at - version_at));
    writer = writer.substr(0, writer.find('\0'));
    writer.erase(std::remove_if(writer.begin(), writer.end(), [](char c) { return c < ' ' || c > '~'; }), writer.end());
    std::ostringstream reason;
    reason << "it has checkpoint format " << format << " (nacre " << writer << " wrote it), and nacre " << NACRE_VERSION
           << " reads format " << checkpoint_format << ": use that version, or run the recording again";
    throw CheckpointError(reason.str(), sizeof(magic));
  }
  const auto length = number_at<std::uint64_t>(bytes, length_at);
  if (length != bytes.size()) {
    std::ostringstream reason;
    if (length > bytes.size()) {
      reason << "it has " << bytes.size() << " of its " << length << " bytes: it was not written or copied to the end";
    } else {
      reason << "it has " << bytes.size() << " bytes and says that they are " << length << ": it is damaged";
    }
    throw CheckpointError(reason.str(), static_cast<std::int64_t>(std::min<std::uint64_t>(length, bytes.size())));
  }
  if (number_at<std::uint64_t>(bytes, checksum_at) != checksum_of(bytes.substr(sealed_header_size))) {
    throw CheckpointError("it is damaged: its checksum does not fit", checksum_at);
  }
}

}  // namespace nacre
