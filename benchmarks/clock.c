/* Preloaded into a program, its clock is that of the machine plus the seconds that stand, as a 64-bit
   integer, in the file that CLOCK_OFFSET names. Clocks that only run forward are left alone. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

static volatile const int64_t *offset;
static int (*machine)(clockid_t, struct timespec *);

__attribute__((constructor)) static void begin(void) {
    machine = (int (*)(clockid_t, struct timespec *))dlsym(RTLD_NEXT, "clock_gettime");
    const char *name = getenv("CLOCK_OFFSET");
    int file = name ? open(name, O_RDONLY | O_CLOEXEC) : -1;
    void *read = file < 0 ? MAP_FAILED : mmap(NULL, sizeof *offset, PROT_READ, MAP_SHARED, file, 0);
    if (read == MAP_FAILED) _exit(111);
    close(file);
    offset = read;
}

int clock_gettime(clockid_t clock, struct timespec *at) {
    if (!machine) begin();
    int failed = machine(clock, at);
    if (!failed && clock == CLOCK_REALTIME) at->tv_sec += *offset;
    return failed;
}
