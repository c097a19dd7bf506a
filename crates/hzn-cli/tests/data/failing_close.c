/* Makes every close fail of a file whose path contains HZN_FAILING_CLOSE, as a network file system does that reports a
   full disk only then. The file is closed nevertheless, as Linux does. For the test `failed_close`. */
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
