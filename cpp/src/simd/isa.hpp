// The instruction set whose kernels run: the best that the processor has, or what NACRE_SIMD in the environment says.
#pragma once

namespace nacre::simd {

enum class Isa { baseline, avx2, avx512 };  // avx2: x86-64-v3, with FMA; avx512: x86-64-v4

// Throws std::runtime_error when NACRE_SIMD names none, or one that this processor does not have.
Isa active_isa();
const char* to_string(Isa isa);

// The kernel of the active instruction set.
template <class Signature>
Signature* choose([[maybe_unused]] Signature* baseline, [[maybe_unused]] Signature* avx2,
                  [[maybe_unused]] Signature* avx512) {
  switch (active_isa()) {
    case Isa::avx512:
      return avx512;
    case Isa::avx2:
      return avx2;
    default:
      return baseline;
  }
}

}  // namespace nacre::simd

// Declares a kernel of a function type: name() is a pointer to the one to call. The file that defines it, in the
// namespace NACRE_ISA, is compiled once for each instruction set.
// NOLINTBEGIN(bugprone-macro-parentheses): names
#ifdef NACRE_SIMD_X86
#define NACRE_DECLARE_KERNEL(Signature, name) \
  namespace baseline {                        \
  Signature name;                             \
  }                                           \
  namespace avx2 {                            \
  Signature name;                             \
  }                                           \
  namespace avx512 {                          \
  Signature name;                             \
  }                                           \
  inline Signature* name() { return choose<Signature>(baseline::name, avx2::name, avx512::name); }
#else
#define NACRE_DECLARE_KERNEL(Signature, name) \
  namespace baseline {                        \
  Signature name;                             \
  }                                           \
  inline Signature* name() { return baseline::name; }
#endif
// NOLINTEND(bugprone-macro-parentheses)
