// SPDX-License-Identifier: MIT
// The environment of MPF: little shared memory, other namespaces, clocks that differ, limits that
// are reached, names that another program removes. Each test runs in its own child; tests that this
// host does not allow are skipped.
#include <fcntl.h>
#include <sched.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/mount.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <thread>
#include <vector>

#include <mpf/message_server.h>
#include <mpf/sync_client.h>

#include "base/system_call.h"
#include "shm/segment_name.h"
#include "shm/window.h"
#include "tests/support/test_backplane.h"
#include "tests/support/victim.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

constexpr int kNotAllowed = 77;

// During its lifetime, started programs have a wall clock that can be set back
// (tests/support/wall_clock.cpp).
class WallClock {
 public:
  explicit WallClock(std::string file) : file_(std::move(file)) {
    setBack(0);
    ::setenv("LD_PRELOAD", MPF_TEST_WALL_CLOCK, 1);
    ::setenv("MPF_TEST_WALL_CLOCK", file_.c_str(), 1);
  }
  ~WallClock() {
    ::unsetenv("LD_PRELOAD");
    ::unlink(file_.c_str());
  }
  WallClock(const WallClock&) = delete;
  WallClock& operator=(const WallClock&) = delete;

  // Sets the clock of all these programs at once.
  void setBack(long seconds) const {
    std::ofstream(file_ + ".new") << seconds << '\n';
    checkCall(::rename((file_ + ".new").c_str(), file_.c_str()), "rename", file_);
  }
  static long asProgramsSeeIt() {
    return std::stol(Victim("/bin/date", std::vector<std::string>{"+%s"}).line());
  }

 private:
  std::string file_;
};

class WorldTest : public testing::Test {
 protected:
  void SetUp() override {
#ifdef __SANITIZE_THREAD__
    GTEST_SKIP() << "ThreadSanitizer allows no threads in the child of a process that has some";
#endif
  }
  // Runs `act` in a child that may change its world.
  static void inChild(const std::function<void()>& act) {
    std::fflush(stdout);
    const auto pid = checkCall(::fork(), "fork");
    if (pid == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      try {
        act();
      } catch (const std::exception& error) {
        std::fprintf(stderr, "child: %s\n", error.what());
        ::_exit(1);
      }
      std::fflush(stdout);
      ::_exit(testing::Test::HasFailure() ? 1 : 0);
    }
    int status = 0;
    ::waitpid(pid, &status, 0);
    ASSERT_TRUE(WIFEXITED(status)) << "killed by signal " << WTERMSIG(status);
    if (WEXITSTATUS(status) == kNotAllowed) GTEST_SKIP() << "this host does not allow it";
    EXPECT_EQ(WEXITSTATUS(status), 0);
  }
  // Called in the child: needs root, or a host that allows user namespaces.
  static void enter(int namespaces) {
    if (::geteuid() != 0) namespaces |= CLONE_NEWUSER;
    if (::unshare(namespaces) != 0) ::_exit(kNotAllowed);
  }
  static void allow(bool success) {
    if (!success) ::_exit(kNotAllowed);
  }
  // 0 when it does not exist.
  static int errorOf(const std::exception_ptr& why) try {
    if (why) std::rethrow_exception(why);
    return 0;
  } catch (const std::system_error& error) {
    return error.code().value();
  }
  static void expectAnswer(SyncClient& client, double value = 1) {
    auto answer = client.call(Float64Message({.value = value}), 60s);
    ASSERT_TRUE(answer) << answer.why();
    EXPECT_EQ(answer.message().tryAs<Float64>()->value, value + 1);
  }

  Watchdog watchdog_{testing::UnitTest::GetInstance()->current_test_info()->name()};
  TestBackplane backplane_;
};

