// SPDX-License-Identifier: BSD-3-Clause
// What qemu-user 7.2 does not pass on, answered by a library that is preloaded:
// - TCGETS2 and TCSETS2 (ENOSYS), by which a serial port gets a speed of any value: for pseudo-terminals, which have a
// speed
//   in name alone, all but the speed is set through TCSETS.
// - IP_MULTICAST_IF (EOPNOTSUPP): taken and not set, the route decides. Right where only one interface is up.
#define _GNU_SOURCE
#include <asm/termbits.h>
#include <dlfcn.h>
#include <netinet/in.h>
#include <stdarg.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>

enum { kTerminals = 4096 };
static unsigned speeds[kTerminals];  // by number of the pseudo-terminal; 0: as it was opened

static int (*real_ioctl(void))(int, unsigned long, ...) {
  static int (*real)(int, unsigned long, ...);
  if (!real) *(void**)&real = dlsym(RTLD_NEXT, "ioctl");
  return real;
}

// The same for both ends of a line.
static unsigned* speed_of(int fd) {
  unsigned number = 0;
  struct stat about;
  if (real_ioctl()(fd, TIOCGPTN, &number) != 0) number = fstat(fd, &about) == 0 ? minor(about.st_rdev) : 0;
  return &speeds[number % kTerminals];
}

int ioctl(int fd, unsigned long request, ...) {
  va_list arguments;
  va_start(arguments, request);
  void* argument = va_arg(arguments, void*);
  va_end(arguments);
  int (*const real)(int, unsigned long, ...) = real_ioctl();
  const unsigned long get = request & 0xffffffffUL;  // an int's sign may have been spread
  if (get != TCGETS2 && get != TCSETS2) return real(fd, request, argument);
  struct termios2* wide = argument;
  struct termios narrow;
  if (get == TCGETS2) {
    const int result = real(fd, TCGETS, &narrow);
    if (result != 0) return result;
    memcpy(wide, &narrow, sizeof narrow);
    const unsigned speed = *speed_of(fd);
    wide->c_ispeed = wide->c_ospeed = speed ? speed : 38400;
    if (speed) wide->c_cflag = (wide->c_cflag & ~(tcflag_t)CBAUD) | BOTHER;
    return 0;
  }
  memcpy(&narrow, wide, sizeof narrow);
  narrow.c_cflag = (narrow.c_cflag & ~(tcflag_t)CBAUD) | B38400;
  const int result = real(fd, TCSETS, &narrow);
  if (result == 0 && (wide->c_cflag & CBAUD) == BOTHER) *speed_of(fd) = wide->c_ospeed;
  return result;
}

int setsockopt(int fd, int level, int option, const void* value, socklen_t size) {
  static int (*real)(int, int, int, const void*, socklen_t);
  if (!real) *(void**)&real = dlsym(RTLD_NEXT, "setsockopt");
  if (level == IPPROTO_IP && option == IP_MULTICAST_IF) return 0;
  return real(fd, level, option, value, size);
}
