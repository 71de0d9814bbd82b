// SPDX-License-Identifier: MIT
#include <mpf/sync_client.h>

#include <algorithm>
#include <fmt/format.h>
#include <string_view>

#include "base/duration_text.h"
#include "base/printable.h"
#include "shm/layout.h"

namespace mpf {
namespace {

// After so many steps the dispatcher has looked at deadlines, however many replies wait.
constexpr int kStepsToDeadlines = 64;

constexpr std::size_t kShownCharacters = 500;

// Whether the body does not fit into a ring: it may keep a chunk of the server's pool.
bool isLong(const Message& message) noexcept {
  return message.body().size() > layout::kInlineBodyBytes;
}

// The words of a server that could not do what was asked, such as one in Python.
std::string wordsOf(const Message& reply) {
  const auto* fields = reply.tryAs<Char8Array>();
  const auto status = fields == nullptr ? 0 : fields->status;
  if (status == 0) return {};
  const auto value = reply.valueAs<Char8Array>();
  const std::string_view text(value.data(), std::min(value.size(), kShownCharacters));
  return fmt::format("; it has status {}: \"{}\"", status, printable(text));
}

}  // namespace

std::string Answer::why() const {
  if (fate_)
    return fmt::format("no reply{}: {} ({})", details_, toString(*fate_), meaningOf(*fate_));
  if (refusal_) return fmt::format("not sent: {}{}", toString(*refusal_), details_);
  if (!reply_ || expected_ == MessageType::none) return {};
  if (reply_.getType() == expected_)
    return fmt::format("the reply is no valid {} message", toString(expected_));
  return fmt::format("the reply is of type {}, not {}{}", toString(reply_.getType()),
                     toString(expected_), wordsOf(reply_));
}

SyncClient::SyncClient(const Backplane& backplane, const std::string& server, std::int32_t location,
                       WaitMode waitMode)
    : dispatcher_(backplane, {waitMode, {}}),
      client_(dispatcher_, [this](Message&& message) { take(std::move(message)); }) {
  client_.bind(server, location);
}

void SyncClient::take(Message&& message) {
  const auto& route = message.route();
  // A further reply to an earlier request has the same id if 2^32 requests were sent since.
  if (awaited_ != 0 && route.requestId == awaited_ && (route.flags & kEndsRequest) != 0) {
    awaited_ = 0;
    if (const auto* fate = message.tryAs<RequestFate>()) {
      answer_.emplace(fate->fate);
    } else {
      answer_.emplace(std::move(message));
    }
  } else if (message.getType() != MessageType::connect &&
             message.getType() != MessageType::requestFate) {
    store(std::move(message));
  }
}

void SyncClient::store(Message&& message) {
  const bool isLongOne = isLong(message);
  others_.push_back(std::move(message));
  if (isLongOne) ++longOthers_;
  for (; others_.size() > kMaxStored || longOthers_ > kMaxStoredLong; ++dropped_) takeStored();
}

Message SyncClient::takeStored() noexcept {
  auto message = std::move(others_.front());
  others_.pop_front();
  if (isLong(message)) --longOthers_;
  return message;
}

// The calling thread runs the dispatcher, even when another thread ran it last.
bool SyncClient::connectWait(Nanoseconds timeout) {
  if (client_.isInherited()) return false;
  const auto deadline = Deadline::after(timeout);
  while (!client_.isConnected() && !deadline.hasPassed()) dispatcher_.runOnce(deadline);
  return client_.isConnected();
}

// Connects if necessary, and sets awaited_ when the result is `sent`.
SendResult SyncClient::send(Message&& message, Deadline deadline, Retry retry) {
  for (;;) {
    if (!client_.isConnected() && !connectWait(deadline.left())) return SendResult::notConnected;
    // send() may write awaited_ before the reply is handled: only this thread delivers replies.
    // NOLINTNEXTLINE(bugprone-use-after-move): a message that was not sent is unchanged
    const auto result = client_.send(std::move(message), deadline, &awaited_, retry);
    // The server may stop between the connection and the sending.
    if (result != SendResult::notConnected || retry == Retry::never || deadline.hasPassed())
      return result;
  }
}

Answer SyncClient::call(Message&& message, Nanoseconds timeout, Retry retry) {
  const auto deadline = Deadline::after(timeout);
  answer_.reset();
  awaited_ = 0;
  if (const auto result = send(std::move(message), deadline, retry); result != SendResult::sent)
    // NOLINTNEXTLINE(bugprone-use-after-move): a message that was not sent is unchanged
    return Answer(result, detailsOf(result, message));
  while (!answer_ && !deadline.hasPassed()) dispatcher_.runOnce(deadline);
  if (!answer_) {
    // Delivers `expired` if the server has not received the request. Otherwise the server may still
    // act on the request.
    for (int steps = 0; steps < kStepsToDeadlines && !answer_; ++steps)
      if (!dispatcher_.runOnce(Deadline::atNs(0))) break;
    if (!answer_) {
      client_.cancel(awaited_);
      const auto waitedNs = static_cast<double>(timeout.count());
      answer_.emplace(Fate::outcomeUnknown, " within " + durationText(waitedNs));
    }
  }
  awaited_ = 0;
  auto answer = std::move(*answer_);
  answer_.reset();
  return answer;
}

// What why() says beside the refusal.
std::string SyncClient::detailsOf(SendResult refusal, const Message& notSent) const {
  if (refusal == SendResult::tooLarge)
    return fmt::format(": {} bytes, the limit is {}", notSent.body().size(),
                       client_.maxMessageBytes());
  if (refusal != SendResult::notConnected) return {};
  const auto because = client_.notConnectedBecause();
  return because.empty() ? "" : ": " + because;
}

Message SyncClient::receive(Nanoseconds timeout) {
  const auto deadline = Deadline::after(timeout);
  // Runs the dispatcher at least once: with a timeout of 0, it returns a message that has arrived.
  for (bool isFirst = true; others_.empty() && (isFirst || !deadline.hasPassed()); isFirst = false)
    dispatcher_.runOnce(deadline);
  return others_.empty() ? Message() : takeStored();
}

}  // namespace mpf
