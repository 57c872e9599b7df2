// Preloaded into a program, makes what it asks the C library for fail, as the environment says:
//   FAULT_MEMORY=N    the N-th request for memory fails; N+: that one and all behind it
//   FAULT_COUNT=FILE  the number of requests for memory is written to FILE at the end
//   FAULT_MOVED=N     read() and write() move N bytes at most
//   FAULT_CLOCK=N     every second look at a clock is N seconds ahead
// Requests are counted from when the program's own code begins.
#define _GNU_SOURCE
#include <errno.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

void *__libc_malloc(size_t size);
void *__libc_calloc(size_t count, size_t size);
void *__libc_realloc(void *old, size_t size);
void *__libc_memalign(size_t alignment, size_t size);

static unsigned long requests, failing; // failing: the number of the first; 0: none
static int all_behind, began;
static size_t most_moved;
static long seconds_ahead;
static unsigned looks;

static long number_in(const char *name) {
    const char *text = getenv(name);
    return text ? strtol(text, NULL, 10) : 0;
}

__attribute__((constructor)) static void begin(void) {
    const char *memory = getenv("FAULT_MEMORY");
    failing = (unsigned long)number_in("FAULT_MEMORY");
    all_behind = memory && strchr(memory, '+');
    most_moved = (size_t)number_in("FAULT_MOVED");
    seconds_ahead = number_in("FAULT_CLOCK");
    began = 1;
}

__attribute__((destructor)) static void end(void) {
    const unsigned long counted = requests;
    const char *path = getenv("FAULT_COUNT");
    FILE *file = path ? fopen(path, "w") : NULL;
    if (!file) return;
    fprintf(file, "%lu\n", counted);
    fclose(file);
}

static int fails(void) {
    if (!began) return 0;
    ++requests;
    if (!failing || (all_behind ? requests < failing : requests != failing)) return 0;
    errno = ENOMEM;
    return 1;
}

void *malloc(size_t size) { return fails() ? NULL : __libc_malloc(size); }
void *calloc(size_t count, size_t size) { return fails() ? NULL : __libc_calloc(count, size); }
void *realloc(void *old, size_t size) { return fails() ? NULL : __libc_realloc(old, size); }
void *aligned_alloc(size_t alignment, size_t size) { return fails() ? NULL : __libc_memalign(alignment, size); }

static size_t moved(size_t size) { return most_moved && size > most_moved ? most_moved : size; }
ssize_t read(int file, void *to, size_t size) { return syscall(SYS_read, file, to, moved(size)); }
ssize_t write(int file, const void *from, size_t size) { return syscall(SYS_write, file, from, moved(size)); }

int clock_gettime(clockid_t clock, struct timespec *time) {
    const int status = (int)syscall(SYS_clock_gettime, clock, time);
    if (looks++ % 2) time->tv_sec += seconds_ahead;
    return status;
}
