// SPDX-License-Identifier: MIT
#include "router/incoming/far_client.h"

#include <algorithm>
#include <fmt/format.h>
#include <stdexcept>
#include <utility>

#include "router/transport/kj_text.h"

namespace mpf::router {

FarClient::FarClient(const Shared& shared, const Terms& terms)
    : shared_(shared),
      terms_(terms),
      window_(terms.window),
      held_(terms.queueSize, shared.heldBytes),
      client_(std::in_place, shared.dispatcher,
              [this](Message&& message) { onMessage(std::move(message)); }) {
  client_->setRunReceiver(*this);
}

void FarClient::bind(const std::string& server, std::int32_t location) {
  client_->bind(server, location);
  if (client_->lacksResources()) throw std::runtime_error(client_->notConnectedBecause());
}

// ---- to the server

namespace {

void checkId(std::uint32_t requestId) {
  if (requestId == 0)
    throw ProtocolError(FarewellCode::PROTOCOL, "received a request with the invalid requestId 0");
}

}  // namespace

void FarClient::request(PlainItem& item) {
  checkId(item.requestId);
  if (state_ == State::gaveUp) return endRequest(item.requestId, fateAfterGiveUp_, giveUpReason_);
  if (isConnected()) return send(item.requestId, item.message, Deadline::never());
  hold({item.requestId, Deadline::never(), std::move(item.message)});
}

void FarClient::request(const PlainItems& items) {
  std::size_t sent = isConnected() ? client_->sendAs(items.run) : 0;
  for (; sent < items.run.size(); ++sent) {
    auto item = items[sent];
    request(item);
  }
}

void FarClient::request(wire::Request::Reader request) {
  const auto id = request.getRequestId();
  checkId(id);
  if (state_ == State::gaveUp) return endRequest(id, fateAfterGiveUp_, giveUpReason_);
  ConversionError error;
  auto message = tryFromWire(
      request.getMessage(), {static_cast<std::size_t>(shared_.line.limits().maxMessageBytes)},
      error, [&](std::size_t bytes) { return client_->allocateBody(bytes); });
  if (!message) {
    if (error.fault == ConversionFault::malformed)
      throw ProtocolError(FarewellCode::PROTOCOL, error.text);
    // A message type that only a newer peer defines must be well-formed, too: totalSize() throws.
    static_cast<void>(request.getMessage().totalSize());
    return endRequest(id, Fate::refused, error.text);
  }
  const auto within = request.getTakeWithinNs();
  const auto takeBefore =
      within == 0 ? Deadline::never()
                  : Deadline::after(Nanoseconds(std::min<std::uint64_t>(within, INT64_MAX)));
  send({id, takeBefore, std::move(*message)});
}

void FarClient::send(HeldRequest request) {
  if (!isConnected()) return hold(std::move(request));
  send(request.requestId, request.message, request.takeBefore);
}

void FarClient::send(std::uint32_t requestId, Message& message, Deadline takeBefore) {
  const auto result = client_->sendAs(requestId, std::move(message), takeBefore);
  if (result == SendResult::sent) return;
  std::string why = toString(result);
  if (result == SendResult::tooLarge) {
    // A message that was not sent is unchanged.
    const auto bytes = message.body().size();  // NOLINT(bugprone-use-after-move)
    why += fmt::format(": {} bytes, the limit is {}", bytes, client_->maxMessageBytes());
  }
  endRequest(requestId, Fate::refused, why);
}

// Holds a request until the server accepts this client.
void FarClient::hold(HeldRequest request) {
  const auto takeBefore = request.takeBefore;
  const auto id = request.requestId;
  if (!held_.tryHold(std::move(request))) {
    endRequest(id, Fate::refused, toString(SendResult::queueFull));
    if (!std::exchange(queueFullSent_, true)) sendQueueFull();
    return;
  }
  queueFullSent_ = false;
  expireAt(takeBefore);
}

// Ends the held requests whose deadline has passed, and sets the timer for the next deadline.
void FarClient::expire() {
  for (const auto& request : held_.takeExpired()) endRequest(request.requestId, Fate::expired, {});
  expireAt(held_.nextDeadline());
}

void FarClient::expireAt(Deadline deadline) {
  if (deadline.isNever()) return;
  if (!expiry_) expiry_ = std::make_unique<Alarm>(shared_.timer, [this] { expire(); });
  expiry_->setAt(deadline);
}

// The client may be paused because its window is used up.
void FarClient::onServerGone() {
  state_ = State::draining;
  client_->resume();
}

void FarClient::giveUp(Fate fate, const std::string& why) {
  state_ = State::gaveUp;
  fateAfterGiveUp_ = fate;
  giveUpReason_ = why;
  for (const auto& request : held_.takeAll()) endRequest(request.requestId, fate, why);
  client_.reset();  // it would try to connect repeatedly
}

// ---- from the server

void FarClient::onMessage(Message&& message) {
  if (const auto* connect = message.tryAs<Connect>()) return onConnect(*connect);
  const bool isFirst = RelayClient::endsRequest(message);
  const auto requestId = message.route().requestId;
  if (const auto* fate = message.tryAs<RequestFate>()) return endRequest(requestId, fate->fate, {});
  // Replies arrive while the window is used up only when the server is gone. They are dropped.
  if (window_ <= 0) return drop(requestId, isFirst, message.getMissed());
  const auto missed = takeDropped(requestId) + message.getMissed();
  message.setRoute({0, requestId, Message::missedFlags(missed), nullptr});
  useWindow(windowBytesOf(message));
  if (PlainItem::canCarry(message))
    return shared_.line.send(PlainOutgoing{false, isFirst, terms_.number, requestId, message});
  shared_.line.send(Carried{.isFirst = isFirst,
                            .client = terms_.number,
                            .requestId = requestId,
                            .message = std::move(message)});
}

void FarClient::useWindow(std::int64_t bytes) {
  window_ -= bytes;
  if (window_ <= 0 && state_ != State::draining) client_->pause();
}

// The last reply may exceed the window.
std::size_t FarClient::room() const noexcept {
  if (window_ <= 0 || !dropped_.empty()) return 0;
  const auto inWindow = static_cast<std::size_t>((window_ - 1) / kWindowOverheadBytes + 1);
  return std::min(inWindow, shared_.line.room());
}

void FarClient::onRun(const MessageRun& run, bool isFirst) {
  useWindow(static_cast<std::int64_t>(run.size() * kWindowOverheadBytes));
  shared_.line.send(PlainItems{false, isFirst, terms_.number, run});
}

//   missed  further replies that the server has dropped before this one
void FarClient::drop(std::uint32_t requestId, bool isFirst, std::uint32_t missed) {
  if (isFirst)
    return endRequest(requestId, Fate::outcomeUnknown,
                      "the server ended before its replies were received");
  if (requestId != 0) dropped_.push_back({requestId, takeDropped(requestId) + missed + 1});
}

// Returns how many further replies to a request were dropped since the last call for it.
std::uint32_t FarClient::takeDropped(std::uint32_t requestId) {
  const auto dropped = std::ranges::find(dropped_, requestId, &Dropped::requestId);
  if (dropped == dropped_.end()) return 0;
  const auto count = dropped->count;
  dropped_.erase(dropped);
  return count;
}

void FarClient::onConnect(const Connect& connect) {
  switch (connect.status) {
    case ConnectStatus::connectYes:
      if (connect.incarnation != terms_.incarnation)
        return giveUp(Fate::neverTaken, "the server is gone");
      return accept();
    case ConnectStatus::connectQueueFull:
      return sendQueueFull();
    case ConnectStatus::connectRefused: {
      const auto why = client_->notConnectedBecause();
      giveUp(Fate::refused, why);
      return shared_.events.onRefused(*this, why);
    }
    case ConnectStatus::connectNo:
      if (!isConnected()) return;
      state_ = State::waiting;
      return shared_.events.onDisconnected(*this);
  }
}

// The server has accepted the client: sends what was held.
void FarClient::accept() {
  state_ = State::connected;
  shared_.events.onConnected(*this);
  for (auto& request : held_.takeAll()) send(std::move(request));
}

void FarClient::sendQueueFull() {
  count(shared_.record->queueFull);
  shared_.line.send(
      [number = terms_.number](wire::Item::Builder item) { item.setQueueFull(number); });
}

void FarClient::endRequest(std::uint32_t requestId, Fate fate, const std::string& why) {
  shared_.line.send([number = terms_.number, requestId, fate, why](wire::Item::Builder item) {
    auto end = item.initFate();
    end.setClient(number);
    end.setRequestId(requestId);
    end.setFate(static_cast<wire::Fate>(fate));
    if (!why.empty()) end.setReason(displayText(why));
  });
}

void FarClient::credit(std::uint32_t bytes) {
  window_ = std::min<std::int64_t>(window_ + bytes, terms_.window);
  if (window_ > 0 && client_) client_->resume();
}

}  // namespace mpf::router
