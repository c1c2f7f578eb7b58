// Vectors of the instruction set that a kernel file is compiled for: `lanes` floats, as many 32-bit integers, and
// masks.
//
// Everything here is in the namespace of the instruction set, so that no inline function of one is ever linked into
// another. All operations round as IEEE 754 says; only mul_add differs, which is fused where the set can.
#pragma once

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#if defined(__AVX512F__) && defined(__AVX512VL__)
#define NACRE_ISA avx512
#include <immintrin.h>
#elif defined(__AVX2__) && defined(__FMA__)
#define NACRE_ISA avx2
#include <immintrin.h>
#else
#define NACRE_ISA baseline
#if defined(__SSE2__) || defined(_M_X64)
#define NACRE_SSE2
#include <emmintrin.h>
#elif defined(__aarch64__) || defined(_M_ARM64)
#define NACRE_NEON
#include <arm_neon.h>
#endif
#endif

#if defined(_MSC_VER) && !defined(__clang__)
#define NACRE_INLINE __forceinline
#else
#define NACRE_INLINE inline __attribute__((always_inline))
#endif

namespace nacre::simd::NACRE_ISA {

#if defined(__AVX512F__) && defined(__AVX512VL__)

constexpr int lanes = 16;
struct Mask {
  __mmask16 v;
};
struct F32 {
  __m512 v;
};
struct I32 {
  __m512i v;
};

NACRE_INLINE F32 load(const float* p) { return {_mm512_loadu_ps(p)}; }
NACRE_INLINE I32 load(const int32_t* p) { return {_mm512_loadu_si512(p)}; }
NACRE_INLINE void store(float* p, F32 a) { _mm512_storeu_ps(p, a.v); }
NACRE_INLINE void store(int32_t* p, I32 a) { _mm512_storeu_si512(p, a.v); }
NACRE_INLINE F32 broadcast(float a) { return {_mm512_set1_ps(a)}; }
NACRE_INLINE I32 broadcast(int32_t a) { return {_mm512_set1_epi32(a)}; }
NACRE_INLINE F32 gather(const float* p, I32 index) { return {_mm512_i32gather_ps(index.v, p, 4)}; }

NACRE_INLINE F32 operator+(F32 a, F32 b) { return {_mm512_add_ps(a.v, b.v)}; }
NACRE_INLINE F32 operator-(F32 a, F32 b) { return {_mm512_sub_ps(a.v, b.v)}; }
NACRE_INLINE F32 operator*(F32 a, F32 b) { return {_mm512_mul_ps(a.v, b.v)}; }
NACRE_INLINE F32 operator/(F32 a, F32 b) { return {_mm512_div_ps(a.v, b.v)}; }
NACRE_INLINE F32 mul_add(F32 a, F32 b, F32 c) { return {_mm512_fmadd_ps(a.v, b.v, c.v)}; }
// a + b and a - b where the mask is set, a elsewhere.
NACRE_INLINE F32 add_where(Mask m, F32 a, F32 b) { return {_mm512_mask_add_ps(a.v, m.v, a.v, b.v)}; }
NACRE_INLINE F32 sub_where(Mask m, F32 a, F32 b) { return {_mm512_mask_sub_ps(a.v, m.v, a.v, b.v)}; }
NACRE_INLINE F32 sqrt(F32 a) { return {_mm512_sqrt_ps(a.v)}; }
// Where a comparison with NaN decides, the second argument.
NACRE_INLINE F32 min(F32 a, F32 b) { return {_mm512_min_ps(a.v, b.v)}; }
NACRE_INLINE F32 max(F32 a, F32 b) { return {_mm512_max_ps(a.v, b.v)}; }
NACRE_INLINE F32 abs(F32 a) { return {_mm512_abs_ps(a.v)}; }

NACRE_INLINE I32 operator+(I32 a, I32 b) { return {_mm512_add_epi32(a.v, b.v)}; }
NACRE_INLINE I32 operator-(I32 a, I32 b) { return {_mm512_sub_epi32(a.v, b.v)}; }
NACRE_INLINE I32 add_where(Mask m, I32 a, I32 b) { return {_mm512_mask_add_epi32(a.v, m.v, a.v, b.v)}; }
NACRE_INLINE I32 operator&(I32 a, I32 b) { return {_mm512_and_si512(a.v, b.v)}; }
NACRE_INLINE I32 operator|(I32 a, I32 b) { return {_mm512_or_si512(a.v, b.v)}; }
template <int bits>
NACRE_INLINE I32 shift_left(I32 a) {
  return {_mm512_slli_epi32(a.v, bits)};
}
// The sign comes down.
template <int bits>
NACRE_INLINE I32 shift_right(I32 a) {
  return {_mm512_srai_epi32(a.v, bits)};
}

NACRE_INLINE I32 as_int(F32 a) { return {_mm512_castps_si512(a.v)}; }
NACRE_INLINE F32 as_float(I32 a) { return {_mm512_castsi512_ps(a.v)}; }
// INT32_MIN where that does not fit, and of NaN.
NACRE_INLINE I32 truncate(F32 a) { return {_mm512_cvttps_epi32(a.v)}; }
NACRE_INLINE F32 to_float(I32 a) { return {_mm512_cvtepi32_ps(a.v)}; }

NACRE_INLINE Mask operator<(F32 a, F32 b) { return {_mm512_cmp_ps_mask(a.v, b.v, _CMP_LT_OQ)}; }
NACRE_INLINE Mask operator<=(F32 a, F32 b) { return {_mm512_cmp_ps_mask(a.v, b.v, _CMP_LE_OQ)}; }
NACRE_INLINE Mask operator==(F32 a, F32 b) { return {_mm512_cmp_ps_mask(a.v, b.v, _CMP_EQ_OQ)}; }
NACRE_INLINE Mask operator<(I32 a, I32 b) { return {_mm512_cmplt_epi32_mask(a.v, b.v)}; }
NACRE_INLINE Mask operator==(I32 a, I32 b) { return {_mm512_cmpeq_epi32_mask(a.v, b.v)}; }
NACRE_INLINE Mask operator&(Mask a, Mask b) { return {static_cast<__mmask16>(a.v & b.v)}; }
NACRE_INLINE Mask operator|(Mask a, Mask b) { return {static_cast<__mmask16>(a.v | b.v)}; }
NACRE_INLINE Mask operator!(Mask a) { return {static_cast<__mmask16>(~a.v)}; }
// Bit i is lane i.
NACRE_INLINE unsigned bits(Mask a) { return a.v; }
// The first `count` lanes.
NACRE_INLINE Mask first_lanes(int count) {
  return {static_cast<__mmask16>(count >= 16 ? 0xFFFFU : (1U << count) - 1U)};
}
NACRE_INLINE F32 select(Mask m, F32 a, F32 b) { return {_mm512_mask_blend_ps(m.v, b.v, a.v)}; }
// x0 y0 z0 x1 y1 z1 ...: 3 lanes vectors. As 3 and the number of lanes have no common divisor, one permutation brings
// all lanes of a vector to their places in the three that are stored.
NACRE_INLINE void store_interleaved(float* p, F32 x, F32 y, F32 z) {
  const __m512 a = _mm512_permutexvar_ps(_mm512_setr_epi32(0, 11, 6, 1, 12, 7, 2, 13, 8, 3, 14, 9, 4, 15, 10, 5), x.v);
  const __m512 b = _mm512_permutexvar_ps(_mm512_setr_epi32(5, 0, 11, 6, 1, 12, 7, 2, 13, 8, 3, 14, 9, 4, 15, 10), y.v);
  const __m512 c = _mm512_permutexvar_ps(_mm512_setr_epi32(10, 5, 0, 11, 6, 1, 12, 7, 2, 13, 8, 3, 14, 9, 4, 15), z.v);
  constexpr __mmask16 first = 0x9249, second = 0x2492;
  _mm512_storeu_ps(p, _mm512_mask_blend_ps(first, _mm512_mask_blend_ps(second, c, b), a));
  _mm512_storeu_ps(p + 16, _mm512_mask_blend_ps(first, _mm512_mask_blend_ps(second, a, c), b));
  _mm512_storeu_ps(p + 32, _mm512_mask_blend_ps(first, _mm512_mask_blend_ps(second, b, a), c));
}
NACRE_INLINE I32 select(Mask m, I32 a, I32 b) { return {_mm512_mask_blend_epi32(m.v, b.v, a.v)}; }

#elif defined(__AVX2__) && defined(__FMA__)

constexpr int lanes = 8;
struct Mask {
  __m256 v;
};
struct F32 {
  __m256 v;
};
struct I32 {
  __m256i v;
};

NACRE_INLINE F32 load(const float* p) { return {_mm256_loadu_ps(p)}; }
NACRE_INLINE I32 load(const int32_t* p) { return {_mm256_loadu_si256(reinterpret_cast<const __m256i*>(p))}; }
NACRE_INLINE void store(float* p, F32 a) { _mm256_storeu_ps(p, a.v); }
NACRE_INLINE void store(int32_t* p, I32 a) { _mm256_storeu_si256(reinterpret_cast<__m256i*>(p), a.v); }
NACRE_INLINE F32 broadcast(float a) { return {_mm256_set1_ps(a)}; }
NACRE_INLINE I32 broadcast(int32_t a) { return {_mm256_set1_epi32(a)}; }
NACRE_INLINE F32 gather(const float* p, I32 index) { return {_mm256_i32gather_ps(p, index.v, 4)}; }

NACRE_INLINE F32 operator+(F32 a, F32 b) { return {_mm256_add_ps(a.v, b.v)}; }
NACRE_INLINE F32 operator-(F32 a, F32 b) { return {_mm256_sub_ps(a.v, b.v)}; }
NACRE_INLINE F32 operator*(F32 a, F32 b) { return {_mm256_mul_ps(a.v, b.v)}; }
NACRE_INLINE F32 operator/(F32 a, F32 b) { return {_mm256_div_ps(a.v, b.v)}; }
NACRE_INLINE F32 mul_add(F32 a, F32 b, F32 c) { return {_mm256_fmadd_ps(a.v, b.v, c.v)}; }
NACRE_INLINE F32 add_where(Mask m, F32 a, F32 b) { return {_mm256_add_ps(a.v, _mm256_and_ps(m.v, b.v))}; }
NACRE_INLINE F32 sub_where(Mask m, F32 a, F32 b) { return {_mm256_sub_ps(a.v, _mm256_and_ps(m.v, b.v))}; }
NACRE_INLINE F32 sqrt(F32 a) { return {_mm256_sqrt_ps(a.v)}; }
NACRE_INLINE F32 min(F32 a, F32 b) { return {_mm256_min_ps(a.v, b.v)}; }
NACRE_INLINE F32 max(F32 a, F32 b) { return {_mm256_max_ps(a.v, b.v)}; }
NACRE_INLINE F32 abs(F32 a) { return {_mm256_andnot_ps(_mm256_set1_ps(-0.0F), a.v)}; }

NACRE_INLINE I32 operator+(I32 a, I32 b) { return {_mm256_add_epi32(a.v, b.v)}; }
NACRE_INLINE I32 operator-(I32 a, I32 b) { return {_mm256_sub_epi32(a.v, b.v)}; }
NACRE_INLINE I32 add_where(Mask m, I32 a, I32 b) {
  return {_mm256_add_epi32(a.v, _mm256_and_si256(_mm256_castps_si256(m.v), b.v))};
}
NACRE_INLINE I32 operator&(I32 a, I32 b) { return {_mm256_and_si256(a.v, b.v)}; }
NACRE_INLINE I32 operator|(I32 a, I32 b) { return {_mm256_or_si256(a.v, b.v)}; }
template <int bits>
NACRE_INLINE I32 shift_left(I32 a) {
  return {_mm256_slli_epi32(a.v, bits)};
}
template <int bits>
NACRE_INLINE I32 shift_right(I32 a) {
  return {_mm256_srai_epi32(a.v, bits)};
}

NACRE_INLINE I32 as_int(F32 a) { return {_mm256_castps_si256(a.v)}; }
NACRE_INLINE F32 as_float(I32 a) { return {_mm256_castsi256_ps(a.v)}; }
NACRE_INLINE I32 truncate(F32 a) { return {_mm256_cvttps_epi32(a.v)}; }
NACRE_INLINE F32 to_float(I32 a) { return {_mm256_cvtepi32_ps(a.v)}; }

NACRE_INLINE Mask operator<(F32 a, F32 b) { return {_mm256_cmp_ps(a.v, b.v, _CMP_LT_OQ)}; }
NACRE_INLINE Mask operator<=(F32 a, F32 b) { return {_mm256_cmp_ps(a.v, b.v, _CMP_LE_OQ)}; }
NACRE_INLINE Mask operator==(F32 a, F32 b) { return {_mm256_cmp_ps(a.v, b.v, _CMP_EQ_OQ)}; }
NACRE_INLINE Mask operator<(I32 a, I32 b) { return {_mm256_castsi256_ps(_mm256_cmpgt_epi32(b.v, a.v))}; }
NACRE_INLINE Mask operator==(I32 a, I32 b) { return {_mm256_castsi256_ps(_mm256_cmpeq_epi32(a.v, b.v))}; }
NACRE_INLINE Mask operator&(Mask a, Mask b) { return {_mm256_and_ps(a.v, b.v)}; }
NACRE_INLINE Mask operator|(Mask a, Mask b) { return {_mm256_or_ps(a.v, b.v)}; }
NACRE_INLINE Mask operator!(Mask a) { return {_mm256_xor_ps(a.v, _mm256_castsi256_ps(_mm256_set1_epi32(-1)))}; }
NACRE_INLINE unsigned bits(Mask a) { return static_cast<unsigned>(_mm256_movemask_ps(a.v)); }
NACRE_INLINE Mask first_lanes(int count) { return I32{_mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7)} < broadcast(count); }
NACRE_INLINE F32 select(Mask m, F32 a, F32 b) { return {_mm256_blendv_ps(b.v, a.v, m.v)}; }
NACRE_INLINE void store_interleaved(float* p, F32 x, F32 y, F32 z) {
  const __m256 a = _mm256_permutevar8x32_ps(x.v, _mm256_setr_epi32(0, 3, 6, 1, 4, 7, 2, 5));
  const __m256 b = _mm256_permutevar8x32_ps(y.v, _mm256_setr_epi32(5, 0, 3, 6, 1, 4, 7, 2));
  const __m256 c = _mm256_permutevar8x32_ps(z.v, _mm256_setr_epi32(2, 5, 0, 3, 6, 1, 4, 7));
  constexpr int first = 0x49, second = 0x92;
  _mm256_storeu_ps(p, _mm256_blend_ps(_mm256_blend_ps(c, b, second), a, first));
  _mm256_storeu_ps(p + 8, _mm256_blend_ps(_mm256_blend_ps(b, a, second), c, first));
  _mm256_storeu_ps(p + 16, _mm256_blend_ps(_mm256_blend_ps(a, c, second), b, first));
}
NACRE_INLINE I32 select(Mask m, I32 a, I32 b) { return {_mm256_blendv_epi8(b.v, a.v, _mm256_castps_si256(m.v))}; }

