// SPDX-License-Identifier: MIT
// Sabotage: each mistake breaks what the checks look for. The half message is tested by the whole
// program.
#include "tools/torture/sabotage.h"

#include <signal.h>

#include <algorithm>
#include <filesystem>
#include <optional>

#include "shm/segment.h"
#include "tests/tools/torture/talk_fixture.h"
#include "tools/torture/checks.h"
#include "tools/torture/processes.h"

namespace mpf::torture {
namespace {

using testing::IsEmpty;
using testing::SizeIs;

constexpr std::size_t kLinks = 1;  // of the talk

class SabotageTest : public TalkTest {
 protected:
  void SetUp() override {
    runUntil([&] { EXPECT_FALSE(server_->receive()); }, [&] { return talk_.isConnected(); });
  }
  // The leak opens this file. Other descriptors come and go: those of the dispatcher's threads.
  [[nodiscard]] static std::ptrdiff_t leaks() {
    return std::ranges::count_if(
        std::filesystem::directory_iterator("/proc/self/fd"), [](const auto& descriptor) {
          std::error_code isClosed;
          return std::filesystem::read_symlink(descriptor, isClosed) == "/dev/null";
        });
  }
  [[nodiscard]] std::vector<std::string> stale() const {
    return staleSegments(backplane_.name(), kLinks);
  }

  std::optional<MessageServer> server_{std::in_place, backplane_, "server"};
};

TEST_F(SabotageTest, NoneChangesNothing) {
  Saboteur saboteur(Sabotage::none, backplane_.name());
  const auto before = leaks();

  for (const bool rests : {false, true, false}) saboteur.sabotage(talk_, rests);

  EXPECT_EQ(leaks(), before);
  EXPECT_THAT(stale(), IsEmpty());
}

TEST_F(SabotageTest, ALeakIsOneDescriptorInEachRest) {
  Saboteur saboteur(Sabotage::leak, backplane_.name());
  const auto before = leaks();

  for (const bool rests : {false, true, true, false, true}) saboteur.sabotage(talk_, rests);

  EXPECT_EQ(leaks(), before + 2);
}

TEST_F(SabotageTest, AStaleLinkIsLeftAtTheBeginningOfARest) {
  Saboteur saboteur(Sabotage::stale, backplane_.name());
  saboteur.sabotage(talk_, false);
  EXPECT_THAT(stale(), IsEmpty());

  saboteur.sabotage(talk_, true);

  const auto left = stale();
  EXPECT_THAT(left, SizeIs(testing::Ge(1U)));
  for (const auto& name : left) segments::remove(name);
}

TEST_F(SabotageTest, ALostFateLeavesARequestWithoutEnd) {
  Saboteur saboteur(Sabotage::loseFate, backplane_.name());
  talk_.sendSome();
  saboteur.sabotage(talk_, false);

  server_.reset();
  runUntil([] {}, [&] { return talked_.disconnects.load() != 0; });

  EXPECT_EQ(talk_.open(), 1U);
}

TEST(SabotageOfNames, AChildKeepsTheNameOfADeadServerUntilTheEnd) {
  const test::Watchdog watchdog("sabotage of names");
  const test::TestBackplane backplane;
  const SharedWorld world;
  Processes processes;
  const auto server = processes.start([&] {
    const MessageServer mortal(Backplane::named(backplane.name()), "mortal");
    leaveChildBehind(*world, backplane.name());
    return ::raise(SIGKILL);
  });
  while (!processes.hasEnded(server)) processes.handleEvents(std::chrono::hours(1));

  EXPECT_ANY_THROW(MessageServer(backplane, "mortal"));

  (*world).isOver.store(1);
  for (bool isFree = false; !isFree;) {
    try {
      const MessageServer successor(backplane, "mortal");
      isFree = true;
    } catch (const std::exception&) {  // NOLINT(bugprone-empty-catch): the child still exists
    }
  }
}

}  // namespace
}  // namespace mpf::torture
