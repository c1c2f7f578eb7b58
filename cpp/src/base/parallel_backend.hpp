// What lends threads to a loop: OpenMP, whose team a program's own loops share, or a pool of nacre's own. A build has
// one of them (NACRE_PARALLEL); with OpenMP it has the pool, too, for processes that were forked.
#pragma once

namespace nacre {

// What each thread of a team does; throws nothing.
using TeamWork = void (*)(void* context);

namespace openmp {

int usable_threads();

// work(context) on the caller's thread and, at the same time, on up to num_threads - 1 others.
void run_team(int num_threads, TeamWork work, void* context);

}  // namespace openmp

namespace threads {

// As above. A thread that wakes up after the caller is done does not work at all.
int usable_threads();
void run_team(int num_threads, TeamWork work, void* context);

}  // namespace threads
}  // namespace nacre