#elif defined(NACRE_SSE2)

constexpr int lanes = 4;
struct Mask {
  __m128 v;
};
struct F32 {
  __m128 v;
};
struct I32 {
  __m128i v;
};

NACRE_INLINE F32 load(const float* p) { return {_mm_loadu_ps(p)}; }
NACRE_INLINE I32 load(const int32_t* p) { return {_mm_loadu_si128(reinterpret_cast<const __m128i*>(p))}; }
NACRE_INLINE void store(float* p, F32 a) { _mm_storeu_ps(p, a.v); }
NACRE_INLINE void store(int32_t* p, I32 a) { _mm_storeu_si128(reinterpret_cast<__m128i*>(p), a.v); }
NACRE_INLINE F32 broadcast(float a) { return {_mm_set1_ps(a)}; }
NACRE_INLINE I32 broadcast(int32_t a) { return {_mm_set1_epi32(a)}; }
NACRE_INLINE F32 gather(const float* p, I32 index) {
  int32_t i[4];
  store(i, index);
  return {_mm_setr_ps(p[i[0]], p[i[1]], p[i[2]], p[i[3]])};
}

NACRE_INLINE F32 operator+(F32 a, F32 b) { return {_mm_add_ps(a.v, b.v)}; }
NACRE_INLINE F32 operator-(F32 a, F32 b) { return {_mm_sub_ps(a.v, b.v)}; }
NACRE_INLINE F32 operator*(F32 a, F32 b) { return {_mm_mul_ps(a.v, b.v)}; }
NACRE_INLINE F32 operator/(F32 a, F32 b) { return {_mm_div_ps(a.v, b.v)}; }
NACRE_INLINE F32 mul_add(F32 a, F32 b, F32 c) { return a * b + c; }
NACRE_INLINE F32 add_where(Mask m, F32 a, F32 b) { return {_mm_add_ps(a.v, _mm_and_ps(m.v, b.v))}; }
NACRE_INLINE F32 sub_where(Mask m, F32 a, F32 b) { return {_mm_sub_ps(a.v, _mm_and_ps(m.v, b.v))}; }
NACRE_INLINE F32 sqrt(F32 a) { return {_mm_sqrt_ps(a.v)}; }
NACRE_INLINE F32 min(F32 a, F32 b) { return {_mm_min_ps(a.v, b.v)}; }
NACRE_INLINE F32 max(F32 a, F32 b) { return {_mm_max_ps(a.v, b.v)}; }
NACRE_INLINE F32 abs(F32 a) { return {_mm_andnot_ps(_mm_set1_ps(-0.0F), a.v)}; }

