// SPDX-License-Identifier: MIT
// event_loop_client COUNT: sends COUNT requests to doubling_server from a poll() loop, and prints
// the replies and fates.
#include <poll.h>

#include <chrono>
#include <cstdlib>
#include <iostream>

#include <mpf/message_client.h>

namespace {

// The longest time that poll() may wait: until the dispatcher must act on a deadline, such as that
// of a request.
int pollTimeoutMs(const mpf::Dispatcher& dispatcher) {
  const auto deadline = dispatcher.nextDeadline();
  if (deadline.isNever()) return -1;
  return static_cast<int>(std::chrono::ceil<std::chrono::milliseconds>(deadline.left()).count());
}

}  // namespace

int main(int argc, char** argv) {
  using namespace std::chrono_literals;
  if (argc != 2) {
    std::cerr << "usage: event_loop_client COUNT\n";
    return 2;
  }
  int left = std::atoi(argv[1]);
  mpf::Dispatcher dispatcher(mpf::Backplane::attach());
  mpf::MessageClient client(dispatcher, [&](mpf::Message&& message) {
    if (const auto* connect = message.tryAs<mpf::Connect>();
        connect != nullptr && connect->status == mpf::ConnectStatus::connectYes) {
      for (int value = 1; value <= left; ++value) {
        if (client.send(mpf::Int32Message({.value = value}), mpf::Deadline::after(5s)) !=
            mpf::SendResult::sent)
          std::abort();
      }
    } else if (const auto* reply = message.tryAs<mpf::Int32>()) {
      std::cout << "reply " << reply->value << '\n';
      --left;
    } else if (const auto* fate = message.tryAs<mpf::RequestFate>()) {
      std::cout << "no reply: " << toString(fate->fate) << '\n';
      --left;
    }
  });
  client.bind("doubler");

  pollfd entry{dispatcher.descriptor(), POLLIN, 0};  // an application adds its own descriptors here
  while (left > 0) {
    ::poll(&entry, 1, pollTimeoutMs(dispatcher));
    dispatcher.runPending();
  }
}
