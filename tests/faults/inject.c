// Makes one system call fail with EIO: the call number FAULT_NTH of the function FAULT_CALL, among
// its calls on files below FAULT_FOLDER. Creates the file FAULT_MARK at that moment. LD_PRELOAD
// loads this library on Linux. tests/processes/outputs.rs builds it.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

static const char *call, *folder, *mark;
static int nth;
static atomic_int seen;

__attribute__((constructor)) static void start(void) {
    call = getenv("FAULT_CALL");
    folder = getenv("FAULT_FOLDER");
    mark = getenv("FAULT_MARK");
    const char *n = getenv("FAULT_NTH");
    nth = n ? atoi(n) : 0;
}

// Relative names count, because the program is started in the folder.
static int path_counts(const char *path) {
    return path[0] != '/' || strncmp(path, folder, strlen(folder)) == 0;
}

static int file_counts(int fd) {
    char link[64], path[4096];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t length = readlink(link, path, sizeof path - 1);
    if (length < 0) return 0;
    path[length] = 0;
    return path[0] == '/' && path_counts(path);
}

// Returns 1 if this call must fail.
static int fails(const char *name, const char *path, int fd) {
    if (!call || !folder || !mark || strcmp(call, name) != 0) return 0;
    if (path ? !path_counts(path) : !file_counts(fd)) return 0;
    if (atomic_fetch_add(&seen, 1) + 1 != nth) return 0;
    int (*open)(const char *, int, ...) = (int (*)(const char *, int, ...))dlsym(RTLD_NEXT, "open");
    close(open(mark, O_CREAT | O_WRONLY, 0666));
    errno = EIO;
    return 1;
}

#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

#define OPEN(name)                                                          \
    int name(const char *path, int flags, ...) {                            \
        va_list arguments;                                                  \
        va_start(arguments, flags);                                         \
        int mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(arguments, int) : 0; \
        va_end(arguments);                                                  \
        return fails("open", path, -1) ? -1 : REAL(name)(path, flags, mode); \
    }
OPEN(open)
OPEN(open64)

#define OPENAT(name)                                                        \
    int name(int at, const char *path, int flags, ...) {                    \
        va_list arguments;                                                  \
        va_start(arguments, flags);                                         \
        int mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(arguments, int) : 0; \
        va_end(arguments);                                                  \
        return fails("open", path, -1) ? -1 : REAL(name)(at, path, flags, mode); \
    }
OPENAT(openat)
OPENAT(openat64)

ssize_t read(int fd, void *bytes, size_t count) {
    return fails("read", NULL, fd) ? -1 : REAL(read)(fd, bytes, count);
}
ssize_t readv(int fd, const struct iovec *parts, int count) {
    return fails("read", NULL, fd) ? -1 : REAL(readv)(fd, parts, count);
}
ssize_t pread64(int fd, void *bytes, size_t count, off64_t at) {
    return fails("read", NULL, fd) ? -1 : REAL(pread64)(fd, bytes, count, at);
}
ssize_t write(int fd, const void *bytes, size_t count) {
    return fails("write", NULL, fd) ? -1 : REAL(write)(fd, bytes, count);
}
ssize_t writev(int fd, const struct iovec *parts, int count) {
    return fails("write", NULL, fd) ? -1 : REAL(writev)(fd, parts, count);
}
ssize_t pwrite64(int fd, const void *bytes, size_t count, off64_t at) {
    return fails("write", NULL, fd) ? -1 : REAL(pwrite64)(fd, bytes, count, at);
}
int fsync(int fd) {
    return fails("fsync", NULL, fd) ? -1 : REAL(fsync)(fd);
}
int fdatasync(int fd) {
    return fails("fsync", NULL, fd) ? -1 : REAL(fdatasync)(fd);
}
int rename(const char *from, const char *to) {
    return fails("rename", to, -1) ? -1 : REAL(rename)(from, to);
}
void *mmap(void *at, size_t length, int protection, int flags, int fd, off_t offset) {
    int is_of_file = fd >= 0 && !(flags & MAP_ANONYMOUS);
    return is_of_file && fails("mmap", NULL, fd) ? MAP_FAILED : REAL(mmap)(at, length, protection, flags, fd, offset);
}
void *mmap64(void *at, size_t length, int protection, int flags, int fd, off64_t offset) {
    int is_of_file = fd >= 0 && !(flags & MAP_ANONYMOUS);
    return is_of_file && fails("mmap", NULL, fd) ? MAP_FAILED : REAL(mmap64)(at, length, protection, flags, fd, offset);
}
int statx(int at, const char *path, int flags, unsigned mask, struct statx *data) {
    int is_of_file = !path || !path[0];
    if (is_of_file ? fails("stat", NULL, at) : fails("stat", path, -1)) return -1;
    return REAL(statx)(at, path, flags, mask, data);
}