NACRE_INLINE I32 operator+(I32 a, I32 b) { return {_mm_add_epi32(a.v, b.v)}; }
NACRE_INLINE I32 operator-(I32 a, I32 b) { return {_mm_sub_epi32(a.v, b.v)}; }
NACRE_INLINE I32 add_where(Mask m, I32 a, I32 b) {
  return {_mm_add_epi32(a.v, _mm_and_si128(_mm_castps_si128(m.v), b.v))};
}
NACRE_INLINE I32 operator&(I32 a, I32 b) { return {_mm_and_si128(a.v, b.v)}; }
NACRE_INLINE I32 operator|(I32 a, I32 b) { return {_mm_or_si128(a.v, b.v)}; }
template <int bits>
NACRE_INLINE I32 shift_left(I32 a) {
  return {_mm_slli_epi32(a.v, bits)};
}
template <int bits>
NACRE_INLINE I32 shift_right(I32 a) {
  return {_mm_srai_epi32(a.v, bits)};
}

NACRE_INLINE I32 as_int(F32 a) { return {_mm_castps_si128(a.v)}; }
NACRE_INLINE F32 as_float(I32 a) { return {_mm_castsi128_ps(a.v)}; }
NACRE_INLINE I32 truncate(F32 a) { return {_mm_cvttps_epi32(a.v)}; }
NACRE_INLINE F32 to_float(I32 a) { return {_mm_cvtepi32_ps(a.v)}; }

