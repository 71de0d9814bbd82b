// SPDX-License-Identifier: MIT
// ControlServer: callers that are slow, send invalid requests, or come when no descriptor is left.
#include "crate/supervisor/control_server.h"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <array>
#include <chrono>
#include <future>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>

#include "tests/support/no_descriptors.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/watchdog.h"

namespace mpf::crate::test {
namespace {

using testing::HasSubstr;

class ControlServerTest : public testing::Test {
 protected:
  ControlServerTest() {
    folder_.create();
    server_.listen(folder_);
  }
  FileDescriptor call() {
    FileDescriptor caller(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
    sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
    folder_.file("control").copy(address.sun_path, sizeof address.sun_path - 1);
    EXPECT_EQ(::connect(caller.get(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    return caller;
  }
  static void send(const FileDescriptor& caller, std::string_view text) {
    EXPECT_EQ(::send(caller.get(), text.data(), text.size(), 0), static_cast<ssize_t>(text.size()));
  }
  // As the supervisor does. Returns whether there was anything to do.
  bool step() {
    std::vector<pollfd> polled;
    server_.addTo(polled);
    if (::poll(polled.data(), polled.size(), 0) <= 0) return false;
    server_.handle(polled);
    return true;
  }
  // What the server sends until it closes the connection.
  static std::string replyTo(const FileDescriptor& caller) {
    std::string text;
    std::array<char, 1000> bytes{};
    for (ssize_t length = 0; (length = ::read(caller.get(), bytes.data(), bytes.size())) > 0;)
      text.append(bytes.data(), static_cast<std::size_t>(length));
    return text;
  }

  const mpf::test::Watchdog watchdog_{"ControlServer"};
  mpf::test::TemporaryFolder parent_;
  CrateFolder folder_{parent_.path() / "lab"};
  static constexpr std::size_t kLong = 3'000'000;
  ControlServer server_{[](const nlohmann::json& request) -> nlohmann::json {
    if (request.at("do") == "long") return {{"done", std::string(kLong, 'x')}};
    return {{"done", request.at("do")}};
  }};
};

TEST_F(ControlServerTest, RepliesToARequestInPieces) {
  const auto caller = call();
  step();
  send(caller, "{\"do\": ");
  step();
  send(caller, "\"ps\"}\n");
  while (step()) {
  }

  EXPECT_EQ(replyTo(caller), "{\"done\":\"ps\"}\n");
}

TEST_F(ControlServerTest, RepliesAnErrorToARequestThatItCannotRead) {
  const auto caller = call();
  send(caller, "ps\n");
  while (step()) {
  }

  EXPECT_THAT(replyTo(caller), HasSubstr("{\"error\":\""));
}

// A reply to a caller that does not read it at once is longer than the buffer of its socket.
TEST_F(ControlServerTest, ALongReplyArrivesWhole) {
  const auto slow = call();
  send(slow, "{\"do\": \"long\"}\n");
  while (step()) {
  }
  const auto other = call();
  send(other, "{\"do\": 1}\n");
  while (step()) {
  }
  EXPECT_EQ(replyTo(other), "{\"done\":1}\n");

  auto reply = std::async(std::launch::async, [&] { return replyTo(slow); });
  while (reply.wait_for(std::chrono::seconds(0)) != std::future_status::ready) step();
  EXPECT_EQ(reply.get().size(), kLong + std::string_view("{\"done\":\"\"}\n").size());
}

TEST_F(ControlServerTest, ACallerGetsAnErrorWhenNoDescriptorIsLeft) {
  const auto patient = call();
  step();
  const auto refused = call();
  {
    const mpf::test::NoDescriptors now;
    step();
    ASSERT_FALSE(step()) << "a caller that cannot be accepted keeps the supervisor busy";
  }
  EXPECT_THAT(replyTo(refused), HasSubstr("no file descriptor left"));

  const auto next = call();
  send(patient, "{\"do\": 1}\n");
  send(next, "{\"do\": 2}\n");
  while (step()) {
  }
  EXPECT_EQ(replyTo(patient), "{\"done\":1}\n");
  EXPECT_EQ(replyTo(next), "{\"done\":2}\n");
}

}  // namespace
}  // namespace mpf::crate::test