TEST_F(WorldTest, FullSharedMemoryIsAClearErrorAndLinksStillWork) {
  inChild([] {
    enter(CLONE_NEWNS);
    ::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr);
    allow(::mount("tmpfs", "/dev/shm", "tmpfs", 0, "size=256k") == 0);
    const auto backplane = Backplane::named("small");
    Victim server("serve", backplane.name());
    EXPECT_EQ(server.line(), "open");
    SyncClient client(backplane, "echo");
    expectAnswer(client);

    // Large messages need more memory than is free: the sender gets an error, and the link stays.
    auto array = client.client().alloc<Float64Array>(100'000);
    EXPECT_EQ(client.call(std::move(array), 60s).refusal(), SendResult::noMemory);
    expectAnswer(client);

    // No byte is left: a new server reports what it could not allocate, and the others continue.
    const FileDescriptor rest(::open("/dev/shm/rest", O_RDWR | O_CREAT | O_CLOEXEC, 0600));
    while (::posix_fallocate(rest.get(), ::lseek(rest.get(), 0, SEEK_END), 4096) == 0) {
    }
    try {
      const MessageServer another(backplane, "another");
      ADD_FAILURE() << "the server could start";
    } catch (const std::system_error& error) {
      EXPECT_THAT(error.what(), testing::AllOf(testing::HasSubstr("bytes in /dev/shm"),
                                               testing::HasSubstr("No space left")));
    }
    expectAnswer(client);
    checkCall(::ftruncate(rest.get(), 0), "ftruncate");
    const MessageServer another(backplane, "another");
  });
}

TEST_F(WorldTest, TwoPidNamespacesShareABackplane) {
  Victim server("serve", backplane_.name());
  EXPECT_EQ(server.line(), "open");
  inChild([&] {
    enter(CLONE_NEWPID);
    Victim stranger("crowd", backplane_.name(), {"3"});
    EXPECT_THAT(stranger.line(), testing::StartsWith("waiting: "));
    EXPECT_THAT(stranger.line(), testing::StartsWith("answered "));
    stranger.end(SIGKILL);
  });

  // The server also notices the death of the process in the other namespace, and closes its links.
  const auto window = PeerWindow::tryOpen(SegmentName::serverWindow(backplane_.name(), 0, "echo"),
                                          layout::SegmentKind::serverWindow);
  while (window->control().linkCount.load(std::memory_order_relaxed) != 0)
    std::this_thread::sleep_for(1ms);
  SyncClient client(backplane_, "echo");
  expectAnswer(client);
}

TEST_F(WorldTest, TheDeathOfAServerIsNoticedFromAnotherPidNamespace) {
  inChild([&] {
    // Before the change of the namespace, after which no thread can start.
    SyncClient client(backplane_, "echo");
    static_cast<void>(client.connectWait(1ms));
    enter(CLONE_NEWPID);
    Victim server("serve", backplane_.name());  // pid 1 there
    EXPECT_EQ(server.line(), "open");
    expectAnswer(client);

    server.end(SIGKILL);

    while (client.client().isConnected()) static_cast<void>(client.receive(1ms));
    EXPECT_FALSE(client.client().isConnected());
  });
}

// A monotonic clock that is an hour ahead, as in a container that was moved: nothing hangs, and no
// living process is taken for dead.
TEST_F(WorldTest, AClientWhoseClockIsAheadIsServed) {
  Victim server("serve", backplane_.name());
  EXPECT_EQ(server.line(), "open");
  inChild([&] {
    enter(CLONE_NEWTIME);
    std::ofstream offsets("/proc/self/timens_offsets");
    offsets << "monotonic 3600 0\nboottime 3600 0\n" << std::flush;
    allow(offsets.good());
    Victim stranger("crowd", backplane_.name(), {"2"});  // the first process of the new clock
    EXPECT_THAT(stranger.line(), testing::StartsWith("waiting: "));
    EXPECT_THAT(stranger.line(), testing::StartsWith("answered "));
    stranger.end(SIGKILL);
  });
  SyncClient client(backplane_, "echo");
  expectAnswer(client);
}

// The wall clock of the programs is set back by a day while they exchange messages.
TEST_F(WorldTest, AWallClockThatIsSetBackChangesNothing) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "AddressSanitizer must be the first library of a program";
#endif
  const WallClock clock(testing::TempDir() + backplane_.name());
  Victim server("serve", backplane_.name());
  EXPECT_EQ(server.line(), "open");
  Victim crowd("crowd", backplane_.name(), {"5"});
  const auto answered = [&] {
    auto line = crowd.line();
    while (line.starts_with("waiting: ")) line = crowd.line();
    return line;
  };
  const auto first = answered();
  EXPECT_THAT(first, testing::StartsWith("answered "));
  const auto before = WallClock::asProgramsSeeIt();

  clock.setBack(86'400);
  EXPECT_LT(WallClock::asProgramsSeeIt(), before);
  server.end(SIGKILL);
  server = Victim("serve", backplane_.name());
  ASSERT_EQ(server.line(), "open");

  EXPECT_THAT(answered(), testing::AllOf(testing::StartsWith("answered "), testing::Ne(first)));
  SyncClient client(backplane_, "echo");
  expectAnswer(client);
}