NACRE_INLINE Mask operator<(F32 a, F32 b) { return {_mm_cmplt_ps(a.v, b.v)}; }
NACRE_INLINE Mask operator<=(F32 a, F32 b) { return {_mm_cmple_ps(a.v, b.v)}; }
NACRE_INLINE Mask operator==(F32 a, F32 b) { return {_mm_cmpeq_ps(a.v, b.v)}; }
NACRE_INLINE Mask operator<(I32 a, I32 b) { return {_mm_castsi128_ps(_mm_cmplt_epi32(a.v, b.v))}; }
NACRE_INLINE Mask operator==(I32 a, I32 b) { return {_mm_castsi128_ps(_mm_cmpeq_epi32(a.v, b.v))}; }
NACRE_INLINE Mask operator&(Mask a, Mask b) { return {_mm_and_ps(a.v, b.v)}; }
NACRE_INLINE Mask operator|(Mask a, Mask b) { return {_mm_or_ps(a.v, b.v)}; }
NACRE_INLINE Mask operator!(Mask a) { return {_mm_xor_ps(a.v, _mm_castsi128_ps(_mm_set1_epi32(-1)))}; }
NACRE_INLINE unsigned bits(Mask a) { return static_cast<unsigned>(_mm_movemask_ps(a.v)); }
NACRE_INLINE Mask first_lanes(int count) { return I32{_mm_setr_epi32(0, 1, 2, 3)} < broadcast(count); }
NACRE_INLINE F32 select(Mask m, F32 a, F32 b) { return {_mm_or_ps(_mm_and_ps(m.v, a.v), _mm_andnot_ps(m.v, b.v))}; }
NACRE_INLINE I32 select(Mask m, I32 a, I32 b) { return as_int(select(m, as_float(a), as_float(b))); }
NACRE_INLINE void store_interleaved(float* p, F32 x, F32 y, F32 z) {
  const F32 a = {_mm_shuffle_ps(x.v, x.v, _MM_SHUFFLE(1, 2, 3, 0))};
  const F32 b = {_mm_shuffle_ps(y.v, y.v, _MM_SHUFFLE(2, 3, 0, 1))};
  const F32 c = {_mm_shuffle_ps(z.v, z.v, _MM_SHUFFLE(3, 0, 1, 2))};
  const Mask first = {_mm_castsi128_ps(_mm_setr_epi32(-1, 0, 0, -1))};
  const Mask second = {_mm_castsi128_ps(_mm_setr_epi32(0, -1, 0, 0))};
  store(p, select(first, a, select(second, b, c)));
  store(p + 4, select(first, b, select(second, c, a)));
  store(p + 8, select(first, c, select(second, a, b)));
}

