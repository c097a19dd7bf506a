// Records what a program does to files, in order: LD_PRELOAD it, and name the log in HZN_RECORD_LOG.
//
// A record is a line (kind, file descriptor, number, path, second path) and, for a write, the bytes.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

static int log_fd(void) {
    static int fd = -1;
    if (fd < 0) {
        const char *path = getenv("HZN_RECORD_LOG");
        if (path) fd = (int)syscall(SYS_openat, AT_FDCWD, path, O_WRONLY | O_CREAT | O_APPEND, 0600);
    }
    return fd;
}

// One call of writev, so that the records of two threads do not mix.
static void record(char kind, int fd, long n, const char *a, const char *b, const void *bytes, size_t size) {
    char line[8192];
    int length = snprintf(line, sizeof line, "%c\t%d\t%ld\t%s\t%s\n", kind, fd, n, a, b);
    struct iovec parts[2] = {{line, (size_t)length}, {(void *)bytes, size}};
    if (log_fd() >= 0) syscall(SYS_writev, log_fd(), parts, size ? 2 : 1);
}

#define REAL(name) __typeof__(name) *real = (__typeof__(name) *)dlsym(RTLD_NEXT, #name)

int open64(const char *path, int flags, ...) {
    va_list list;
    va_start(list, flags);
    mode_t mode = (flags & (O_CREAT | O_TMPFILE)) ? va_arg(list, mode_t) : 0;
    va_end(list);
    REAL(open64);
    int fd = real(path, flags, mode);
    if (fd >= 0) record('o', fd, flags & O_TRUNC ? 1 : 0, path, "", 0, 0);
    return fd;
}

ssize_t write(int fd, const void *bytes, size_t size) {
    REAL(write);
    ssize_t n = real(fd, bytes, size);
    if (n > 0 && fd > 2) record('w', fd, n, "", "", bytes, (size_t)n);
    return n;
}

int ftruncate64(int fd, off64_t size) {
    REAL(ftruncate64);
    int done = real(fd, size);
    if (done == 0) record('t', fd, size, "", "", 0, 0);
    return done;
}

off64_t lseek64(int fd, off64_t offset, int whence) {
    REAL(lseek64);
    off64_t at = real(fd, offset, whence);
    if (at >= 0) record('l', fd, at, "", "", 0, 0);
    return at;
}

int fdatasync(int fd) {
    REAL(fdatasync);
    int done = real(fd);
    if (done == 0) record('s', fd, 0, "", "", 0, 0);
    return done;
}

int fsync(int fd) {
    REAL(fsync);
    int done = real(fd);
    if (done == 0) record('s', fd, 0, "", "", 0, 0);
    return done;
}

int rename(const char *from, const char *to) {
    REAL(rename);
    int done = real(from, to);
    if (done == 0) record('r', -1, 0, from, to, 0, 0);
    return done;
}

int unlink(const char *path) {
    REAL(unlink);
    int done = real(path);
    if (done == 0) record('u', -1, 0, path, "", 0, 0);
    return done;
}
