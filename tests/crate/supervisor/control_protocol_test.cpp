// SPDX-License-Identifier: MIT
// askSupervisor(): replies, errors, and supervisors that are absent, silent or invalid.
#include "crate/supervisor/control_protocol.h"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <thread>

#include "tests/support/temporary_folder.h"
#include "tests/support/watchdog.h"

namespace mpf::crate::test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::ThrowsMessage;

class ControlProtocolTest : public testing::Test {
 protected:
  // Names of folders may be longer than the path of a socket.
  ControlProtocolTest() : folder_(parent_.path() / std::string(150, 'f') / "lab") {
    folder_.create();
  }
  // Accepts one caller and sends it `reply`.
  std::jthread serve(const FileDescriptor& listening, const std::string& reply) {
    return std::jthread([this, &listening, reply] {
      pollfd poll{listening.get(), POLLIN, 0};
      ::poll(&poll, 1, -1);
      const FileDescriptor caller(::accept4(listening.get(), nullptr, nullptr, SOCK_CLOEXEC));
      std::array<char, 1000> bytes{};
      const auto length = ::read(caller.get(), bytes.data(), bytes.size());
      request_.assign(bytes.data(), static_cast<std::size_t>(length));
      EXPECT_EQ(::write(caller.get(), reply.data(), reply.size()),
                static_cast<ssize_t>(reply.size()));
    });
  }
  const mpf::test::Watchdog watchdog_{"ControlProtocol"};
  mpf::test::TemporaryFolder parent_;
  CrateFolder folder_;
  std::string request_;
};

TEST_F(ControlProtocolTest, AsksAndReturnsTheReply) {
  const auto listening = listenForControl(folder_);
  auto server = serve(listening, "{\"a\": 1}\n");

  const auto reply = askSupervisor(folder_, {{"do", "ps"}});

  server.join();
  EXPECT_EQ(reply.at("a"), 1);
  EXPECT_EQ(request_, "{\"do\":\"ps\"}\n");
}

TEST_F(ControlProtocolTest, SendsANameThatIsNotUtf8) {
  const auto listening = listenForControl(folder_);
  auto server = serve(listening, "{}\n");

  askSupervisor(folder_, {{"do", "stop"}, {"name", "\xff"}});

  server.join();
  EXPECT_THAT(request_, HasSubstr("\"name\":\"\xef\xbf\xbd\""));
}

TEST_F(ControlProtocolTest, ThrowsTheErrorOfTheSupervisor) {
  const auto listening = listenForControl(folder_);
  auto server = serve(listening, "{\"error\": \"no process\"}\n");

  EXPECT_THAT([&] { askSupervisor(folder_, {{"do", "stop"}}); },
              ThrowsMessage<std::runtime_error>("no process"));
}

TEST_F(ControlProtocolTest, SaysThatNoSupervisorRuns) {
  const auto expected = ThrowsMessage<std::runtime_error>(
      "the crate \"lab\" is not running; start it with `mpf run FILE`");
  EXPECT_THAT([&] { askSupervisor(folder_, {{"do", "ps"}}); }, expected);
  listenForControl(folder_).reset();  // the socket of a supervisor that was killed
  EXPECT_THAT([&] { askSupervisor(folder_, {{"do", "ps"}}); }, expected);
  EXPECT_NO_THROW(static_cast<void>(listenForControl(folder_)));
}

TEST_F(ControlProtocolTest, DoesNotWaitForeverForAReply) {
  const auto listening = listenForControl(folder_);

  EXPECT_THAT([&] { askSupervisor(folder_, {{"do", "ps"}}, 10ms); },
              ThrowsMessage<std::runtime_error>(
                  HasSubstr("the supervisor of the crate \"lab\" does not reply")));
}

TEST_F(ControlProtocolTest, ReportsAnInvalidReply) {
  const auto listening = listenForControl(folder_);
  auto server = serve(listening, "{\"a\"");

  EXPECT_THAT([&] { askSupervisor(folder_, {{"do", "ps"}}); },
              ThrowsMessage<std::runtime_error>(HasSubstr("sent no valid reply")));
}

}  // namespace
}  // namespace mpf::crate::test
