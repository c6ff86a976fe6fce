// SPDX-License-Identifier: BSD-3-Clause
#include "tests/daemon/lockstep/traps.hpp"

#include <dlfcn.h>
#include <pthread.h>
#include <semaphore.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstddef>

#if defined(__has_feature)
#if __has_feature(realtime_sanitizer)
#define BACKWASH_RTSAN 1
// What the compiler itself calls around a [[clang::nonblocking]] function.
extern "C" void __rtsan_realtime_enter();
extern "C" void __rtsan_realtime_exit();
#endif
#endif

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define BACKWASH_TRAPS 0
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(realtime_sanitizer)
#define BACKWASH_TRAPS 0
#endif
#endif
#ifndef BACKWASH_TRAPS
#define BACKWASH_TRAPS 1
#endif

namespace backwash::test {
namespace {

thread_local int depth = 0;
std::atomic<long> scopes{0};
thread_local Trapped counted;
std::atomic<bool> disk_hangs{false};
std::atomic<int> writes_hanging{0}, syncs{0}, lock_flags{0};

#if BACKWASH_TRAPS
void note(long Trapped::*kind) {
  if (depth > 0) ++(counted.*kind);
}

void count_sync() { ++syncs; }
void note_lock(int flags) { lock_flags = flags; }

// As a disk that does not answer does it: without an end, and for files alone.
void wait_for_disk(int fd) {
  struct stat status {};
  if (!disk_hangs || ::fstat(fd, &status) != 0 || !S_ISREG(status.st_mode)) return;
  ++writes_hanging;
  while (disk_hangs) ::usleep(1000);
  --writes_hanging;
}

// The C library's own function; looked up outside of any watched scope, at the program's start.
template <typename F>
F* next(const char* name) {
  return reinterpret_cast<F*>(dlsym(RTLD_NEXT, name));
}
#endif

}  // namespace

// Where clang's RealtimeSanitizer is built in, it watches the same scopes with its own traps, system calls included.
Watched::Watched() {
  ++depth;
  ++scopes;
#ifdef BACKWASH_RTSAN
  __rtsan_realtime_enter();
#endif
}
Watched::~Watched() {
#ifdef BACKWASH_RTSAN
  __rtsan_realtime_exit();
#endif
  --depth;
}
long watched_scopes() { return scopes; }
Trapped trapped() { return counted; }
void hang_disk(bool hangs) { disk_hangs = hangs; }
int hanging_writes() { return writes_hanging; }
int disk_syncs() { return syncs; }
int locked_with() { return lock_flags; }
bool traps_work() { return BACKWASH_TRAPS != 0; }

}  // namespace backwash::test

#if BACKWASH_TRAPS
using backwash::test::next;
using backwash::test::note;
using backwash::test::Trapped;

extern "C" {

void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);

void* malloc(std::size_t size) {
  note(&Trapped::allocations);
  return __libc_malloc(size);
}
void* calloc(std::size_t n, std::size_t size) {
  note(&Trapped::allocations);
  return __libc_calloc(n, size);
}
void* realloc(void* p, std::size_t size) {
  note(&Trapped::allocations);
  return __libc_realloc(p, size);
}
void* memalign(std::size_t a, std::size_t size) {
  note(&Trapped::allocations);
  return __libc_memalign(a, size);
}
void* aligned_alloc(std::size_t a, std::size_t size) {
  note(&Trapped::allocations);
  return __libc_memalign(a, size);
}
int posix_memalign(void** p, std::size_t a, std::size_t size) {
  note(&Trapped::allocations);
  *p = __libc_memalign(a, size);
  return *p ? 0 : ENOMEM;
}
void free(void* p) {
  if (p) note(&Trapped::allocations);
  __libc_free(p);
}

int pthread_mutex_lock(pthread_mutex_t* m) noexcept {
  static auto* const real = next<int(pthread_mutex_t*)>("pthread_mutex_lock");
  note(&Trapped::locks);
  return real(m);
}
int pthread_mutex_timedlock(pthread_mutex_t* m, const timespec* t) noexcept {
  static auto* const real = next<int(pthread_mutex_t*, const timespec*)>("pthread_mutex_timedlock");
  note(&Trapped::locks);
  return real(m, t);
}
int pthread_rwlock_rdlock(pthread_rwlock_t* l) noexcept {
  static auto* const real = next<int(pthread_rwlock_t*)>("pthread_rwlock_rdlock");
  note(&Trapped::locks);
  return real(l);
}
int pthread_rwlock_wrlock(pthread_rwlock_t* l) noexcept {
  static auto* const real = next<int(pthread_rwlock_t*)>("pthread_rwlock_wrlock");
  note(&Trapped::locks);
  return real(l);
}
int pthread_cond_wait(pthread_cond_t* c, pthread_mutex_t* m) {
  static auto* const real = next<int(pthread_cond_t*, pthread_mutex_t*)>("pthread_cond_wait");
  note(&Trapped::locks);
  return real(c, m);
}
int pthread_cond_timedwait(pthread_cond_t* c, pthread_mutex_t* m, const timespec* t) {
  static auto* const real = next<int(pthread_cond_t*, pthread_mutex_t*, const timespec*)>("pthread_cond_timedwait");
  note(&Trapped::locks);
  return real(c, m, t);
}
int sem_wait(sem_t* s) {
  static auto* const real = next<int(sem_t*)>("sem_wait");
  note(&Trapped::locks);
  return real(s);
}

int clock_gettime(clockid_t id, timespec* t) noexcept {
  static auto* const real = next<int(clockid_t, timespec*)>("clock_gettime");
  if (id == CLOCK_REALTIME || id == CLOCK_REALTIME_COARSE) note(&Trapped::wall_clock);
  return real(id, t);
}
int gettimeofday(timeval* t, void* zone) noexcept {
  static auto* const real = next<int(timeval*, void*)>("gettimeofday");
  note(&Trapped::wall_clock);
  return real(t, zone);
}
time_t time(time_t* t) noexcept {
  static auto* const real = next<time_t(time_t*)>("time");
  note(&Trapped::wall_clock);
  return real(t);
}

ssize_t write(int fd, const void* bytes, std::size_t size) {
  backwash::test::wait_for_disk(fd);
  return ::syscall(SYS_write, fd, bytes, size);
}
int mlockall(int flags) noexcept {
  backwash::test::note_lock(flags);
  return static_cast<int>(::syscall(SYS_mlockall, flags));
}
int fdatasync(int fd) {
  backwash::test::count_sync();
  return static_cast<int>(::syscall(SYS_fdatasync, fd));
}

}  // extern "C"
#endif
