// SPDX-License-Identifier: MIT
// mpf_test_echo BACKPLANE SERVER LOCATION: sends back each message unchanged, and prints whether it
// is a message that mpf_test_ask sends.
#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <exception>
#include <string>
#include <utility>
#include <vector>

#include <mpf/message_server.h>

#include "base/system_call.h"
#include "schema/text.h"
#include "tests/byte_order/talk.h"
#include "tests/support/every_message.h"

namespace mpf::test {
namespace {

// A byte for each SIGUSR1. Not sigwait(), which under qemu misses a signal that was sent before.
std::array<int, 2> signals{};
void catchSignals() {
  checkCall(::pipe2(signals.data(), O_CLOEXEC), "pipe2");
  struct sigaction action{};
  action.sa_handler = [](int) { [[maybe_unused]] const auto written = ::write(signals[1], "", 1); };
  checkCall(::sigaction(SIGUSR1, &action, nullptr), "sigaction");
}

class Echo {
 public:
  Echo(const std::string& backplane, const std::string& name, std::int32_t location)
      : server_(Backplane::attach(backplane), name,
                {.location = location, .queueSize = kQueueSize}) {}

  void run() {
    while (server_.waitForMessage()) {
      while (auto request = server_.receive()) handle(std::move(request));
    }
  }

 private:
  void handle(Message request) {
    if (const auto command = toCommand(request)) return obey(*command, std::move(request));
    const bool isRight = next_ < expected_.size() && isSame(request, expected_[next_]);
    ++next_;
    request.setTimeStampNs(kEchoStamp);
    say("{}: {}", isRight ? "right" : "wrong", print(request));
    server_.reply(std::move(request));
  }
  void obey(Command command, Message request) {
    switch (command) {
      case Command::sendOutOfBand: {
        // The first reply ends the request.
        auto news = server_.allocReplyMessage<OutOfBand>(request);
        *news = withStandardFields(OutOfBand{.value = 0x01020304});
        server_.reply(std::move(request));
        server_.reply(std::move(news));
        return;
      }
      case Command::refuse:
        return server_.refuse(std::move(request));
      case Command::stall:
        server_.reply(std::move(request));
        return stall();
      case Command::die:
        ::_exit(0);
    }
  }
  static void stall() {
    char signal = 0;
    static_cast<void>(retryInterrupted([&] { return ::read(signals[0], &signal, 1); }));
  }

  MessageServer server_;
  const std::vector<Message> expected_ = everyRequest();
  std::size_t next_ = 0;
};

}  // namespace
}  // namespace mpf::test

int main(int argc, char** argv) try {
  if (argc != 4) return 2;
  mpf::test::catchSignals();
  mpf::test::Echo echo(argv[1], argv[2], std::stoi(argv[3]));
  mpf::test::say("serving");
  echo.run();
} catch (const std::exception& error) {
  mpf::test::say("{}", error.what());
}
