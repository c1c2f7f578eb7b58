// Moving lanes about: closing gaps, turning rows into columns.
#pragma once

#include "simd/vec.hpp"

namespace nacre::simd::NACRE_ISA {

NACRE_INLINE int count_bits(unsigned mask) {
#if defined(_MSC_VER) && !defined(__clang__)
  int n = 0;
  for (; mask != 0; mask &= mask - 1) ++n;
  return n;
#else
  return __builtin_popcount(mask);
#endif
}
NACRE_INLINE int count(Mask m) { return count_bits(bits(m)); }

// 0, 1, 2, ...
NACRE_INLINE I32 lane_numbers() {
  static const int32_t numbers[16] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
  return load(numbers);
}

#if defined(__AVX512F__) && defined(__AVX512VL__)

NACRE_INLINE I32 min(I32 a, I32 b) { return {_mm512_min_epi32(a.v, b.v)}; }
NACRE_INLINE I32 max(I32 a, I32 b) { return {_mm512_max_epi32(a.v, b.v)}; }

NACRE_INLINE int32_t least_lane(I32 a) { return _mm512_reduce_min_epi32(a.v); }

// The chosen lanes, one after the other; what follows them, up to a vector in all, is overwritten. (In a register
// first: compressing to memory is slow on some processors.)
NACRE_INLINE void store_chosen(float* p, Mask m, F32 a) { _mm512_storeu_ps(p, _mm512_maskz_compress_ps(m.v, a.v)); }
NACRE_INLINE void store_chosen(int32_t* p, Mask m, I32 a) {
  _mm512_storeu_si512(p, _mm512_maskz_compress_epi32(m.v, a.v));
}

// columns[i][j] = rows[j][i] for a square of as many rows as lanes.
NACRE_INLINE void transpose(const int32_t* rows, ptrdiff_t row_stride, int32_t* columns, ptrdiff_t column_stride) {
  __m512i a[16], b[16];
  for (int i = 0; i < 16; ++i) a[i] = _mm512_loadu_si512(rows + i * row_stride);
  for (int i = 0; i < 8; ++i) {
    b[2 * i] = _mm512_unpacklo_epi32(a[2 * i], a[2 * i + 1]);
    b[2 * i + 1] = _mm512_unpackhi_epi32(a[2 * i], a[2 * i + 1]);
  }
  for (int i = 0; i < 4; ++i) {
    a[4 * i] = _mm512_unpacklo_epi64(b[4 * i], b[4 * i + 2]);
    a[4 * i + 1] = _mm512_unpackhi_epi64(b[4 * i], b[4 * i + 2]);
    a[4 * i + 2] = _mm512_unpacklo_epi64(b[4 * i + 1], b[4 * i + 3]);
    a[4 * i + 3] = _mm512_unpackhi_epi64(b[4 * i + 1], b[4 * i + 3]);
  }
  // a[4 i + j], quarter q: column 4 q + j of rows 4 i to 4 i + 3.
  for (int j = 0; j < 4; ++j) {
    const __m512i even01 = _mm512_shuffle_i32x4(a[j], a[4 + j], 0x88),
                  odd01 = _mm512_shuffle_i32x4(a[j], a[4 + j], 0xDD);
    const __m512i even23 = _mm512_shuffle_i32x4(a[8 + j], a[12 + j], 0x88);
    const __m512i odd23 = _mm512_shuffle_i32x4(a[8 + j], a[12 + j], 0xDD);
    _mm512_storeu_si512(columns + j * column_stride, _mm512_shuffle_i32x4(even01, even23, 0x88));
    _mm512_storeu_si512(columns + (8 + j) * column_stride, _mm512_shuffle_i32x4(even01, even23, 0xDD));
    _mm512_storeu_si512(columns + (4 + j) * column_stride, _mm512_shuffle_i32x4(odd01, odd23, 0x88));
    _mm512_storeu_si512(columns + (12 + j) * column_stride, _mm512_shuffle_i32x4(odd01, odd23, 0xDD));
  }
}

#elif defined(__AVX2__) && defined(__FMA__)

NACRE_INLINE I32 min(I32 a, I32 b) { return {_mm256_min_epi32(a.v, b.v)}; }
NACRE_INLINE I32 max(I32 a, I32 b) { return {_mm256_max_epi32(a.v, b.v)}; }

NACRE_INLINE int32_t least_lane(I32 a) {
  __m128i four = _mm_min_epi32(_mm256_castsi256_si128(a.v), _mm256_extracti128_si256(a.v, 1));
  four = _mm_min_epi32(four, _mm_shuffle_epi32(four, 0x4E));
  return _mm_cvtsi128_si32(_mm_min_epi32(four, _mm_shuffle_epi32(four, 0xB1)));
}

// The n-th byte is the place of the n-th bit that is set.
NACRE_INLINE __m256i chosen_lanes(Mask m) {
  const uint64_t whole = _pdep_u64(bits(m), 0x0101010101010101U) * 0xFF;
  return _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(static_cast<long long>(_pext_u64(0x0706050403020100U, whole))));
}
NACRE_INLINE void store_chosen(float* p, Mask m, F32 a) {
  _mm256_storeu_ps(p, _mm256_permutevar8x32_ps(a.v, chosen_lanes(m)));
}
NACRE_INLINE void store_chosen(int32_t* p, Mask m, I32 a) {
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(p), _mm256_permutevar8x32_epi32(a.v, chosen_lanes(m)));
}