#elif defined(NACRE_NEON)

constexpr int lanes = 4;
struct Mask {
  uint32x4_t v;
};
struct F32 {
  float32x4_t v;
};
struct I32 {
  int32x4_t v;
};

NACRE_INLINE F32 load(const float* p) { return {vld1q_f32(p)}; }
NACRE_INLINE I32 load(const int32_t* p) { return {vld1q_s32(p)}; }
NACRE_INLINE void store(float* p, F32 a) { vst1q_f32(p, a.v); }
NACRE_INLINE void store(int32_t* p, I32 a) { vst1q_s32(p, a.v); }
NACRE_INLINE F32 broadcast(float a) { return {vdupq_n_f32(a)}; }
NACRE_INLINE I32 broadcast(int32_t a) { return {vdupq_n_s32(a)}; }
NACRE_INLINE F32 gather(const float* p, I32 index) {
  int32_t i[4];
  store(i, index);
  const float values[4] = {p[i[0]], p[i[1]], p[i[2]], p[i[3]]};
  return load(values);
}

NACRE_INLINE F32 operator+(F32 a, F32 b) { return {vaddq_f32(a.v, b.v)}; }
NACRE_INLINE F32 operator-(F32 a, F32 b) { return {vsubq_f32(a.v, b.v)}; }
NACRE_INLINE F32 operator*(F32 a, F32 b) { return {vmulq_f32(a.v, b.v)}; }
NACRE_INLINE F32 operator/(F32 a, F32 b) { return {vdivq_f32(a.v, b.v)}; }
NACRE_INLINE F32 mul_add(F32 a, F32 b, F32 c) { return {vfmaq_f32(c.v, a.v, b.v)}; }
NACRE_INLINE F32 sqrt(F32 a) { return {vsqrtq_f32(a.v)}; }
NACRE_INLINE F32 abs(F32 a) { return {vabsq_f32(a.v)}; }

