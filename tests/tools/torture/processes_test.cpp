// SPDX-License-Identifier: MIT
// Processes: forked actors of this process, which has no other thread.
#include "tools/torture/processes.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <gtest/gtest.h>
#include <stdexcept>

#include "base/system_call.h"

namespace mpf::torture {
namespace {

constexpr auto kLong = std::chrono::hours(1);

void awaitEnd(Processes& processes, pid_t pid) {
  while (!processes.hasEnded(pid)) processes.handleEvents(kLong);
}

int pauseForever() {
  for (;;) ::pause();
}

TEST(Processes, AnActorEndsWithTheStatusThatItReturns) {
  Processes processes;
  const auto three = processes.start([] { return 3; });
  const auto four = processes.start([] { return 4; });

  awaitEnd(processes, three);
  awaitEnd(processes, four);

  const auto status = processes.takeStatus(four);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 4);
  EXPECT_EQ(WEXITSTATUS(processes.takeStatus(three)), 3);
  EXPECT_EQ(processes.takeStatus(three), 0) << "a status is discarded when it was taken";
}

TEST(Processes, AnActorThatThrowsFails) {
  Processes processes;

  const auto actor = processes.start([]() -> int { throw std::runtime_error("on purpose"); });

  awaitEnd(processes, actor);
  EXPECT_EQ(WEXITSTATUS(processes.takeStatus(actor)), 1);
}

TEST(Processes, AHeldActorWaitsForTheGate) {
  std::array<int, 2> ends{};
  checkCall(::pipe2(ends.data(), O_CLOEXEC), "pipe2");
  const FileDescriptor reader(ends[0]);
  const FileDescriptor writer(ends[1]);
  Processes processes;
  const auto held = processes.startHeld([&] { return ::write(writer.get(), "h", 1) == 1 ? 0 : 1; });
  const auto free = processes.start([&] { return ::write(writer.get(), "f", 1) == 1 ? 0 : 1; });
  awaitEnd(processes, free);
  EXPECT_FALSE(processes.hasEnded(held));

  processes.openGate();
  awaitEnd(processes, held);

  std::array<char, 2> order{};
  EXPECT_EQ(::read(reader.get(), order.data(), order.size()), 2);
  EXPECT_EQ(std::string(order.data(), order.size()), "fh");
}

TEST(Processes, KillsAnActorAndDiscardsItsStatus) {
  Processes processes;
  const auto actor = processes.start(pauseForever);

  processes.kill(actor);

  EXPECT_TRUE(processes.hasEnded(actor));
  EXPECT_EQ(processes.takeStatus(actor), 0);
  EXPECT_EQ(::waitpid(actor, nullptr, 0), -1) << "its end has been received";
  processes.kill(actor);  // an actor that has ended
}

TEST(Processes, ItsDestructorKillsAllActors) {
  pid_t actor = 0;
  {
    Processes processes;
    actor = processes.start(pauseForever);
  }

  EXPECT_EQ(::kill(actor, 0), -1);
}

// The referee handles Ctrl-C: an actor must not end before it.
TEST(Processes, AnActorIgnoresTheSignalsThatEndTheProgram) {
  Processes processes;

  const auto actor = processes.start([] {
    ::raise(SIGINT);
    ::raise(SIGTERM);
    return 5;
  });

  awaitEnd(processes, actor);
  const auto status = processes.takeStatus(actor);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 5);
}

// The end of an actor is SIGCHLD, which handleEvents() waits for; the program's signal mask is
// restored afterwards, and actors have that mask, too.
TEST(Processes, RestoreTheSignalMask) {
  const auto isBlocked = [] {
    sigset_t mask;
    ::pthread_sigmask(SIG_SETMASK, nullptr, &mask);
    return ::sigismember(&mask, SIGCHLD) == 1;
  };
  ASSERT_FALSE(isBlocked());
  {
    Processes processes;
    EXPECT_TRUE(isBlocked());

    const auto actor = processes.start([&] { return isBlocked() ? 1 : 0; });

    awaitEnd(processes, actor);
    EXPECT_EQ(WEXITSTATUS(processes.takeStatus(actor)), 0);
  }
  EXPECT_FALSE(isBlocked());
}

}  // namespace
}  // namespace mpf::torture