NACRE_INLINE void transpose(const int32_t* rows, ptrdiff_t row_stride, int32_t* columns, ptrdiff_t column_stride) {
  __m256i a[8], b[8];
  for (int i = 0; i < 8; ++i) a[i] = load(rows + i * row_stride).v;
  for (int i = 0; i < 4; ++i) {
    b[2 * i] = _mm256_unpacklo_epi32(a[2 * i], a[2 * i + 1]);
    b[2 * i + 1] = _mm256_unpackhi_epi32(a[2 * i], a[2 * i + 1]);
  }
  for (int i = 0; i < 2; ++i) {
    a[4 * i] = _mm256_unpacklo_epi64(b[4 * i], b[4 * i + 2]);
    a[4 * i + 1] = _mm256_unpackhi_epi64(b[4 * i], b[4 * i + 2]);
    a[4 * i + 2] = _mm256_unpacklo_epi64(b[4 * i + 1], b[4 * i + 3]);
    a[4 * i + 3] = _mm256_unpackhi_epi64(b[4 * i + 1], b[4 * i + 3]);
  }
  for (int j = 0; j < 4; ++j) {
    store(columns + j * column_stride, I32{_mm256_permute2x128_si256(a[j], a[4 + j], 0x20)});
    store(columns + (4 + j) * column_stride, I32{_mm256_permute2x128_si256(a[j], a[4 + j], 0x31)});
  }
}

#else

NACRE_INLINE I32 min(I32 a, I32 b) { return select(a < b, a, b); }
NACRE_INLINE I32 max(I32 a, I32 b) { return select(a < b, b, a); }

NACRE_INLINE int32_t least_lane(I32 a) {
  int32_t values[lanes];
  store(values, a);
  for (int i = 1; i < lanes; ++i) values[0] = values[i] < values[0] ? values[i] : values[0];
  return values[0];
}

template <class Value, class Vector>
NACRE_INLINE void store_chosen_lanes(Value* p, Mask m, Vector a) {
  Value values[lanes];
  store(values, a);
  for (unsigned b = bits(m), i = 0; i < lanes; ++i) {
    *p = values[i];
    p += b >> i & 1U;
  }
}
NACRE_INLINE void store_chosen(float* p, Mask m, F32 a) { store_chosen_lanes(p, m, a); }
NACRE_INLINE void store_chosen(int32_t* p, Mask m, I32 a) { store_chosen_lanes(p, m, a); }

NACRE_INLINE void transpose(const int32_t* rows, ptrdiff_t row_stride, int32_t* columns, ptrdiff_t column_stride) {
  for (int i = 0; i < lanes; ++i) {
    for (int j = 0; j < lanes; ++j) columns[i * column_stride + j] = rows[j * row_stride + i];
  }
}

#endif

// Of numbers that are not negative, whose bits are in their order.
NACRE_INLINE float least_of(F32 a) {
  const int32_t least_bits = least_lane(as_int(a));
  float least;
  memcpy(&least, &least_bits, sizeof least);
  return least;
}

}  // namespace nacre::simd::NACRE_ISA
