/* io/in and io/out: whole inputs, outputs that appear whole or not at all. */
#define _GNU_SOURCE /* posix_openpt and its kin */
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "io/in.h"
#include "io/out.h"
#include "tests/unit/test.h"

static char folder[] = "/tmp/test_io-XXXXXX";
static VolError err;
static const VolOutOptions plain = {0};

static const char *in_folder(const char *name)
{
    static char paths[4][300];
    static int next;
    next = (next + 1) % 4;
    snprintf(paths[next], sizeof paths[next], "%s/%s", folder, name);
    return paths[next];
}

/* Files in the folder whose names hold `part`. */
static int count_files(const char *part)
{
    int count = 0;
    DIR *dir = opendir(folder);
    for (struct dirent *entry; (entry = readdir(dir));)
        count += entry->d_name[0] && strcmp(entry->d_name, ".") && strcmp(entry->d_name, "..") &&
                 strstr(entry->d_name, part);
    closedir(dir);
    return count;
}

static void check_content(const char *path, const char *want)
{
    VolBytes bytes;
    CHECK(vol_read_whole(path, false, &bytes, &err) == VOL_OK);
    if (bytes.size != strlen(want) || memcmp(bytes.data, want, bytes.size) != 0)
        FAIL("'%s' holds %zu bytes", path, bytes.size);
    vol_bytes_free(&bytes);
}

static void test_write_and_read(void)
{
    const char *path = in_folder("a.txt");
    mode_t before = umask(027);
    CHECK(vol_write_whole(path, "hello", 5, plain, &err) == VOL_OK);
    check_content(path, "hello");
    struct stat info;
    CHECK(stat(path, &info) == 0 && (info.st_mode & 07777) == 0640);
    umask(before);
    CHECK(vol_write_whole(path, "longer text", 11, plain, &err) == VOL_OK);
    check_content(path, "longer text");
    CHECK(vol_write_whole(path, "", 0, plain, &err) == VOL_OK);
    check_content(path, "");
    CHECK(count_files("vol-") == 0 && count_files("a.txt") == 1);
}

static void test_relative_name(void)
{
    char back[4096];
    CHECK(getcwd(back, sizeof back) && chdir(folder) == 0);
    CHECK(vol_write_whole("rel", "x", 1, plain, &err) == VOL_OK);
    CHECK(chdir(back) == 0);
    check_content(in_folder("rel"), "x");
}

static void test_link_stays(void)
{
    CHECK(vol_write_whole(in_folder("target"), "old", 3, plain, &err) == VOL_OK);
    CHECK(symlink("target", in_folder("link")) == 0);
    CHECK(vol_write_whole(in_folder("link"), "new", 3, plain, &err) == VOL_OK);
    struct stat info;
    CHECK(lstat(in_folder("link"), &info) == 0 && S_ISLNK(info.st_mode));
    check_content(in_folder("target"), "new");
}

static void test_long_name(void)
{
    char name[256];
    memset(name, 'n', 255);
    name[255] = 0;
    CHECK(vol_write_whole(in_folder(name), "x", 1, plain, &err) == VOL_OK); /* the temporary's name is cut */
    check_content(in_folder(name), "x");
}

static void check_refused(const char *path, VolStatus want, const char *part)
{
    CHECK(vol_check_output(path, plain, &err) == want);
    CHECK(vol_write_whole(path, "x", 1, plain, &err) == want);
    if (!strstr(err.text, part) || !strstr(err.text, path))
        FAIL("'%s' says '%s'", path, err.text);
}

static void test_bad_outputs(void)
{
    check_refused(folder, VOL_IO, "Is a directory");
    check_refused(in_folder("none/x"), VOL_IO, "No such file");
    check_refused(in_folder("a.txt/x"), VOL_IO, "folder");
    check_refused("", VOL_USAGE, "needs a name");
    CHECK(vol_write_whole("/dev/full", "x", 1, plain, &err) == VOL_IO);
    CHECK_TEXT(err.text, "cannot write '/dev/full': No space left on device");
    CHECK(vol_write_whole("/dev/null", "x", 1, plain, &err) == VOL_OK);
    struct stat info;
    CHECK(stat("/dev/null", &info) == 0 && S_ISCHR(info.st_mode));
    CHECK(count_files("vol-") == 0);
}

