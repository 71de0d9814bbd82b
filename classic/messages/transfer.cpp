// SPDX-License-Identifier: MIT
#include "classic/messages/transfer.h"

#include <utility>

namespace mpf::classic {

std::unique_ptr<::Message> Transfer::receive(Message&& message) {
  std::unique_ptr<::Message> old;
  if (message.isSound())
    old.reset(::Message::allocate(static_cast<messageType>(message.getType())));
  if (!old) return nullptr;
  old->clientType_ = message.getClientType();
  old->clientExtra_ = message.getClientExtra();
  old->request_ = std::make_shared<Message>();
  old->request_->setRoute(message.route());
  message.setRoute({});
  old->load(std::move(message));
  return old;
}

Message Transfer::send(::Message& message) {
  auto sent = message.unload();
  sent.setClientType(message.clientType_);
  sent.setClientExtra(message.clientExtra_);
  if (message.request_) {
    auto route = message.request_->route();
    route.keeper = nullptr;
    sent.setRoute(route);
  }
  return sent;
}

std::unique_ptr<::Message> Transfer::makeReply(const ::Message& request, messageType type) {
  std::unique_ptr<::Message> reply(::Message::allocate(type));
  if (!reply) return nullptr;
  reply->clientType_ = request.clientType_;
  reply->clientExtra_ = request.clientExtra_;
  reply->request_ = request.request_;
  return reply;
}

std::unique_ptr<::Message> Transfer::withFate(std::unique_ptr<::Message> request, Fate fate) {
  auto answer = std::move(request);
  if (answer->getType() == messageTypeSerialConfig) {
    auto replacement = std::make_unique<::Int32Message>();
    replacement->clientType_ = answer->clientType_;
    replacement->clientExtra_ = answer->clientExtra_;
    answer = std::move(replacement);
  }
  answer->setFate(static_cast<fateStatus>(-1 - static_cast<std::int32_t>(fate)));
  return answer;
}

}  // namespace mpf::classic
