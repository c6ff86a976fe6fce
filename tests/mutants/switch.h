/* SPDX-License-Identifier: BSD-3-Clause */
/* Included first by the rewritten copies of the sources, of C++ and of C, that mutants.py makes, and never by the
 * sources themselves. */
#ifndef BACKWASH_TESTS_MUTANTS_SWITCH_H_
#define BACKWASH_TESTS_MUTANTS_SWITCH_H_

#ifndef _GNU_SOURCE
#define _GNU_SOURCE 1 /* as g++ has it; C99 alone knows no open() */
#endif
#include <fcntl.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

/* Marks of the switches that were passed, by the last 16 bits of their numbers: two with one mark count both as
 * passed. */
#define BACKWASH_MUTANT_MARKS 65536

/* Number of the mutant that is on, from the environment variable BACKWASH_MUTANT; 0: none. One copy per source. */
static int backwash_mutant_active = 0;

/* The file that BACKWASH_MUTANTS_PASSED names, mapped: it outlives a crash and sees forked processes too. */
static unsigned char* backwash_mutants_passed = NULL;

/* Before every other initialisation, so that constants see it too. */
__attribute__((constructor(101))) static void backwash_mutant_read(void) {
  const char* number = getenv("BACKWASH_MUTANT");
  const char* marks = getenv("BACKWASH_MUTANTS_PASSED");
  const int file = marks ? open(marks, O_RDWR | O_CLOEXEC) : -1;
  backwash_mutant_active = number ? atoi(number) : 0;
  if (file >= 0) {
    void* map = mmap(NULL, BACKWASH_MUTANT_MARKS, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, file, 0);
    close(file);
    if (map == MAP_FAILED) abort();
    backwash_mutants_passed = (unsigned char*)map;
  }
}

/* Whether mutant `n` is on. Real-time: wait-free, no allocation. */
__attribute__((unused)) static inline int backwash_mutant_on(int n) {
  if (backwash_mutants_passed) backwash_mutants_passed[n % BACKWASH_MUTANT_MARKS] = 1;
  return backwash_mutant_active == n;
}

#endif
