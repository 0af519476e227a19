/* A file system and a clock that fail: preloaded into a program, it lets the n-th change below a folder fail, or the n-th reading of the clock.
 *
 * FAULT_FOLDER  changes of files below this folder count: making, writing, flushing, renaming, linking
 * FAULT_AT      the one that fails, from 1; 0 for none
 * FAULT_LASTS   if set, all that follow fail too, as on a disk that stays full
 * FAULT_COUNT   file that takes the number of changes so far, and the kind of the one that failed
 *
 * FAULT_THREAD  readings of the clock by threads of this name count; the one that fails makes Rust's standard library panic
 * FAULT_CLOCK   the one that fails, from 1
 *
 * Programs may call the kernel without the C library, so the calls are caught where they enter it: a seccomp filter raises SIGSYS, and the
 * handler makes the call from the one place that the filter lets through, or refuses it. Linux on x86-64. Source: seccomp(2), "SECCOMP_RET_TRAP".
 */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <signal.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <time.h>
#include <ucontext.h>
#include <unistd.h>

long fault_call(long number, long a, long b, long c, long d, long e, long f);
extern char fault_let_through[];
__asm__(".globl fault_call\n"
        "fault_call:\n"
        "  mov %rdi, %rax\n"
        "  mov %rsi, %rdi\n"
        "  mov %rdx, %rsi\n"
        "  mov %rcx, %rdx\n"
        "  mov %r8, %r10\n"
        "  mov %r9, %r8\n"
        "  mov 8(%rsp), %r9\n"
        "  syscall\n"
        ".globl fault_let_through\n"
        "fault_let_through:\n"
        "  ret\n");

static char folder[PATH_MAX];
static int report;
static size_t length;
static long at;
static int lasts;
static long changes;
static const char *failed = "none";

/* Whether a path lies below the folder; relative ones are asked for by their folder's descriptor. */
static int below(int from, const char *path) {
    char full[PATH_MAX];
    if (path[0] != '/') {
        char link[64];
        snprintf(link, sizeof link, from == AT_FDCWD ? "/proc/self/cwd" : "/proc/self/fd/%d", from);
        ssize_t n = readlink(link, full, sizeof full - 1);
        if (n < 0) return 0;
        full[n] = '/';
        strncpy(full + n + 1, path, sizeof full - (size_t)n - 2);
        full[sizeof full - 1] = 0;
        path = full;
    }
    return strncmp(path, folder, length) == 0;
}

static int open_below(int descriptor) {
    char link[64], full[PATH_MAX];
    snprintf(link, sizeof link, "/proc/self/fd/%d", descriptor);
    ssize_t n = readlink(link, full, sizeof full - 1);
    if (n < 0) return 0;
    full[n] = 0;
    return strncmp(full, folder, length) == 0;
}

/* What a call does to a file below the folder; NULL for nothing. */
static const char *change(long number, const long *a) {
    switch (number) {
    case SYS_write: case SYS_pwrite64: case SYS_writev: case SYS_ftruncate:
        return open_below((int)a[0]) ? "write" : NULL;
    case SYS_sendfile:
        return open_below((int)a[0]) ? "write" : NULL;
    case SYS_copy_file_range:
        return open_below((int)a[2]) ? "write" : NULL;
    case SYS_fsync: case SYS_fdatasync:
        return open_below((int)a[0]) ? "flush" : NULL;
    case SYS_rename: case SYS_link:
        return below(AT_FDCWD, (const char *)a[1]) ? (number == SYS_rename ? "rename" : "link") : NULL;
    case SYS_renameat: case SYS_renameat2: case SYS_linkat:
        return below((int)a[2], (const char *)a[3]) ? (number == SYS_linkat ? "link" : "rename") : NULL;
    case SYS_mkdir:
        return below(AT_FDCWD, (const char *)a[0]) ? "make" : NULL;
    case SYS_mkdirat: case SYS_openat:
        return below((int)a[0], (const char *)a[1]) ? "make" : NULL;
    case SYS_open:
        return below(AT_FDCWD, (const char *)a[0]) ? "make" : NULL;
    default:
        return NULL;
    }
}

