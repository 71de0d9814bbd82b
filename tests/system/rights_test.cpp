// SPDX-License-Identifier: MIT
// Which users may be clients: only the owner, or a group, as the server's options say. Root runs
// processes as several users; other users check the rights of the files only.
#include <sys/stat.h>
#include <unistd.h>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>
#include <thread>

#include <mpf/message_server.h>
#include <mpf/sync_client.h>

#include "base/system_call.h"
#include "shm/segment.h"
#include "shm/segment_name.h"
#include "tests/support/test_backplane.h"
#include "tests/support/victim.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

constexpr std::uint32_t kNobody = 65534;
constexpr std::uint32_t kOperators = 54321;

class RightsTest : public testing::Test {
 protected:
  // An echo server with its own thread.
  class Server {
   public:
    Server(const Backplane& backplane, Rights rights)
        : server_(backplane, "echo", {.location = 0, .rights = rights}) {
      server_.on<Float64>([](Float64& request) { request.value += 1; });
      server_.on<Float64Array>([](Float64ArrayMessage&) {});
      thread_ = std::thread([this] { server_.run(); });
    }
    ~Server() {
      server_.interrupt();
      thread_.join();
    }
    Server(const Server&) = delete;
    Server& operator=(const Server&) = delete;

   private:
    MessageServer server_;
    std::thread thread_;
  };
  // A client of another user in another process. Its first line says why it is not connected, if it
  // is not.
  Victim startClientAs(std::uint32_t user, std::uint32_t group) const {
    return {"crowd", backplane_.name(), {"1", "as", std::to_string(user), std::to_string(group)}};
  }
  // The reason that a client gets when it may not open the server's window.
  std::string refusal(const std::string& mode, std::uint32_t group) const {
    return fmt::format("open {} (mode {}, user {}, group {}): Permission denied",
                       segments::path(SegmentName::serverWindow(backplane_.name(), 0, "echo")),
                       mode, ::geteuid(), group);
  }
  // Rights and group of each segment with `mark` in its name, as "0600 0".
  std::vector<std::string> rightsOf(const std::string& mark) const {
    std::vector<std::string> found;
    for (const auto& name : backplane_.segmentNames()) {
      if (name.find(mark) == std::string::npos) continue;
      struct stat status{};
      checkCall(::stat(segments::path(name).c_str(), &status), "stat", name);
      found.push_back(fmt::format("{:04o} {}", status.st_mode & 07777u, status.st_gid));
    }
    return found;
  }

  Watchdog watchdog_{"rights test"};
  TestBackplane backplane_;
};

// Creates a link with pools in both directions.
void useLargeMessages(SyncClient& client) {
  ASSERT_TRUE(client.connectWait(60s));
  auto answer = client.call(client.client().alloc<Float64Array>(5000), 60s);
  ASSERT_TRUE(answer) << answer.why();
}

TEST_F(RightsTest, OnlyTheOwnerMayUseAServerByDefault) {
  const Server server(backplane_, {});
  const auto own = fmt::format("{}", ::getegid());

  EXPECT_THAT(rightsOf(".s."), testing::ElementsAre("0600 " + own));
  EXPECT_THAT(rightsOf(".h."), testing::ElementsAre("0600 " + own));
  EXPECT_THAT(rightsOf(".f."), testing::ElementsAre("0600 " + own));

  SyncClient client(backplane_, "echo", 0);
  useLargeMessages(client);
  EXPECT_THAT(rightsOf(".l."), testing::ElementsAre("0600 " + own));
  EXPECT_THAT(rightsOf(".b."), testing::Each("0600 " + own));
}

TEST_F(RightsTest, AServersGroupMayReadItsWindowAndWriteItsHintsAndLinks) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root may change the group of files";
  const Server server(backplane_, {.mode = 0660, .group = kOperators});
  const auto group = fmt::format("{}", kOperators);

  EXPECT_THAT(rightsOf(".s."), testing::ElementsAre("0640 " + group));
  EXPECT_THAT(rightsOf(".h."), testing::ElementsAre("0660 " + group));
  EXPECT_THAT(rightsOf(".f."), testing::ElementsAre("0660 " + group));

  SyncClient client(backplane_, "echo", 0);
  useLargeMessages(client);
  EXPECT_THAT(rightsOf(".l."), testing::ElementsAre("0660 " + group));
  EXPECT_THAT(rightsOf(".b."), testing::Each("0660 " + group));
}

TEST_F(RightsTest, AnotherUserIsToldWhichRightItLacks) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can run as another user";
  const Server server(backplane_, {});

  auto stranger = startClientAs(kNobody, kNobody);

  EXPECT_THAT(stranger.line(),
              testing::StartsWith("waiting: " + refusal("0600", ::getegid()) +
                                  "; start the server with --mode 0660 --group GROUP"));
  SyncClient client(backplane_, "echo", 0);
  EXPECT_TRUE(client.call(Float64Message(), 60s)) << "the owner is still served";
}

TEST_F(RightsTest, AnotherUserOfTheGroupIsServed) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can run as another user";
  const Server server(backplane_, {.mode = 0660, .group = kOperators});

  auto member = startClientAs(kNobody, kOperators);
  auto stranger = startClientAs(kNobody, kNobody);

  EXPECT_THAT(stranger.line(), testing::StartsWith("waiting: " + refusal("0640", kOperators)));
  EXPECT_THAT(member.line(), testing::StartsWith("waiting: "));
  EXPECT_THAT(member.line(), testing::StartsWith("answered "));
  EXPECT_THAT(rightsOf(".l."), testing::ElementsAre(fmt::format("0660 {}", kOperators)));
}

TEST_F(RightsTest, EveryUserIsServedIfTheServerAllowsIt) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can run as another user";
  const Server server(backplane_, {.mode = 0666});

  auto stranger = startClientAs(kNobody, kNobody);

  EXPECT_THAT(stranger.line(), testing::StartsWith("waiting: "));
  EXPECT_THAT(stranger.line(), testing::StartsWith("answered "));
}

TEST_F(RightsTest, RootIsServedByEveryServer) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can run as another user";
  Victim server("serve", backplane_.name(),
                {"as", std::to_string(kNobody), std::to_string(kNobody)});
  EXPECT_EQ(server.line(), "open");

  SyncClient client(backplane_, "echo", 0);

  useLargeMessages(client);
  EXPECT_EQ(server.end(SIGTERM), 0);
}

TEST_F(RightsTest, AnotherUserIsServedOnceTheServerAllowsIt) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can run as another user";
  auto server = std::make_unique<Server>(backplane_, Rights{});
  auto stranger = startClientAs(kNobody, kOperators);
  EXPECT_THAT(stranger.line(), testing::HasSubstr("Permission denied"));

  server.reset();
  server = std::make_unique<Server>(backplane_, Rights{.mode = 0660, .group = kOperators});

  EXPECT_THAT(stranger.line(), testing::StartsWith("answered "));
}

}  // namespace
}  // namespace mpf::test
