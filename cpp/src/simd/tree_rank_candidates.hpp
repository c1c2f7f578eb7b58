// Which candidates are the nearest of each query of a group, in order.
#pragma once

#include "simd/tree_group_search.hpp"

namespace nacre::simd::NACRE_ISA {

// keys[rank][query], sorted: local squared distance, rounded down, << 10 | candidate. After a query's candidates within
// the radius comes no_candidate.
struct Ranking {
  alignas(64) int32_t keys[most_near][group_queries];
  int counts[group_queries];    // -1: not ranked
  float limits[group_queries];  // candidates that are not ranked are beyond
};

// Batcher's odd-even merge sort ("Sorting networks and their applications", 1968) of vectors, lane by lane: 191
// comparisons for 32.
template <int a, int b>
NACRE_INLINE void put_in_order(I32* v) {
  const I32 x = v[a], y = v[b];
  v[a] = min(x, y);
  v[b] = max(x, y);
}

template <int i, int end, int step>
NACRE_INLINE void put_pairs_in_order(I32* v) {
  if constexpr (i + step < end) {
    put_in_order<i, i + step>(v);
    put_pairs_in_order<i + 2 * step, end, step>(v);
  }
}

// Vectors first, first + step, ... of n, whose halves are sorted.
template <int first, int n, int step>
NACRE_INLINE void merge_halves(I32* v) {
  if constexpr (2 * step < n) {
    merge_halves<first, n, 2 * step>(v);
    merge_halves<first + step, n, 2 * step>(v);
    put_pairs_in_order<first + step, first + n, step>(v);
  } else {
    put_in_order<first, first + step>(v);
  }
}

template <int first, int n>
NACRE_INLINE void sort_vectors(I32* v) {
  if constexpr (n > 1) {
    sort_vectors<first, n / 2>(v);
    sort_vectors<first + n / 2, n / 2>(v);
    merge_halves<first, n, 1>(v);
  }
}

using Columns = int32_t (*)[group_queries];

NACRE_INLINE void put_in_order(int32_t* a, int32_t* b) {
  const I32 x = load(a), y = load(b);
  store(a, min(x, y));
  store(b, max(x, y));
}

// Sorts n keys in each of the first `lanes` columns.
template <int n>
NACRE_INLINE void sort_columns(Columns keys) {
  if constexpr (n <= 32) {
    I32 v[n];
    for (int i = 0; i < n; ++i) v[i] = load(keys[i]);
    sort_vectors<0, n>(v);
    for (int i = 0; i < n; ++i) store(keys[i], v[i]);
  } else {
    constexpr int half = n / 2;
    for (int i = 0; i < n; i += half) sort_columns<half>(keys + i);
    for (int i = 0; i < half; ++i) put_in_order(keys[i], keys[i + half]);
    for (int step = half / 2; step > 0; step /= 2) {
      for (int i = step; i + step < n; i += 2 * step) {
        for (int j = i; j < i + step; ++j) put_in_order(keys[j], keys[j + step]);
      }
    }
  }
}

// How many of the candidates' squared distances are within a limit.
NACRE_INLINE int count_within(const float* d2, int size, float limit) {
  int n = 0;
  for (int i = 0; i < size; i += lanes) n += simd::NACRE_ISA::count(load(d2 + i) <= broadcast(limit));
  return n;
}

// Ranks the candidates of the first queries: at least k of them, or all that are within the radius. Where `most` is too
// few to hold the k-th and those as far away, the query is not ranked. Not inline: once for all types of points.
template <int most>
static void rank_candidates(const LocalQueries& local, const Candidates& candidates, int size, int k, Ranking& out) {
  alignas(64) int32_t rows[group_queries][most + 16];
  alignas(64) float d2[most_candidates + 16];
  const float aim = 0.5F * static_cast<float>(k + most);
  float limit = local.radius2;
  for (int query = 0; query < group_queries; ++query) {
    out.counts[query] = -1;
    int n = 0;
    if (query < size) {
      const F32 x = broadcast(local.q[0][query]), y = broadcast(local.q[1][query]), z = broadcast(local.q[2][query]);
      for (int i = 0; i < candidates.count; i += lanes) {
        const F32 dx = load(candidates.p[0] + i) - x, dy = load(candidates.p[1] + i) - y;
        const F32 dz = load(candidates.p[2] + i) - z;
        const F32 squared = dx * dx + dy * dy + dz * dz;
        store(d2 + i, squared);
        n += simd::NACRE_ISA::count(squared <= broadcast(limit));
      }
      // A limit that between k and `most` candidates are within; neighbouring queries have similar ones.
      float too_small = 0.0F, too_large = local.radius2;
      for (int pass = 0; pass < 12; ++pass) {
        if (n >= k && n <= most) break;
        if (n < k && limit >= local.radius2) break;
        (n < k ? too_small : too_large) = limit;
        const float guess = limit * aim / static_cast<float>(n + 1);
        limit = guess > too_small && guess < too_large ? guess : 0.5F * (too_small + too_large);
        if (n < k && guess >= too_large) limit = pass < 3 ? too_large : 0.5F * (too_small + too_large);
        n = count_within(d2, candidates.count, limit);
      }
      if (n > most) {
        n = 0;
      } else {
        out.counts[query] = n;
        int32_t* row = rows[query];
        for (int i = 0; i < candidates.count; i += lanes) {
          const F32 squared = load(d2 + i);
          const Mask near = squared <= broadcast(limit);
          store_chosen(row, near, shift_left<10>(truncate(squared)) + (lane_numbers() + broadcast(i)));
          row += simd::NACRE_ISA::count(near);
        }
      }
      out.limits[query] = limit;
      limit *= aim / static_cast<float>(n + 1);
      limit = limit < local.radius2 ? limit : local.radius2;
    }
    for (int i = n; i < most; i += lanes) store(rows[query] + i, broadcast(no_candidate));
  }
  for (int query = 0; query < size; query += lanes) {
    for (int rank = 0; rank < most; rank += lanes) {
      transpose(rows[query] + rank, most + 16, out.keys[rank] + query, group_queries);
    }
    sort_columns<most>(reinterpret_cast<Columns>(out.keys[0] + query));
  }
}

NACRE_INLINE void rank_candidates(const LocalQueries& local, const Candidates& candidates, int size, int k,
                                  Ranking& out) {
  if (k <= 8) {
    rank_candidates<16>(local, candidates, size, k, out);
  } else if (k <= 20) {
    rank_candidates<32>(local, candidates, size, k, out);
  } else if (k <= 44) {
    rank_candidates<64>(local, candidates, size, k, out);
  } else {
    rank_candidates<128>(local, candidates, size, k, out);
  }
}

// The first k of a query's ranking, and those that rounding may have put behind them; -1 where there is no ranking.
NACRE_INLINE int ranked_closely(const LocalQueries& local, const Ranking& ranking, int query, int k) {
  const int count = ranking.counts[query];
  if (count <= k) return count;
  const float last = static_cast<float>((ranking.keys[k - 1][query] >> 10) + 1) + 2.0F * local.margin;
  int close = k;
  while (close < count && static_cast<float>(ranking.keys[close][query] >> 10) <= last) ++close;
  return close;
}

// The local squared distance that no candidate of the query from a rank on is below, in spite of rounding.
NACRE_INLINE double beyond_rank(const LocalQueries& local, const Ranking& ranking, int query, int rank) {
  const float next =
      rank < ranking.counts[query] ? static_cast<float>(ranking.keys[rank][query] >> 10) : ranking.limits[query];
  return static_cast<double>(next - local.margin);
}

}  // namespace nacre::simd::NACRE_ISA
