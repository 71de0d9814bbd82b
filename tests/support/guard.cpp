// SPDX-License-Identifier: MIT
#include "tests/support/guard.h"

#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <new>
#include <set>
#include <string>
#include <string_view>

#include <mpf/backplane.h>
#include <mpf/file_descriptor.h>

#include "base/system_call.h"
#include "shm/segment.h"
#include "shm/segment_name.h"

namespace mpf::test {
namespace {

// Shared by the guard and the tests. Names that do not fit are not guarded.
struct Registry {
  static constexpr std::size_t kNames = 4096;
  static constexpr std::size_t kChars = 64;
  std::atomic<std::size_t> count{0};
  std::array<std::array<char, kChars>, kNames> names{};
};
Registry* registry = nullptr;        // null in a process without a guard
std::atomic<pid_t> testProcess = 0;  // used by the signal handler

// The tests inherit the descriptor of the registry; this variable has its number.
constexpr const char* kRegistryVariable = "MPF_TEST_REGISTRY";

void* mapRegistry(int descriptor) {
  auto* const memory =
      ::mmap(nullptr, sizeof(Registry), PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
  if (memory == MAP_FAILED) throwSystemError(errno, "mmap", "the registry of the guard");
  return memory;
}

FileDescriptor makeRegistry() {
  FileDescriptor file(checkCall(::memfd_create("mpf-test-registry", 0), "memfd_create"));
  checkCall(::ftruncate(file.get(), sizeof(Registry)), "ftruncate");
  registry = new (mapRegistry(file.get())) Registry;
  ::setenv(kRegistryVariable, std::to_string(file.get()).c_str(), 1);
  return file;
}

// A program that only lists its tests needs no guard. Under a debugger, the tests must run in the
// first process.
bool isGuardNeeded(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    if (std::string_view(argv[i]).starts_with("--gtest_list_tests")) return false;
  }
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    if (word == "TracerPid:") return status >> word && word == "0";
  }
  return true;
}

// ---- the guard

// Forwards signals for the guard to the tests. A terminal sends SIGINT and SIGQUIT to both.
void forwardSignals() {
  struct sigaction action{};
  action.sa_handler = [](int signal) { ::kill(testProcess, signal); };
  action.sa_flags = SA_RESTART;
  for (const int signal : {SIGTERM, SIGHUP}) ::sigaction(signal, &action, nullptr);
  for (const int signal : {SIGINT, SIGQUIT}) ::signal(signal, SIG_IGN);
}

using Pids = std::set<pid_t>;

// Waits for the tests and returns their status. Also reaps their orphans, which are children of the
// guard. Adds the pids of all of them to `dead`.
int waitForTests(pid_t tests, Pids& dead) {
  for (int status = 0;;) {
    const auto ended =
        checkCall(retryInterrupted([&] { return ::waitpid(-1, &status, 0); }), "waitpid");
    dead.insert(ended);
    if (ended == tests) return status;
  }
}

// Kills all children of the guard, and adds them to `dead`; their children become the guard's, and
// are killed next.
void killOrphans(Pids& dead) {
  for (;;) {
    std::ifstream children("/proc/self/task/" + std::to_string(::getpid()) + "/children");
    // A kernel without this list: the children died with their parents (PR_SET_PDEATHSIG).
    if (!children) return;
    for (pid_t child = 0; children >> child;) ::kill(child, SIGKILL);
    const auto ended = ::waitpid(-1, nullptr, 0);
    if (ended > 0) dead.insert(ended);
    if (ended < 0 && errno == ECHILD) return;
  }
}

// Removes all files of the registered backplanes. All processes that used them are dead.
void removeSegments() {
  std::error_code ignored;
  for (std::size_t i = 0;
       i < std::min(registry->count.load(std::memory_order_relaxed), Registry::kNames); ++i) {
    const auto left = segments::list(SegmentName::prefix(registry->names.at(i).data()));
    for (const auto& name : left) std::filesystem::remove(segments::path(name), ignored);
    if (!left.empty())
      std::fprintf(stderr, "guard: removed %zu segments of backplane %s\n", left.size(),
                   registry->names.at(i).data());
  }
}

// Removes the files of dead processes from all backplanes that processes of `dead` used. Programs
// such as `mpf torture` and the demo use backplanes that are not registered.
void removeSegmentsOf(const Pids& dead) {
  for (const auto& backplane : Backplane::names()) {
    const auto names = segments::list(SegmentName::prefix(backplane));
    const bool isTheirs = std::ranges::any_of(names, [&](const auto& name) {
      layout::SegmentHeader header{};
      const FileDescriptor file(
          ::open(segments::path(name).c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
      return ::pread(file.get(), &header, sizeof header, 0) == sizeof header &&
             dead.contains(header.ownerPid);
    });
    const auto removed = isTheirs ? Backplane::named(backplane).removeDead().size() : 0;
    if (removed != 0)
      std::fprintf(stderr, "guard: removed %zu segments of backplane %s\n", removed,
                   backplane.c_str());
  }
}

// Creates a folder for temporary files of the tests. Any user may use it, like /tmp.
std::string makeTemporaryFolder() {
  std::string name = testing::TempDir() + "mpf-tests-" + std::string(6, 'X');
  if (::mkdtemp(name.data()) == nullptr) throwSystemError(errno, "mkdtemp", name);
  checkCall(::chmod(name.c_str(), 01777), "chmod", name);
  ::setenv("TMPDIR", name.c_str(), 1);
  ::setenv("TEST_TMPDIR", name.c_str(), 1);
  return name;
}

// Ends in the same way as the tests, so that ctest reports their signal.
int endAs(int status) {
  if (!WIFSIGNALED(status)) return WEXITSTATUS(status);
  const rlimit none{0, 0};
  ::setrlimit(RLIMIT_CORE, &none);  // the tests have written a core file already
  ::signal(WTERMSIG(status), SIG_DFL);
  ::raise(WTERMSIG(status));
  return 128 + WTERMSIG(status);
}

int runTests(int argc, char** argv) {
  testing::InitGoogleMock(&argc, argv);
  return RUN_ALL_TESTS();
}

// In the process that the guard has started.
int runAsChild(int argc, char** argv, const char* descriptor) {
  const FileDescriptor file(std::stoi(descriptor));
  ::unsetenv(kRegistryVariable);
  registry = static_cast<Registry*>(mapRegistry(file.get()));
  return runTests(argc, argv);
}

int runGuarded(int argc, char** argv) {
  const auto file = makeRegistry();
  const auto folder = makeTemporaryFolder();
  ::prctl(PR_SET_CHILD_SUBREAPER, 1);
  const auto guard = ::getpid();
  const auto tests = checkCall(::fork(), "fork");
  if (tests == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != guard) return 1;  // the guard was killed before prctl()
    // EPICS, for one, must not run in a process that was only forked.
    ::execv("/proc/self/exe", argv);
    if (errno != ENOEXEC) throwSystemError(errno, "run", "/proc/self/exe");
    // The tests run in an emulator, which cannot execute programs of its processor.
    ::unsetenv(kRegistryVariable);
    return runTests(argc, argv);
  }
  testProcess = tests;
  forwardSignals();
  Pids dead;
  const auto status = waitForTests(tests, dead);
  killOrphans(dead);
  if (status != 0) {
    removeSegments();
    removeSegmentsOf(dead);
  }
  std::error_code ignored;
  std::filesystem::remove_all(folder, ignored);
  return endAs(status);
}

}  // namespace

void guardBackplane(const std::string& name) {
  if (registry == nullptr || name.size() >= Registry::kChars) return;
  const auto index = registry->count.fetch_add(1, std::memory_order_relaxed);
  if (index < Registry::kNames) name.copy(registry->names.at(index).data(), Registry::kChars - 1);
}

}  // namespace mpf::test

int main(int argc, char** argv) try {
  if (const char* descriptor = ::getenv(mpf::test::kRegistryVariable))
    return mpf::test::runAsChild(argc, argv, descriptor);
  if (!mpf::test::isGuardNeeded(argc, argv)) return mpf::test::runTests(argc, argv);
  return mpf::test::runGuarded(argc, argv);
} catch (const std::exception& error) {
  std::fprintf(stderr, "guard: %s\n", error.what());
  return 1;
}