/* A disk that is full, played by a limit on the size of files: no temporary stays and the old file is whole. */
static void test_failed_write(void)
{
    const char *path = in_folder("kept");
    CHECK(vol_write_whole(path, "old", 3, plain, &err) == VOL_OK);
    pid_t child = fork();
    if (child == 0) {
        static char big[100000];
        signal(SIGXFSZ, SIG_IGN);
        setrlimit(RLIMIT_FSIZE, &(struct rlimit){5000, 5000});
        _exit(vol_write_whole(path, big, sizeof big, plain, &err) == VOL_IO ? 0 : 1);
    }
    int status = 1;
    CHECK(waitpid(child, &status, 0) == child && status == 0);
    check_content(path, "old");
    CHECK(count_files("vol-") == 0);
}

static void clean_up_and_die(int number)
{
    vol_unlink_temporaries();
    signal(number, SIG_DFL);
    raise(number);
}

/* A child is stopped while it writes a file of a gigabyte. */
static void test_signal(void)
{
    const char *path = in_folder("stopped");
    size_t size = (size_t)1 << 30;
    pid_t child = fork();
    if (child == 0) {
        void *zeros = mmap(NULL, size, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        struct sigaction action = {.sa_handler = clean_up_and_die, .sa_flags = SA_NODEFER};
        sigset_t none;
        sigemptyset(&none);
        sigprocmask(SIG_SETMASK, &none, NULL); /* files written above keep signals blocked */
        sigaction(SIGTERM, &action, NULL);
        vol_write_whole(path, zeros, size, plain, &err);
        _exit(0);
    }
    for (int i = 0; i < 10000 && count_files(".stopped.vol-") == 0; i++)
        usleep(500);
    CHECK(count_files(".stopped.vol-") == 1);
    kill(child, SIGTERM);
    int status = 0;
    CHECK(waitpid(child, &status, 0) == child && WIFSIGNALED(status) && WTERMSIG(status) == SIGTERM);
    CHECK(count_files("stopped") == 0);
}

static void test_fifo(void)
{
    const char *path = in_folder("fifo");
    CHECK(mkfifo(path, 0600) == 0);
    pid_t child = fork();
    if (child == 0)
        _exit(vol_write_whole(path, "through", 7, plain, &err) == VOL_OK ? 0 : 1);
    check_content(path, "through");
    int status = 1;
    CHECK(waitpid(child, &status, 0) == child && status == 0);
    struct stat info;
    CHECK(stat(path, &info) == 0 && S_ISFIFO(info.st_mode));
}

static void test_broken_pipe(void)
{
    int ends[2], saved = dup(STDOUT_FILENO);
    signal(SIGPIPE, SIG_IGN);
    CHECK(pipe(ends) == 0);
    fflush(stdout);
    dup2(ends[1], STDOUT_FILENO);
    close(ends[0]);
    close(ends[1]);
    VolStatus status = vol_write_whole("-", "x", 1, plain, &err);
    dup2(saved, STDOUT_FILENO);
    close(saved);
    CHECK(status == VOL_IO);
    CHECK_TEXT(err.text, "cannot write 'stdout': Broken pipe");
}

/* ---- reading ---- */

/* Runs `read` with stdin on fd. */
static VolStatus read_stdin_from(int fd, VolBytes *bytes)
{
    int saved = dup(STDIN_FILENO);
    dup2(fd, STDIN_FILENO);
    VolStatus status = vol_read_whole("-", false, bytes, &err);
    dup2(saved, STDIN_FILENO);
    close(saved);
    return status;
}

static void test_read_stdin(void)
{
    VolBytes bytes;
    int ends[2];
    enum { SIZE = 300000 };
    char *data = malloc(SIZE);
    for (int i = 0; i < SIZE; i++)
        data[i] = (char)(i * 7);
    CHECK(vol_write_whole(in_folder("big"), data, SIZE, plain, &err) == VOL_OK);
    CHECK(pipe(ends) == 0);
    pid_t child = fork();
    if (child == 0) {
        for (int at = 0; at < SIZE; at += 1000)
            if (write(ends[1], data + at, 1000) != 1000)
                _exit(1);
        _exit(0);
    }
    close(ends[1]);
    CHECK(read_stdin_from(ends[0], &bytes) == VOL_OK);
    CHECK(bytes.size == SIZE && !memcmp(bytes.data, data, SIZE));
    vol_bytes_free(&bytes);
    close(ends[0]);
    waitpid(child, NULL, 0);
    int fd = open(in_folder("big"), O_RDONLY);
    CHECK(read_stdin_from(fd, &bytes) == VOL_OK);
    CHECK(bytes.size == SIZE && !memcmp(bytes.data, data, SIZE));
    vol_bytes_free(&bytes);
    lseek(fd, 1000, SEEK_SET); /* somebody has read a part: what is left counts */
    CHECK(read_stdin_from(fd, &bytes) == VOL_OK);
    CHECK(bytes.size == SIZE - 1000 && !memcmp(bytes.data, data + 1000, SIZE - 1000));
    vol_bytes_free(&bytes);
    close(fd);
    free(data);
}

static void test_bad_inputs(void)
{
    VolBytes bytes;
    CHECK(vol_read_whole(in_folder("none"), false, &bytes, &err) == VOL_IO && strstr(err.text, "cannot open '"));
    CHECK(vol_read_whole(folder, false, &bytes, &err) == VOL_IO && strstr(err.text, "Is a directory"));
    CHECK_TEXT(vol_input_name("-"), "stdin");
    CHECK_TEXT(vol_input_name("a"), "a");
}

static void test_terminals(void)
{
    int terminal = posix_openpt(O_RDWR | O_NOCTTY);
    if (terminal < 0 || grantpt(terminal) != 0 || unlockpt(terminal) != 0) {
        FAIL("no pseudo-terminal: %s", strerror(errno));
        return;
    }
    const char *name = ptsname(terminal);
    VolBytes bytes;
    int fd = open(name, O_RDWR | O_NOCTTY);
    CHECK(read_stdin_from(fd, &bytes) == VOL_USAGE && strstr(err.text, "terminal"));
    CHECK(vol_write_whole(name, "x", 1, (VolOutOptions){.binary = true}, &err) == VOL_USAGE);
    CHECK(vol_write_whole(name, "x", 1, (VolOutOptions){.binary = true, .allow_terminal = true}, &err) == VOL_OK);
    CHECK(vol_write_whole(name, "x", 1, plain, &err) == VOL_OK);
    int saved = dup(STDOUT_FILENO);
    fflush(stdout);
    dup2(fd, STDOUT_FILENO);
    VolStatus binary = vol_check_output("-", (VolOutOptions){.binary = true}, &err);
    VolStatus text = vol_check_output("-", plain, &err);
    dup2(saved, STDOUT_FILENO);
    CHECK(binary == VOL_USAGE && text == VOL_OK);
    close(saved);
    close(fd);
    close(terminal);
}

static VolKind kind_of(const char *data, size_t size)
{
    return vol_kind(&(VolBytes){.data = (unsigned char *)(size_t)data, .size = size});
}

static void test_kinds(void)
{
    CHECK(kind_of(" BDV\0\0\0\0rest", 12) == VOL_KIND_VDB);
    CHECK(kind_of(" BDV\0\0\0", 7) == VOL_KIND_OTHER);
    CHECK(kind_of("\x76\x2f\x31\x01", 4) == VOL_KIND_EXR);
    CHECK(kind_of("{", 1) == VOL_KIND_JSON);
    CHECK(kind_of("\xef\xbb\xbf \n\t\r[1]", 10) == VOL_KIND_JSON);
    CHECK(kind_of("   ", 3) == VOL_KIND_OTHER);
    CHECK(kind_of("x{", 2) == VOL_KIND_OTHER);
    CHECK(kind_of("", 0) == VOL_KIND_EMPTY);
}

int main(void)
{
    if (!mkdtemp(folder))
        return 1;
    RUN(test_write_and_read);
    RUN(test_relative_name);
    RUN(test_link_stays);
    RUN(test_long_name);
    RUN(test_bad_outputs);
    RUN(test_failed_write);
    RUN(test_signal);
    RUN(test_fifo);
    RUN(test_broken_pipe);
    RUN(test_read_stdin);
    RUN(test_bad_inputs);
    RUN(test_terminals);
    RUN(test_kinds);
    char command[100];
    snprintf(command, sizeof command, "rm -rf %s", folder);
    return test_end() | (system(command) != 0);
}