/* At once: a program may end without a word. */
static void tell(long number) {
    char line[64];
    int n = snprintf(line, sizeof line, "%ld %s\n", number, failed);
    fault_call(SYS_pwrite64, report, (long)line, n, 0, 0, 0);
}

static void caught(int signal, siginfo_t *info, void *context) {
    (void)signal;
    greg_t *r = ((ucontext_t *)context)->uc_mcontext.gregs;
    long a[6] = {r[REG_RDI], r[REG_RSI], r[REG_RDX], r[REG_R10], r[REG_R8], r[REG_R9]};
    int kept = errno;
    const char *what = change(info->si_syscall, a);
    if (what) {
        long this = __atomic_add_fetch(&changes, 1, __ATOMIC_SEQ_CST);
        if (at > 0 && (this == at || (lasts && this > at))) {
            if (this == at) failed = what;
            tell(this);
            errno = kept;
            r[REG_RAX] = strcmp(what, "flush") == 0 ? -EIO : -ENOSPC;
            return;
        }
        tell(this);
    }
    errno = kept;
    r[REG_RAX] = fault_call(info->si_syscall, a[0], a[1], a[2], a[3], a[4], a[5]);
}

static const int CALLS[] = {SYS_write, SYS_pwrite64, SYS_writev, SYS_ftruncate, SYS_sendfile, SYS_copy_file_range, SYS_fsync, SYS_fdatasync,
                            SYS_rename, SYS_renameat, SYS_renameat2, SYS_link, SYS_linkat, SYS_mkdir, SYS_mkdirat};
#define COUNT (sizeof CALLS / sizeof *CALLS)

static void filter(void) {
    unsigned long place = (unsigned long)fault_let_through;
    struct sock_filter code[COUNT + 16];
    int n = 0;
#define LOAD(field) code[n++] = (struct sock_filter)BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, field))
#define IF(value, yes, no) code[n++] = (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, (value), (yes), (no))
    code[n++] = (struct sock_filter)BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, instruction_pointer));
    IF((unsigned)place, 0, 3);
    code[n++] = (struct sock_filter)BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, instruction_pointer) + 4);
    IF((unsigned)(place >> 32), 0, 1);
    code[n++] = (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
    LOAD(nr);
    for (size_t i = 0; i < COUNT; i++) IF((unsigned)CALLS[i], (unsigned char)(COUNT - i - 1 + 8), 0);
    /* Only files that are made: a program's own libraries are opened before the handler is there. */
    IF(SYS_openat, 2, 0);
    IF(SYS_open, 3, 0);
    code[n++] = (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
    LOAD(args[2]);
    code[n++] = (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JA, 1, 0, 0);
    LOAD(args[1]);
    code[n++] = (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JSET | BPF_K, O_CREAT, 1, 0);
    code[n++] = (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
    code[n++] = (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_TRAP);
    struct sock_fprog program = {(unsigned short)n, code};
    if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) || prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program)) {
        perror("fail.c: no filter");
        _exit(99);
    }
}

static const char *of_thread;
static long clock_at;
static long readings;

int clock_gettime(clockid_t clock, struct timespec *time) {
    char name[16] = "";
    if (of_thread && prctl(PR_GET_NAME, name) == 0 && strcmp(name, of_thread) == 0 && __atomic_add_fetch(&readings, 1, __ATOMIC_SEQ_CST) == clock_at) {
        errno = EINVAL;
        return -1;
    }
    return (int)syscall(SYS_clock_gettime, clock, time);
}

__attribute__((constructor)) static void begin(void) {
    const char *reading = getenv("FAULT_CLOCK");
    clock_at = reading ? atol(reading) : 0;
    of_thread = getenv("FAULT_THREAD");
    const char *named = getenv("FAULT_FOLDER"), *count = getenv("FAULT_COUNT"), *number = getenv("FAULT_AT");
    if (!named || !count) return;
    snprintf(folder, sizeof folder, "%s", named);
    report = open(count, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    length = strlen(folder);
    at = number ? atol(number) : 0;
    lasts = getenv("FAULT_LASTS") != NULL;
    struct sigaction action = {.sa_sigaction = caught, .sa_flags = SA_SIGINFO | SA_NODEFER};
    sigaction(SIGSYS, &action, NULL);
    filter();
}
