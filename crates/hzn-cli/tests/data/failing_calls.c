/* Makes calls of the system fail, for the tests `a_failed_close` and `a_failed_truncation`:
   every close of a file whose path contains HZN_FAILING_CLOSE, as a network file system does that reports a full disk
   only then (the file is closed nevertheless, as Linux does), and every change of the length of a file whose path ends
   with HZN_FAILING_TRUNCATE. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

int close(int fd) {
    int (*real)(int) = (int (*)(int))dlsym(RTLD_NEXT, "close");
    const char *name = getenv("HZN_FAILING_CLOSE");
    char link[64], path[4096];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t length = readlink(link, path, sizeof path - 1);
    int flags = fcntl(fd, F_GETFL);
    int result = real(fd);
    if (name && length > 0 && flags >= 0 && (flags & O_ACCMODE) != O_RDONLY) {
        path[length] = 0;
        if (strstr(path, name)) {
            errno = EDQUOT;
            return -1;
        }
    }
    return result;
}

static int truncate_fails(int fd) {
    const char *name = getenv("HZN_FAILING_TRUNCATE");
    char link[64], path[4096];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t length = readlink(link, path, sizeof path - 1);
    size_t end = name ? strlen(name) : 0;
    return name && length >= (ssize_t)end && memcmp(path + length - end, name, end) == 0;
}

int ftruncate64(int fd, off64_t size) {
    int (*real)(int, off64_t) = (int (*)(int, off64_t))dlsym(RTLD_NEXT, "ftruncate64");
    if (truncate_fails(fd)) {
        errno = EDQUOT;
        return -1;
    }
    return real(fd, size);
}

int ftruncate(int fd, off_t size) {
    return ftruncate64(fd, size);
}