// As when the host sleeps, except that the clocks continue: all processes are stopped at a random
// moment, and none is taken for dead.
TEST_F(WorldTest, ProcessesThatWereAllStoppedContinue) {
  Victim crowd("crowd", backplane_.name(), {"20"});
  EXPECT_THAT(crowd.line(), testing::StartsWith("waiting: "));
  Victim server("serve", backplane_.name());
  for (const auto* const process : {&server, &crowd}) process->stop();

  for (const auto* const process : {&crowd, &server}) process->signal(SIGCONT);

  EXPECT_EQ(server.line(), "open");
  EXPECT_THAT(crowd.line(), testing::StartsWith("answered "));
  SyncClient client(backplane_, "echo");
  expectAnswer(client);
}

TEST_F(WorldTest, AProcessWithoutDescriptorsGetsAnErrorAndRecovers) {
  Victim server("serve", backplane_.name());
  EXPECT_EQ(server.line(), "open");
  inChild([&] {
    SyncClient before(backplane_, "echo");
    expectAnswer(before);
    rlimit limit{};
    ::getrlimit(RLIMIT_NOFILE, &limit);
    limit.rlim_cur = 64;
    ::setrlimit(RLIMIT_NOFILE, &limit);
    std::vector<FileDescriptor> all;
    do all.emplace_back(::open("/dev/null", O_RDONLY | O_CLOEXEC));
    while (all.back());

    // Checked later, because UndefinedBehaviorSanitizer needs descriptors.
    std::exception_ptr why;
    try {
      const MessageServer another(backplane_, "another");
    } catch (...) {
      why = std::current_exception();
    }
    expectAnswer(before);

    all.clear();
    EXPECT_EQ(errorOf(why), EMFILE);
    const MessageServer another(backplane_, "another");
    SyncClient after(backplane_, "echo");
    expectAnswer(after);
  });
}

TEST_F(WorldTest, AProcessWithoutMappingsGetsAnErrorAndRecovers) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "AddressSanitizer needs mappings itself";
#endif
  Victim server("serve", backplane_.name());
  EXPECT_EQ(server.line(), "open");
  inChild([&] {
    SyncClient before(backplane_, "echo");
    expectAnswer(before);
    std::vector<void*> all;
    all.reserve(100'000);
    for (;;) {  // the kernel does not merge mappings of alternating kinds
      auto* const page = ::mmap(nullptr, 4096, all.size() % 2 == 0 ? PROT_READ : PROT_NONE,
                                MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
      if (page == MAP_FAILED) break;
      all.push_back(page);
      allow(all.size() < 99'000);  // the limit of this host is too high for a test
    }

    try {
      const MessageServer another(backplane_, "another");
      ADD_FAILURE() << "mappings were left";
    } catch (const std::system_error& error) {
      EXPECT_EQ(error.code().value(), ENOMEM) << error.what();
    }
    expectAnswer(before);

    for (auto* const page : all) ::munmap(page, 4096);
    const MessageServer another(backplane_, "another");
  });
}

// As RemoveIPC does at a user's logout: the names are removed, the processes continue. Existing
// links work, a successor can use the name, and a process without its names reports it.
TEST_F(WorldTest, ASuccessorServesNewClientsAfterTheNamesWereRemoved) {
  Victim server("serve", backplane_.name());
  EXPECT_EQ(server.line(), "open");
  SyncClient client(backplane_, "echo");
  expectAnswer(client);

  for (const auto& name : backplane_.segmentNames()) segments::remove(name);

  for (int i = 0; i < 10; ++i) expectAnswer(client, i);
  Victim successor("serve", backplane_.name());
  EXPECT_EQ(successor.line(), "open");
  SyncClient later(backplane_, "echo");
  expectAnswer(later);
  server.end(SIGKILL);
  while (client.client().notConnectedBecause().find("RemoveIPC") == std::string::npos)
    static_cast<void>(client.receive(1ms));
  expectAnswer(later);
}

}  // namespace
}  // namespace mpf::test
