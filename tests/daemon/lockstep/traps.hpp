// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace backwash::test {

/// What a real-time function must not do, counted while the calling thread is inside a Watched scope. The program's own
/// malloc family, pthread locks and clocks take the C library's place (traps.cpp), so that libraries are seen too.
struct Trapped {
  long allocations = 0;  ///< malloc, calloc, realloc, free and the aligned ones
  long locks = 0;        ///< mutex, read-write lock, condition variable, semaphore
  long wall_clock = 0;   ///< CLOCK_REALTIME, gettimeofday, time
  long total() const { return allocations + locks + wall_clock; }
};

/// While one lives, this thread is watched.
class Watched {
 public:
  Watched();
  ~Watched();
  Watched(const Watched&) = delete;
  Watched& operator=(const Watched&) = delete;
};

/// How many scopes were opened so far, by any thread.
long watched_scopes();
/// All that was counted on this thread.
Trapped trapped();
/// A disk that does not answer: while true, write() to a regular file waits.
void hang_disk(bool hangs);
/// Writes that wait now, and fdatasync() calls so far.
int hanging_writes();
int disk_syncs();
/// Flags of the last mlockall(), 0 before the first.
int locked_with();
/// False in builds whose sanitizer owns these functions.
bool traps_work();

}  // namespace backwash::test
