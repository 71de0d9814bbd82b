// SPDX-License-Identifier: MIT
// askSupervisor(): replies, errors, and supervisors that are absent, silent or invalid.
#include "crate/supervisor/control_protocol.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <fmt/format.h>
#include <future>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <thread>
#include <vector>

#include "base/system_call.h"
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
  // Callers until the queue of the socket is full; the last one is not connected.
  std::vector<FileDescriptor> fillQueue() {
    const FileDescriptor opened(::open(folder_.path().c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
    const auto path = fmt::format("/proc/self/fd/{}/control", opened.get());
    sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    std::vector<FileDescriptor> callers;
    do {
      callers.emplace_back(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    } while (::connect(callers.back().get(), reinterpret_cast<sockaddr*>(&address),
                       sizeof address) == 0);
    EXPECT_EQ(errno, EAGAIN);
    return callers;
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
                  HasSubstr("the supervisor of the crate \"lab\" does not reply within 10ms")));
}

TEST_F(ControlProtocolTest, WaitsWhileASupervisorHasManyCallers) {
  const auto listening = listenForControl(folder_);
  const auto callers = fillQueue();
  EXPECT_THAT([&] { askSupervisor(folder_, {{"do", "ps"}}, 10ms); },
              ThrowsMessage<std::runtime_error>(HasSubstr("does not reply")));

  auto reply = std::async(std::launch::async, [&] { return askSupervisor(folder_, {}); });
  for (std::size_t i = 1; i < callers.size(); ++i)
    FileDescriptor(::accept4(listening.get(), nullptr, nullptr, SOCK_CLOEXEC)).reset();
  auto server = serve(listening, "{\"a\": 1}\n");

  EXPECT_EQ(reply.get().at("a"), 1);
}

TEST_F(ControlProtocolTest, SaysThatASupervisorWithManyCallersIsStopped) {
  const auto listening = listenForControl(folder_);
  const auto callers = fillQueue();
  const auto supervisor = checkCall(::fork(), "fork");
  if (supervisor == 0) {
    const auto lock = folder_.lock();
    ::raise(SIGSTOP);
    ::_exit(0);
  }
  ::waitpid(supervisor, nullptr, WUNTRACED);

  EXPECT_THAT([&] { askSupervisor(folder_, {{"do", "ps"}}); },
              ThrowsMessage<std::runtime_error>(
                  HasSubstr(fmt::format("process {}, is stopped; `kill -CONT ", supervisor))));

  ::kill(supervisor, SIGKILL);
  ::waitpid(supervisor, nullptr, 0);
}

TEST_F(ControlProtocolTest, ReportsAnInvalidReply) {
  const auto listening = listenForControl(folder_);
  auto server = serve(listening, "{\"a\"");

  EXPECT_THAT([&] { askSupervisor(folder_, {{"do", "ps"}}); },
              ThrowsMessage<std::runtime_error>(HasSubstr("sent no valid reply")));
}

}  // namespace
}  // namespace mpf::crate::test
