// SPDX-License-Identifier: MIT
#include <mpf/classic/message_server.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include <mpf/message_server.h>

#include "base/print_error.h"
#include "classic/messages/transfer.h"

using mpf::classic::Transfer;

namespace {

constexpr int kMaxQueueSize = 16384;  // of mpf::ServerOptions
constexpr auto kRetryEvery = std::chrono::seconds(1);

int limitedQueueSize(int size) { return std::clamp(size, 1, kMaxQueueSize); }

}  // namespace

class MessageServer::Impl {
 public:
  Impl(std::string name, int queueSize) : name_(std::move(name)), queueSize_(queueSize) {
    if (const auto reason = tryOpen(); !reason.empty())
      mpf::printError("MessageServer \"{}\": not served yet: {}\n", name_, reason);
  }
  // Returns the reason why there is no server; empty on success.
  std::string tryOpen() try {
    server_.emplace(mpf::Backplane::attach(), name_, mpf::ServerOptions{.queueSize = queueSize_});
    return {};
  } catch (const std::exception& error) {
    return error.what();
  }
  void wait() {
    while (!server_ && !tryOpen().empty()) std::this_thread::sleep_for(kRetryEvery);
    server_->waitForMessage();
  }
  void setQueueSize(int size) {
    queueSize_ = size;
    if (server_) server_->setQueueSize(size);
  }

  const std::string name_;
  int queueSize_;
  std::optional<mpf::MessageServer> server_;
};

MessageServer::MessageServer(const char* name, int queueSize)
    : impl_(std::make_unique<Impl>(name, limitedQueueSize(queueSize))) {}

MessageServer::~MessageServer() = default;

void MessageServer::waitForMessage() { impl_->wait(); }

Message* MessageServer::receive() try {
  // A message without an old form is refused when it is destroyed.
  while (impl_->server_) {
    auto message = impl_->server_->receive();
    if (!message) break;
    if (auto received = Transfer::receive(std::move(message))) return received.release();
  }
  return nullptr;
} catch (const std::exception& error) {
  mpf::printError("MessageServer \"{}\": a request is refused: {}\n", getName(), error.what());
  return nullptr;
}

Message* MessageServer::allocReplyMessage(Message* clientMessage, messageType type) {
  return Transfer::makeReply(*clientMessage, type).release();
}

int MessageServer::reply(Message* message) try {
  const std::unique_ptr<Message> owned(message);
  if (!owned || !impl_->server_) return -1;
  return impl_->server_->reply(Transfer::send(*owned)) == mpf::ReplyResult::sent ? 0 : -1;
} catch (const std::exception& error) {
  mpf::printError("MessageServer \"{}\": cannot reply: {}\n", getName(), error.what());
  return -1;
}

void MessageServer::setQueueSize(int size) { impl_->setQueueSize(limitedQueueSize(size)); }
const char* MessageServer::getName() const { return impl_->name_.c_str(); }
void MessageServer::report() const {
  if (impl_->server_) impl_->server_->report();
}