NACRE_INLINE I32 operator+(I32 a, I32 b) { return {vaddq_s32(a.v, b.v)}; }
NACRE_INLINE I32 operator-(I32 a, I32 b) { return {vsubq_s32(a.v, b.v)}; }
NACRE_INLINE I32 operator&(I32 a, I32 b) { return {vandq_s32(a.v, b.v)}; }
NACRE_INLINE I32 operator|(I32 a, I32 b) { return {vorrq_s32(a.v, b.v)}; }
template <int bits>
NACRE_INLINE I32 shift_left(I32 a) {
  return {vshlq_n_s32(a.v, bits)};
}
template <int bits>
NACRE_INLINE I32 shift_right(I32 a) {
  return {vshrq_n_s32(a.v, bits)};
}

NACRE_INLINE I32 as_int(F32 a) { return {vreinterpretq_s32_f32(a.v)}; }
NACRE_INLINE F32 as_float(I32 a) { return {vreinterpretq_f32_s32(a.v)}; }
NACRE_INLINE F32 to_float(I32 a) { return {vcvtq_f32_s32(a.v)}; }

NACRE_INLINE Mask operator<(F32 a, F32 b) { return {vcltq_f32(a.v, b.v)}; }
NACRE_INLINE Mask operator<=(F32 a, F32 b) { return {vcleq_f32(a.v, b.v)}; }
NACRE_INLINE Mask operator==(F32 a, F32 b) { return {vceqq_f32(a.v, b.v)}; }
NACRE_INLINE Mask operator<(I32 a, I32 b) { return {vcltq_s32(a.v, b.v)}; }
NACRE_INLINE Mask operator==(I32 a, I32 b) { return {vceqq_s32(a.v, b.v)}; }
NACRE_INLINE Mask operator&(Mask a, Mask b) { return {vandq_u32(a.v, b.v)}; }
NACRE_INLINE Mask operator|(Mask a, Mask b) { return {vorrq_u32(a.v, b.v)}; }
NACRE_INLINE Mask operator!(Mask a) { return {vmvnq_u32(a.v)}; }
NACRE_INLINE unsigned bits(Mask a) {
  const int32_t places[4] = {0, 1, 2, 3};
  return vaddvq_u32(vshlq_u32(vshrq_n_u32(a.v, 31), vld1q_s32(places)));
}
NACRE_INLINE Mask first_lanes(int count) {
  const int32_t places[4] = {0, 1, 2, 3};
  return load(places) < broadcast(count);
}
NACRE_INLINE F32 select(Mask m, F32 a, F32 b) { return {vbslq_f32(m.v, a.v, b.v)}; }
NACRE_INLINE I32 select(Mask m, I32 a, I32 b) { return {vbslq_s32(m.v, a.v, b.v)}; }
NACRE_INLINE F32 add_where(Mask m, F32 a, F32 b) { return select(m, a + b, a); }
NACRE_INLINE F32 sub_where(Mask m, F32 a, F32 b) { return select(m, a - b, a); }
NACRE_INLINE I32 add_where(Mask m, I32 a, I32 b) { return select(m, a + b, a); }
// Those of NEON give NaN where either is.
NACRE_INLINE F32 min(F32 a, F32 b) { return select(a < b, a, b); }
NACRE_INLINE F32 max(F32 a, F32 b) { return select(b < a, a, b); }
// That of NEON saturates, and gives 0 of NaN.
NACRE_INLINE I32 truncate(F32 a) {
  const Mask fits = (broadcast(-2147483648.0F) <= a) & (a < broadcast(2147483648.0F));
  return select(fits, I32{vcvtq_s32_f32(a.v)}, broadcast(INT32_MIN));
}
NACRE_INLINE void store_interleaved(float* p, F32 x, F32 y, F32 z) { vst3q_f32(p, {{x.v, y.v, z.v}}); }

#else  // plain loops, which a compiler may make vectors of

constexpr int lanes = 4;
struct Mask {
  int32_t v[lanes];  // 0 or -1
};
struct F32 {
  float v[lanes];
};
struct I32 {
  int32_t v[lanes];
};

template <class R, class Lane>
NACRE_INLINE R each_lane(Lane lane) {
  R r;
  for (int i = 0; i < lanes; ++i) r.v[i] = lane(i);
  return r;
}

NACRE_INLINE F32 load(const float* p) {
  return each_lane<F32>([=](int i) { return p[i]; });
}
NACRE_INLINE I32 load(const int32_t* p) {
  return each_lane<I32>([=](int i) { return p[i]; });
}
NACRE_INLINE void store(float* p, F32 a) { memcpy(p, a.v, sizeof a.v); }
NACRE_INLINE void store(int32_t* p, I32 a) { memcpy(p, a.v, sizeof a.v); }
NACRE_INLINE F32 broadcast(float a) {
  return each_lane<F32>([=](int) { return a; });
}
NACRE_INLINE I32 broadcast(int32_t a) {
  return each_lane<I32>([=](int) { return a; });
}
NACRE_INLINE F32 gather(const float* p, I32 index) {
  return each_lane<F32>([=](int i) { return p[index.v[i]]; });
}

