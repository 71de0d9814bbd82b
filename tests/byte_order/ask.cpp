// SPDX-License-Identifier: MIT
// mpf_test_ask BACKPLANE SERVER LOCATION: sends every message to mpf_test_echo, makes it refuse,
// stall and die, and prints the result of each request.
// mpf_test_ask BACKPLANE SERVER LOCATION why: prints why it is not connected, each time that the
// reason changes.
#include <cstddef>
#include <deque>
#include <string>
#include <utility>

#include <mpf/message_client.h>

#include "schema/text.h"
#include "tests/byte_order/talk.h"
#include "tests/support/every_message.h"

namespace mpf::test {
namespace {

class Asker {
 public:
  Asker(const std::string& backplane, const std::string& server, std::int32_t location)
      : dispatcher_(Backplane::attach(backplane)),
        client_(dispatcher_, [this](Message&& message) { got_.push_back(std::move(message)); }) {
    client_.bind(server, location);
  }

  void run() {
    const auto firstLife = sayConnected();
    askEverything();
    askForOthers();
    fillTheQueue();
    haveItDie();
    if (sayConnected() == firstLife) say("the same life");
  }

  void sayWhy() {
    for (std::string said; got_.empty();
         dispatcher_.runOnce(Deadline::after(std::chrono::milliseconds(10)))) {
      if (const auto why = client_.notConnectedBecause(); why != said) say("{}", said = why);
    }
  }

 private:
  // The next message: a reply, a fate or a ConnectMessage.
  Message next() {
    while (got_.empty()) dispatcher_.runOnce();
    auto message = std::move(got_.front());
    got_.pop_front();
    return message;
  }
  void sayNext() { say("{}", describe(next())); }
  // The text without the numbers that differ each time.
  static std::string describe(const Message& message) {
    if (const auto* fate = message.tryAs<RequestFate>())
      return fmt::format("fate {}", toString(fate->fate));
    if (const auto* news = message.tryAs<Connect>()) return std::string(toString(news->status));
    return print(message);
  }
  void send(Message message) {
    if (const auto result = client_.send(std::move(message)); result != SendResult::sent)
      say("not sent: {}", toString(result));
  }
  // Returns the incarnation of the server.
  std::uint64_t sayConnected() {
    const auto message = next();
    say("{}", describe(message));
    const auto* news = message.tryAs<Connect>();
    return news == nullptr ? 0 : news->incarnation;
  }

  void askEverything() {
    for (auto& request : everyRequest()) {
      send(request.duplicate());
      request.setTimeStampNs(kEchoStamp);
      const auto reply = next();
      if (isSame(reply, request)) say("right: {}", print(reply));
      else say("wrong: {} in place of {}", print(reply), print(request));
    }
  }
  void askForOthers() {
    send(toMessage(Command::sendOutOfBand));
    next();
    sayNext();
    send(toMessage(Command::refuse));
    sayNext();
  }
  void fillTheQueue() {
    send(toMessage(Command::stall));
    next();
    std::size_t sent = 0, ended = 0;
    for (bool isFull = false; !isFull;) {
      if (client_.send(Int32Message()) == SendResult::sent) ++sent;
      dispatcher_.runOnce(Deadline::after(std::chrono::milliseconds(1)));
      for (; !got_.empty(); got_.pop_front()) {
        if (got_.front().tryAs<Connect>() != nullptr) isFull = true;
        else ++ended;
      }
    }
    say("the queue is full");
    while (ended < sent) {
      if (next().tryAs<Connect>() == nullptr) ++ended;
    }
    say("each request has ended");
  }
  void haveItDie() {
    send(toMessage(Command::stall));
    while (next().tryAs<Connect>() != nullptr) continue;
    send(toMessage(Command::die));
    send(Int32Message());
    send(Int32Message());
    say("it will die");
    for (int i = 0; i < 4; ++i) sayNext();
  }
  Dispatcher dispatcher_;
  std::deque<Message> got_;
  MessageClient client_;
};

}  // namespace
}  // namespace mpf::test

int main(int argc, char** argv) {
  if (argc < 4) return 2;
  mpf::test::Asker asker(argv[1], argv[2], std::stoi(argv[3]));
  if (argc == 4) asker.run();
  else asker.sayWhy();
}
