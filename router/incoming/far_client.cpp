// SPDX-License-Identifier: MIT
#include "router/incoming/far_client.h"

#include <algorithm>
#include <fmt/format.h>
#include <utility>

#include "router/transport/kj_text.h"

namespace mpf::router {

namespace {

// Bytes of requests that are held until the server accepts the client, for example while the server
// is stopped. A connection that holds none may always hold one request of any size.
constexpr std::size_t kMaxHeld = std::size_t{4} << 20;  // for a client
constexpr std::size_t kMaxHeldOfAll = std::size_t{64} << 20;  // for a connection

}  // namespace

FarClient::FarClient(RouterContext& context, Owner& owner, Dispatcher& dispatcher,
                     const Terms& terms)
    : context_(context),
      owner_(owner),
      terms_(terms),
      window_(std::max<std::int64_t>(terms.window, 1)),
      fullWindow_(window_),
      expiry_(context.timer, [this] { expire(); }),
      client_(std::make_unique<RelayClient>(
          dispatcher, [this](Message&& message) { onMessage(std::move(message)); })) {}

FarClient::~FarClient() { owner_.heldBytes() -= waitingBytes_; }

// ---- to the server

void FarClient::request(wire::Request::Reader request) {
  const auto id = request.getRequestId();
  if (id == 0) throw ProtocolError(FarewellCode::PROTOCOL, "requestId 0");
  if (gaveUp_) return endRequest(id, *gaveUp_, giveUpReason_);
  ConversionError error;
  auto message = tryFromWire(
      request.getMessage(), {static_cast<std::size_t>(owner_.line().limits().maxMessageBytes)},
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

void FarClient::send(Waiting waiting) {
  if (!connected_) return hold(std::move(waiting));
  const auto id = waiting.requestId;
  const auto result = client_->sendAs(id, std::move(waiting.message), waiting.takeBefore);
  if (result == SendResult::sent) return;
  std::string why = toString(result);
  if (result == SendResult::tooLarge) {
    // A message that was not sent is unchanged.
    const auto bytes = waiting.message.body().size();  // NOLINT(bugprone-use-after-move)
    why += fmt::format(": {} bytes, the limit is {}", bytes, client_->maxMessageBytes());
  }
  endRequest(id, Fate::refused, why);
}

// Holds a request until the server accepts this client, with the limits of the server's own queue.
void FarClient::hold(Waiting waiting) {
  auto& all = owner_.heldBytes();
  const auto bytes = waiting.bytes();
  const bool exceedsLimit = waiting_.size() >= terms_.queueSize ||
                            waitingBytes_ + bytes > kMaxHeld || all + bytes > kMaxHeldOfAll;
  if (exceedsLimit && all != 0) {
    endRequest(waiting.requestId, Fate::refused, toString(SendResult::queueFull));
    if (!std::exchange(queueFullSent_, true)) sendQueueFull();
    return;
  }
  queueFullSent_ = false;
  waitingBytes_ += bytes;
  all += bytes;
  const auto takeBefore = waiting.takeBefore;
  waiting_.push_back(std::move(waiting));
  expiry_.setAt(takeBefore);
}

void FarClient::releaseHeld(std::size_t bytes) noexcept {
  waitingBytes_ -= bytes;
  owner_.heldBytes() -= bytes;
}

// Ends the held requests whose deadline has passed, and sets the timer for the next deadline.
void FarClient::expire() {
  auto next = Deadline::never();
  std::erase_if(waiting_, [&](const Waiting& waiting) {
    if (!waiting.takeBefore.hasPassed()) {
      next = std::min(next, waiting.takeBefore);
      return false;
    }
    endRequest(waiting.requestId, Fate::expired, {});
    releaseHeld(waiting.bytes());
    return true;
  });
  expiry_.setAt(next);
}

// The client may be paused because its window is used up.
void FarClient::onServerGone() {
  serverGone_ = true;
  client_->resume();
}

void FarClient::giveUp(Fate fate, const std::string& why) {
  gaveUp_ = fate;
  giveUpReason_ = why;
  for (const auto& waiting : waiting_) endRequest(waiting.requestId, fate, why);
  waiting_.clear();
  releaseHeld(waitingBytes_);
  client_.reset();  // it would try to connect repeatedly
}

// ---- from the server

void FarClient::onMessage(Message&& message) {
  if (const auto* connect = message.tryAs<Connect>()) return onConnect(*connect);
  const bool isFirst = RelayClient::endsRequest(message);
  const auto requestId = message.route().requestId;
  if (const auto* fate = message.tryAs<RequestFate>()) return endRequest(requestId, fate->fate, {});
  // Replies arrive while the window is used up only when the server is gone. They are dropped.
  if (window_ <= 0)
    return isFirst ? endRequest(requestId, Fate::outcomeUnknown,
                                "the server ended before its replies were received")
                   : void();
  window_ -= windowBytesOf(message);
  if (window_ <= 0 && !serverGone_) client_->pause();
  owner_.line().send(Carried{.isFirst = isFirst,
                             .client = terms_.number,
                             .requestId = requestId,
                             .message = std::move(message)});
}

void FarClient::onConnect(const Connect& connect) {
  switch (connect.status) {
    case ConnectStatus::connectYes:
      if (connect.incarnation != terms_.incarnation)
        return giveUp(Fate::neverTaken, "the server is gone");
      connected_ = true;
      owner_.onConnected(*this);
      releaseHeld(waitingBytes_);
      for (auto waiting = std::exchange(waiting_, {}); !waiting.empty(); waiting.pop_front())
        send(std::move(waiting.front()));
      return;
    case ConnectStatus::connectQueueFull:
      return sendQueueFull();
    case ConnectStatus::connectRefused: {
      const auto why = client_->notConnectedBecause();
      giveUp(Fate::refused, why);
      return owner_.refuseClient(terms_.number, why);
    }
    case ConnectStatus::connectNo:
      if (std::exchange(connected_, false)) owner_.onDisconnected(*this);
      return;
  }
}

void FarClient::sendQueueFull() {
  count(owner_.record()->queueFull);
  owner_.line().send(
      [number = terms_.number](wire::Item::Builder item) { item.setQueueFull(number); });
}

void FarClient::endRequest(std::uint32_t requestId, Fate fate, const std::string& why) {
  owner_.line().send([number = terms_.number, requestId, fate, why](wire::Item::Builder item) {
    auto end = item.initFate();
    end.setClient(number);
    end.setRequestId(requestId);
    end.setFate(static_cast<wire::Fate>(fate));
    if (!why.empty()) end.setReason(displayText(why));
  });
}

void FarClient::credit(std::uint32_t bytes) {
  window_ = std::min(window_ + bytes, fullWindow_);
  if (window_ > 0 && client_) client_->resume();
}

}  // namespace mpf::router
