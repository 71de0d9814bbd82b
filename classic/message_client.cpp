// SPDX-License-Identifier: MIT
#include <mpf/classic/message_client.h>

#include <exception>
#include <mutex>
#include <optional>
#include <unordered_map>
#include <utility>

#include <mpf/message_client.h>

#include "base/print_error.h"
#include "classic/messages/transfer.h"

using mpf::classic::Transfer;

class MessageClient::Impl {
 public:
  Impl(clientCallback callback, void* pvt) : callback_(callback), pvt_(pvt) {}
  ~Impl() { client_.reset(); }  // no callback runs afterwards
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void bind(const char* server, int location) {
    const std::lock_guard lock(mutex_);
    if (!client_)
      client_.emplace(mpf::Backplane::attach(), [this](mpf::Message&& message) {
        // The callback may delete this object.
        if (auto received = convert(std::move(message))) callback_(received.release(), pvt_);
      });
    client_->bind(server, location);
  }

  [[nodiscard]] bool trySend(std::unique_ptr<::Message> request) {
    auto message = Transfer::send(*request);
    const std::lock_guard lock(mutex_);
    if (!client_) return false;
    waiting_.reserve(waiting_.size() + 1);
    std::uint32_t id = 0;
    const auto result = client_->send(std::move(message), mpf::Deadline::never(), &id);
    if (result == mpf::SendResult::sent) waiting_.insert_or_assign(id, std::move(request));
    return result == mpf::SendResult::sent;
  }

 private:
  // The message for the callback; null for one that has no old form and answers no request.
  [[nodiscard]] std::unique_ptr<::Message> convert(mpf::Message&& message) {
    if (const auto* fate = message.tryAs<mpf::RequestFate>())
      return withFate(takeRequest(fate->requestId), fate->fate);
    const auto route = message.route();
    auto request = (route.flags & mpf::kEndsRequest) != 0 ? takeRequest(route.requestId) : nullptr;
    auto received = Transfer::receive(std::move(message));
    return received ? std::move(received) : withFate(std::move(request), mpf::Fate::outcomeUnknown);
  }
  [[nodiscard]] static std::unique_ptr<::Message> withFate(std::unique_ptr<::Message> request,
                                                           mpf::Fate fate) {
    return request ? Transfer::withFate(std::move(request), fate) : nullptr;
  }
  [[nodiscard]] std::unique_ptr<::Message> takeRequest(std::uint32_t id) {
    const std::lock_guard lock(mutex_);
    auto node = waiting_.extract(id);
    return node ? std::move(node.mapped()) : nullptr;
  }

  const clientCallback callback_;
  void* const pvt_;
  std::mutex mutex_;
  // Requests without an answer, by their number.
  std::unordered_map<std::uint32_t, std::unique_ptr<::Message>> waiting_;  // under mutex_
  std::optional<mpf::MessageClient> client_;
};

MessageClient::MessageClient(clientCallback callback, void* clientPvt)
    : clientPvt_(clientPvt), impl_(std::make_unique<Impl>(callback, clientPvt)) {}

MessageClient::~MessageClient() = default;

int MessageClient::bind(const char* server, int location) try {
  impl_->bind(server, location);
  return 0;
} catch (const std::exception& error) {
  mpf::printError("MessageClient: cannot bind to server \"{}\": {}\n", server, error.what());
  return -1;
}

int MessageClient::send(Message* message) try {
  std::unique_ptr<Message> request(message);
  return request && impl_->trySend(std::move(request)) ? 0 : -1;
} catch (const std::exception& error) {
  mpf::printError("MessageClient: cannot send: {}\n", error.what());
  return -1;
}
