// SPDX-License-Identifier: MIT
#include <mpf/sync_client.h>

namespace mpf {
namespace {

std::string limitExceeded(const Message& message, std::uint64_t maxBytes) {
  return ": " + std::to_string(message.body().size()) + " bytes, the limit is " +
         std::to_string(maxBytes);
}

}  // namespace

std::string Answer::why() const {
  if (fate_) return std::string("no reply: ") + std::string(toString(*fate_));
  if (refusal_) return std::string("not sent: ") + toString(*refusal_) + details_;
  return {};
}

SyncClient::SyncClient(const Backplane& backplane, const std::string& server, std::int32_t location,
                       WaitMode waitMode)
    : dispatcher_(backplane, {waitMode, {}}),
      client_(dispatcher_, [this](Message&& message) { take(std::move(message)); }) {
  client_.bind(server, location);
}

void SyncClient::take(Message&& message) {
  if (awaited_ != 0 && message.route().requestId == awaited_) {
    awaited_ = 0;
    if (const auto* fate = message.tryAs<RequestFate>()) {
      answer_.emplace(fate->fate);
    } else {
      answer_.emplace(std::move(message));
    }
  } else if (message.getType() != MessageType::connect &&
             message.getType() != MessageType::requestFate) {
    others_.push_back(std::move(message));
  }
}

// The calling thread runs the dispatcher, even when another thread ran it last.
bool SyncClient::connectWait(Nanoseconds timeout) {
  if (client_.isInherited()) return false;
  const auto deadline = Deadline::after(timeout);
  while (!client_.isConnected() && !deadline.hasPassed()) dispatcher_.runOnce(deadline);
  return client_.isConnected();
}

Answer SyncClient::call(Message&& message, Nanoseconds timeout, Retry retry) {
  const auto deadline = Deadline::after(timeout);
  if (retry == Retry::never) return callOnce(std::move(message), deadline);
  for (;;) {
    auto answer = callOnce(message.duplicate(), deadline);
    // The server may stop between the connection and the sending.
    const auto isUndone =
        answer.fate() == Fate::neverTaken || answer.refusal() == SendResult::notConnected;
    if (!isUndone || deadline.hasPassed()) return answer;
  }
}

Answer SyncClient::callOnce(Message&& message, Deadline deadline) {
  if (!client_.isConnected() && !connectWait(deadline.left()))
    return Answer(SendResult::notConnected);
  answer_.reset();
  // send() may write awaited_ before the reply is handled: only this thread delivers replies.
  if (const auto result = client_.send(std::move(message), deadline, &awaited_);
      result != SendResult::sent) {
    awaited_ = 0;
    // NOLINTNEXTLINE(bugprone-use-after-move): a message that was not sent is unchanged
    if (result == SendResult::tooLarge)
      return Answer(result, limitExceeded(message, client_.maxMessageBytes()));
    return Answer(result);
  }
  while (!answer_ && !deadline.hasPassed()) dispatcher_.runOnce(deadline);
  if (!answer_) {
    // Delivers `expired` if the server has not received the request. Otherwise the server may still
    // act on the request.
    dispatcher_.runOnce(Deadline::atNs(0));
    if (!answer_) {
      client_.cancel(awaited_);
      answer_.emplace(Fate::outcomeUnknown);
    }
  }
  awaited_ = 0;
  auto answer = std::move(*answer_);
  answer_.reset();
  return answer;
}

Message SyncClient::receive(Nanoseconds timeout) {
  const auto deadline = Deadline::after(timeout);
  // Runs the dispatcher at least once: with a timeout of 0, it returns a message that has arrived.
  for (bool isFirst = true; others_.empty() && (isFirst || !deadline.hasPassed()); isFirst = false)
    dispatcher_.runOnce(deadline);
  if (others_.empty()) return {};
  auto message = std::move(others_.front());
  others_.pop_front();
  return message;
}

}  // namespace mpf
