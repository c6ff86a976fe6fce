// SPDX-License-Identifier: BSD-3-Clause
// Preloaded into a process, it moves that process's wall clock by as many seconds as the first eight bytes of the file
// CLOCK_SHIM say, a little-endian integer that may change at any time. The monotonic clocks stay. Deadlines by the wall
// clock are brought back, so that waiting takes as long as it would if the machine's clock had been set.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <semaphore.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <time.h>

static const volatile int64_t* offset_s;
static int (*real_gettime)(clockid_t, struct timespec*);

__attribute__((constructor)) static void map_offset(void) {
  real_gettime = (int (*)(clockid_t, struct timespec*))dlsym(RTLD_NEXT, "clock_gettime");
  const char* path = getenv("CLOCK_SHIM");
  const int fd = path ? open(path, O_RDONLY) : -1;
  void* page = fd < 0 ? MAP_FAILED : mmap(NULL, sizeof(int64_t), PROT_READ, MAP_SHARED, fd, 0);
  if (page != MAP_FAILED) offset_s = page;
}

static int64_t offset(void) { return offset_s ? *offset_s : 0; }

int clock_gettime(clockid_t id, struct timespec* t) {
  if (!real_gettime) map_offset();
  const int result = real_gettime(id, t);
  if (result == 0 && (id == CLOCK_REALTIME || id == CLOCK_REALTIME_COARSE)) t->tv_sec += offset();
  return result;
}

int gettimeofday(struct timeval* restrict t, void* restrict zone) {
  struct timespec now;
  (void)zone;
  const int result = clock_gettime(CLOCK_REALTIME, &now);
  t->tv_sec = now.tv_sec;
  t->tv_usec = now.tv_nsec / 1000;
  return result;
}

time_t time(time_t* t) {
  struct timespec now;
  clock_gettime(CLOCK_REALTIME, &now);
  if (t) *t = now.tv_sec;
  return now.tv_sec;
}

// A deadline by the monotonic clock counts from the machine's start, by the wall clock from 1970.
static struct timespec unmoved(const struct timespec* deadline) {
  struct timespec t = *deadline;
  if (t.tv_sec > 1000000000) t.tv_sec -= offset();
  return t;
}

int pthread_cond_timedwait(pthread_cond_t* restrict c, pthread_mutex_t* restrict m,
                           const struct timespec* restrict deadline) {
  static int (*real)(pthread_cond_t*, pthread_mutex_t*, const struct timespec*);
  if (!real)
    real =
        (int (*)(pthread_cond_t*, pthread_mutex_t*, const struct timespec*))dlsym(RTLD_NEXT, "pthread_cond_timedwait");
  const struct timespec t = unmoved(deadline);
  return real(c, m, &t);
}

int sem_timedwait(sem_t* restrict s, const struct timespec* restrict deadline) {
  static int (*real)(sem_t*, const struct timespec*);
  if (!real) real = (int (*)(sem_t*, const struct timespec*))dlsym(RTLD_NEXT, "sem_timedwait");
  const struct timespec t = unmoved(deadline);
  return real(s, &t);
}
