// SPDX-License-Identifier: MIT
#include "drivers/serial/tcp_line.h"

#include <netinet/tcp.h>

#include <gmock/gmock.h>

#include "tests/drivers/serial/line_collector.h"
#include "tests/drivers/serial/terminal_server.h"

namespace mpf::test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

using OpenState = SerialLine::OpenState;

// The thread of the test is the port's thread.
class TcpLineTest : public testing::Test {
 protected:
  // Waits for `events` of the line, or for an error.
  void waitFor(int events) const {
    pollfd ready{line_.waitsFor().fd, static_cast<short>(events), 0};
    ASSERT_EQ(::poll(&ready, 1, -1), 1);
  }
  OpenState open() {
    auto state = line_.tryOpen();
    while (state == OpenState::opening) {
      auto ready = line_.waitsFor();
      EXPECT_EQ(::poll(&ready, 1, -1), 1);
      state = line_.tryOpen();
    }
    return state;
  }
  [[nodiscard]] int option(int level, int name) const {
    int value = 0;
    socklen_t length = sizeof value;
    checkCall(::getsockopt(line_.waitsFor().fd, level, name, &value, &length), "getsockopt");
    return value;
  }

  Watchdog watchdog_{"TCP line test"};
  TerminalServer server_;
  TcpLine line_{server_.address(), 100ms};
};

TEST_F(TcpLineTest, OpensInStepsThatDoNotBlock) {
  EXPECT_EQ(line_.description(), server_.address().toString());
  EXPECT_EQ(line_.openTimeout(), 100ms);
  EXPECT_EQ(line_.waitsFor().fd, -1);

  EXPECT_EQ(line_.tryOpen(), OpenState::opening);  // looks up the name
  EXPECT_EQ(line_.waitsFor().events, POLLIN);
  EXPECT_EQ(open(), OpenState::open);

  EXPECT_EQ(line_.waitsFor().events, POLLIN);
  const auto far = server_.accept();
}

TEST_F(TcpLineTest, FailsToOpenWithTheCallTheAddressAndTheReason) {
  server_.switchOff();
  EXPECT_EQ(open(), OpenState::failed);
  EXPECT_EQ(line_.problem(), "connect to " + server_.address().toString() + ": Connection refused");
  line_.close();

  server_.switchOn();

  EXPECT_EQ(open(), OpenState::open) << "each attempt looks up the name";
  const auto far = server_.accept();
}

TEST_F(TcpLineTest, EndsAnAttemptWhenItIsClosed) {
  ASSERT_EQ(line_.tryOpen(), OpenState::opening);

  line_.close();

  EXPECT_EQ(line_.waitsFor().fd, -1);
  EXPECT_EQ(open(), OpenState::open);
}

TEST_F(TcpLineTest, DetectsAPeerThatVanishesWithinHalfAMinute) {
  ASSERT_EQ(open(), OpenState::open);
  constexpr int kSeconds = 30;

  EXPECT_EQ(option(SOL_SOCKET, SO_KEEPALIVE), 1);
  EXPECT_LE(option(IPPROTO_TCP, TCP_KEEPIDLE) +
                option(IPPROTO_TCP, TCP_KEEPINTVL) * option(IPPROTO_TCP, TCP_KEEPCNT),
            kSeconds);
  EXPECT_LE(option(IPPROTO_TCP, TCP_USER_TIMEOUT), kSeconds * 1000);
  EXPECT_GT(option(IPPROTO_TCP, TCP_USER_TIMEOUT), 0);
  EXPECT_NE(option(IPPROTO_TCP, TCP_NODELAY), 0) << "short commands are sent at once";
}

TEST_F(TcpLineTest, ReadsWhatHasArrivedAndDoesNotWaitForMore) {
  ASSERT_EQ(open(), OpenState::open);
  const auto far = server_.accept();
  std::vector<LineByte> bytes;
  EXPECT_TRUE(line_.tryRead(bytes));
  EXPECT_THAT(bytes, IsEmpty());

  checkCall(::send(far.get(), "\0\xff", 2, 0), "send");
  waitFor(POLLIN);

  EXPECT_TRUE(line_.tryRead(bytes));
  EXPECT_THAT(bytes, ElementsAre(LineByte{0}, LineByte{0xff}));
}

TEST_F(TcpLineTest, IsLostWhenTheFarEndClosesTheConnection) {
  ASSERT_EQ(open(), OpenState::open);
  server_.accept().reset();
  waitFor(POLLIN);
  std::vector<LineByte> bytes;

  EXPECT_FALSE(line_.tryRead(bytes));

  EXPECT_EQ(line_.problem(),
            "read from " + server_.address().toString() + ": the far end closed the connection");
}

TEST_F(TcpLineTest, AcceptsNoBytesWhileTheBuffersAreFull) {
  ASSERT_EQ(open(), OpenState::open);
  auto far = server_.accept();
  const std::vector<std::uint8_t> much(1'000'000, 'x');
  std::optional<std::size_t> accepted;
  do {
    accepted = line_.tryWrite(much);
    ASSERT_TRUE(accepted.has_value()) << line_.problem();
  } while (accepted > 0U);

  far.reset();  // with unread bytes: resets the connection
  waitFor(0);

  EXPECT_EQ(line_.tryWrite(much), std::nullopt);
  EXPECT_THAT(line_.problem(), testing::StartsWith("write to " + server_.address().toString()));
}

}  // namespace
}  // namespace mpf::test