NACRE_INLINE F32 operator+(F32 a, F32 b) {
  return each_lane<F32>([=](int i) { return a.v[i] + b.v[i]; });
}
NACRE_INLINE F32 operator-(F32 a, F32 b) {
  return each_lane<F32>([=](int i) { return a.v[i] - b.v[i]; });
}
NACRE_INLINE F32 operator*(F32 a, F32 b) {
  return each_lane<F32>([=](int i) { return a.v[i] * b.v[i]; });
}
NACRE_INLINE F32 operator/(F32 a, F32 b) {
  return each_lane<F32>([=](int i) { return a.v[i] / b.v[i]; });
}
NACRE_INLINE F32 mul_add(F32 a, F32 b, F32 c) { return a * b + c; }
NACRE_INLINE F32 add_where(Mask m, F32 a, F32 b) {
  return each_lane<F32>([=](int i) { return m.v[i] ? a.v[i] + b.v[i] : a.v[i]; });
}
NACRE_INLINE F32 sub_where(Mask m, F32 a, F32 b) {
  return each_lane<F32>([=](int i) { return m.v[i] ? a.v[i] - b.v[i] : a.v[i]; });
}
NACRE_INLINE F32 sqrt(F32 a) {
  return each_lane<F32>([=](int i) { return ::sqrtf(a.v[i]); });
}
NACRE_INLINE F32 min(F32 a, F32 b) {
  return each_lane<F32>([=](int i) { return a.v[i] < b.v[i] ? a.v[i] : b.v[i]; });
}
NACRE_INLINE F32 max(F32 a, F32 b) {
  return each_lane<F32>([=](int i) { return a.v[i] > b.v[i] ? a.v[i] : b.v[i]; });
}
NACRE_INLINE F32 abs(F32 a) {
  return each_lane<F32>([=](int i) { return ::fabsf(a.v[i]); });
}

NACRE_INLINE I32 operator+(I32 a, I32 b) {
  return each_lane<I32>([=](int i) { return a.v[i] + b.v[i]; });
}
NACRE_INLINE I32 operator-(I32 a, I32 b) {
  return each_lane<I32>([=](int i) { return a.v[i] - b.v[i]; });
}
NACRE_INLINE I32 add_where(Mask m, I32 a, I32 b) {
  return each_lane<I32>([=](int i) { return m.v[i] ? a.v[i] + b.v[i] : a.v[i]; });
}
NACRE_INLINE I32 operator&(I32 a, I32 b) {
  return each_lane<I32>([=](int i) { return a.v[i] & b.v[i]; });
}
NACRE_INLINE I32 operator|(I32 a, I32 b) {
  return each_lane<I32>([=](int i) { return a.v[i] | b.v[i]; });
}
template <int bits>
NACRE_INLINE I32 shift_left(I32 a) {
  return each_lane<I32>([=](int i) { return static_cast<int32_t>(static_cast<uint32_t>(a.v[i]) << bits); });
}
template <int bits>
NACRE_INLINE I32 shift_right(I32 a) {
  return each_lane<I32>([=](int i) { return a.v[i] >> bits; });
}

NACRE_INLINE I32 as_int(F32 a) {
  I32 r;
  memcpy(r.v, a.v, sizeof r.v);
  return r;
}
NACRE_INLINE F32 as_float(I32 a) {
  F32 r;
  memcpy(r.v, a.v, sizeof r.v);
  return r;
}
NACRE_INLINE I32 truncate(F32 a) {
  return each_lane<I32>([=](int i) {
    const bool fits = a.v[i] >= -2147483648.0F && a.v[i] < 2147483648.0F;
    return fits ? static_cast<int32_t>(a.v[i]) : INT32_MIN;
  });
}
NACRE_INLINE F32 to_float(I32 a) {
  return each_lane<F32>([=](int i) { return static_cast<float>(a.v[i]); });
}

