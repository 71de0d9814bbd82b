// SPDX-License-Identifier: MIT
#include "python/extension/connection.h"

#include <new>
#include <utility>
#include <vector>

#include "python/extension/errors.h"
#include "python/extension/gil.h"
#include "python/extension/options.h"

namespace mpf::python {
namespace {

constexpr const char* kClient = "client";

// The messages to send for several objects. Those that were not sent go back to their objects.
class OutgoingMessages {
 public:
  //   throws  as PyMessage::toMessage(); all objects are unchanged then
  OutgoingMessages(std::span<PyMessage* const> objects, const Allocator& allocator)
      : objects_(objects) {
    messages_.reserve(objects.size());
    try {
      for (auto* object : objects) messages_.push_back(object->toMessage(allocator));
    } catch (...) {
      restore();
      throw;
    }
  }
  ~OutgoingMessages() { restore(); }
  OutgoingMessages(const OutgoingMessages&) = delete;
  OutgoingMessages& operator=(const OutgoingMessages&) = delete;

  [[nodiscard]] std::span<Message> messages() noexcept { return messages_; }

 private:
  void restore() noexcept {
    for (std::size_t i = 0; i < messages_.size(); ++i) {
      if (messages_[i]) objects_[i]->restore(std::move(messages_[i]));
    }
  }

  std::span<PyMessage* const> objects_;
  std::vector<Message> messages_;  // those that were sent are empty
};

}  // namespace

Connection::Connection(const std::string& backplane, std::string serverName, std::int32_t location,
                       WaitMode waitMode)
    : server(std::move(serverName)),
      forks_(forkCount()),
      requester_(
          std::make_shared<Requester>(Backplane::attach(backplane), server, location, waitMode)) {}

Connection::~Connection() {
  // Threads of the parent may have waited in the requester: its parts cannot be destroyed here.
  if (isInherited())
    static_cast<void>(new (std::nothrow) std::shared_ptr<Requester>(std::move(requester_)));
}

bool Connection::isInherited() const noexcept { return forks_ != forkCount(); }

void Connection::close() {
  if (!requester_ || isInherited()) return;
  requester_->close();
  requester_.reset();
}

std::shared_ptr<Requester> Connection::requester() const {
  if (!requester_) raiseClosed(kClient);
  if (isInherited()) raiseInherited(kClient);
  return requester_;
}

void Connection::connect(Requester& requester, Deadline deadline) {
  if (requester.client().isConnected()) return;
  bool wasInterrupted = false;
  {
    WithoutGil unlocked;
    requester.connect(deadline, unlocked.interruption());
    wasInterrupted = unlocked.wasInterrupted();
  }
  if (wasInterrupted) throw nb::python_error();
}

// Sends by `attempt`. If replies that the program has not waited for may take the room, it takes
// them and tries once more.
template <class Attempt>
SendResult Connection::sendWithRoom(Requester& requester, const Attempt& attempt) {
  const auto result = attempt();
  if (result != SendResult::queueFull && result != SendResult::tooManyOutstanding &&
      result != SendResult::noMemory)
    return result;
  {
    const WithoutGil unlocked;
    requester.takeArrived();
  }
  return attempt();
}

void Connection::send(PyMessage& message, Exchange& exchange, Deadline deadline,
                      Deadline connectBefore, Retry retry) {
  for (;;) {
    const auto requester = this->requester();
    connect(*requester, connectBefore);
    auto& client = requester->client();
    auto sent = message.toMessage(Allocator(client));
    const auto result = sendWithRoom(*requester, [&] {
      // NOLINTNEXTLINE(bugprone-use-after-move): a message that was not sent is unchanged
      return requester->send(std::move(sent), exchange, deadline, retry);
    });
    if (result == SendResult::sent) return;
    // NOLINTNEXTLINE(bugprone-use-after-move): a message that was not sent is unchanged
    const auto bytes = sent.body().size();
    message.restore(std::move(sent));
    raiseUnlessLost(client, result, bytes, connectBefore);
  }
}

std::size_t Connection::sendMany(std::span<PyMessage* const> messages,
                                 std::span<Exchange* const> exchanges, Deadline deadline,
                                 Deadline connectBefore) {
  if (messages.empty()) return 0;
  for (;;) {
    const auto requester = this->requester();
    connect(*requester, connectBefore);
    auto& client = requester->client();
    OutgoingMessages outgoing(messages, Allocator(client));
    std::size_t count = 0;
    const auto result = sendWithRoom(*requester, [&] {
      const auto sent = requester->sendMany(outgoing.messages().subspan(count),
                                            exchanges.subspan(count), deadline);
      count += sent.count;
      return sent.result;
    });
    if (count != 0) return count;
    raiseUnlessLost(client, result, outgoing.messages().front().body().size(), connectBefore);
  }
}

void Connection::raiseUnlessLost(MessageClient& client, SendResult result, std::size_t bytes,
                                 Deadline connectBefore) const {
  // The server may have stopped since.
  if (result == SendResult::notConnected && !connectBefore.hasPassed()) return;
  if (result == SendResult::notConnected)
    raiseNotSent(server, result, client.notConnectedBecause());
  if (result == SendResult::tooLarge)
    raiseTooLarge(server, "not sent", bytes, client.maxMessageBytes());
  raiseNotSent(server, result, {});
}

}  // namespace mpf::python
