// Bytes with a header that tells whether they are whole: magic, format, nacre's version, length, checksum.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace nacre {

constexpr std::size_t sealed_header_size = 48;

std::string sealed(std::string bytes);    // that leave room for the header
void check_seal(std::string_view bytes);  // CheckpointError

}  // namespace nacre
