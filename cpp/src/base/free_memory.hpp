#pragma once

namespace nacre {

// Gives memory that was freed back to the system where the C library keeps it (glibc: up to 64 MB after a large array
// was freed once). For moments after which less is needed than before, as it takes a millisecond and more.
void give_back_free_memory() noexcept;

}  // namespace nacre