NACRE_INLINE Mask operator<(F32 a, F32 b) {
  return each_lane<Mask>([=](int i) { return -static_cast<int32_t>(a.v[i] < b.v[i]); });
}
NACRE_INLINE Mask operator<=(F32 a, F32 b) {
  return each_lane<Mask>([=](int i) { return -static_cast<int32_t>(a.v[i] <= b.v[i]); });
}
NACRE_INLINE Mask operator==(F32 a, F32 b) {
  return each_lane<Mask>([=](int i) { return -static_cast<int32_t>(a.v[i] == b.v[i]); });
}
NACRE_INLINE Mask operator<(I32 a, I32 b) {
  return each_lane<Mask>([=](int i) { return -static_cast<int32_t>(a.v[i] < b.v[i]); });
}
NACRE_INLINE Mask operator==(I32 a, I32 b) {
  return each_lane<Mask>([=](int i) { return -static_cast<int32_t>(a.v[i] == b.v[i]); });
}
NACRE_INLINE Mask operator&(Mask a, Mask b) {
  return each_lane<Mask>([=](int i) { return a.v[i] & b.v[i]; });
}
NACRE_INLINE Mask operator|(Mask a, Mask b) {
  return each_lane<Mask>([=](int i) { return a.v[i] | b.v[i]; });
}
NACRE_INLINE Mask operator!(Mask a) {
  return each_lane<Mask>([=](int i) { return ~a.v[i]; });
}
NACRE_INLINE unsigned bits(Mask a) {
  unsigned r = 0;
  for (int i = 0; i < lanes; ++i) r |= static_cast<unsigned>(a.v[i] & 1) << i;
  return r;
}
NACRE_INLINE Mask first_lanes(int count) {
  return each_lane<Mask>([=](int i) { return -static_cast<int32_t>(i < count); });
}
NACRE_INLINE F32 select(Mask m, F32 a, F32 b) {
  return each_lane<F32>([=](int i) { return m.v[i] ? a.v[i] : b.v[i]; });
}
NACRE_INLINE I32 select(Mask m, I32 a, I32 b) {
  return each_lane<I32>([=](int i) { return m.v[i] ? a.v[i] : b.v[i]; });
}
NACRE_INLINE void store_interleaved(float* p, F32 x, F32 y, F32 z) {
  for (int i = 0; i < lanes; ++i) {
    p[3 * i] = x.v[i];
    p[3 * i + 1] = y.v[i];
    p[3 * i + 2] = z.v[i];
  }
}

#endif

NACRE_INLINE Mask operator>(F32 a, F32 b) { return b < a; }
NACRE_INLINE Mask operator>=(F32 a, F32 b) { return b <= a; }
NACRE_INLINE F32& operator+=(F32& a, F32 b) { return a = a + b; }
// 1 / sqrt(a) of a positive number to 2 units in the last place, the same bits everywhere: Newton's method from an
// estimate by the exponent. Half the time of a division by a square root.
NACRE_INLINE F32 inverse_sqrt(F32 a) {
  const F32 half = broadcast(0.5F) * a;
  F32 y = as_float(broadcast(0x5F375A86) - shift_right<1>(as_int(a)));
  for (int step = 0; step < 3; ++step) y = y * (broadcast(1.5F) - half * y * y);
  return y;
}
NACRE_INLINE bool all(Mask a) { return bits(a) == (1U << lanes) - 1U; }
NACRE_INLINE bool any(Mask a) { return bits(a) != 0; }

// Of 16 values, 8 from p and the 8 that are a stride farther: those of one part.
NACRE_INLINE F32 load_halves(const float* p, ptrdiff_t stride, [[maybe_unused]] int part) {
#if defined(__AVX512F__) && defined(__AVX512VL__)
  const __m512d first = _mm512_castps_pd(_mm512_castps256_ps512(_mm256_loadu_ps(p)));
  return {_mm512_castpd_ps(_mm512_insertf64x4(first, _mm256_castps_pd(_mm256_loadu_ps(p + stride)), 1))};
#else
  return load(p + (part * lanes < 8 ? part * lanes : stride + part * lanes - 8));
#endif
}

// The sum of 16 values in a fixed order, whatever the number of lanes: i with i + 8, then i with i + 4, 2 and 1.
NACRE_INLINE float sum_lanes(const F32 (&v)[16 / lanes]) {
#if defined(__AVX512F__) && defined(__AVX512VL__)
  const __m256 eight = _mm256_add_ps(_mm512_castps512_ps256(v[0].v),
                                     _mm256_castpd_ps(_mm512_extractf64x4_pd(_mm512_castps_pd(v[0].v), 1)));
  const __m128 four = _mm_add_ps(_mm256_castps256_ps128(eight), _mm256_extractf128_ps(eight, 1));
#elif defined(__AVX2__) && defined(__FMA__)
  const __m256 eight = _mm256_add_ps(v[0].v, v[1].v);
  const __m128 four = _mm_add_ps(_mm256_castps256_ps128(eight), _mm256_extractf128_ps(eight, 1));
#elif defined(NACRE_SSE2)
  const __m128 four = ((v[0] + v[2]) + (v[1] + v[3])).v;
#elif defined(NACRE_NEON)
  const float32x4_t four = ((v[0] + v[2]) + (v[1] + v[3])).v;
  const float32x2_t two = vadd_f32(vget_low_f32(four), vget_high_f32(four));
  return vget_lane_f32(two, 0) + vget_lane_f32(two, 1);
#else
  const F32 four = (v[0] + v[2]) + (v[1] + v[3]);
  return (four.v[0] + four.v[2]) + (four.v[1] + four.v[3]);
#endif
#if defined(__AVX2__) || defined(NACRE_SSE2)
  const __m128 two = _mm_add_ps(four, _mm_movehl_ps(four, four));
  return _mm_cvtss_f32(_mm_add_ss(two, _mm_shuffle_ps(two, two, 1)));
#endif
}

}  // namespace nacre::simd::NACRE_ISA
