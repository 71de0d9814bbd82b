// SPDX-License-Identifier: MIT
#include "server/programs/gpib_server/service_subscriptions.h"

#include <algorithm>
#include <limits>
#include <utility>

#include <mpf/gpib_commands.h>

namespace mpf {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kFirstPause{20};
constexpr milliseconds kLongestPause{1000};

}  // namespace

ServiceSubscriptions::ServiceSubscriptions(MessageServer& server, GpibBus& bus,
                                           const ServerLog& log, milliseconds pollTimeout,
                                           std::function<void()> requested)
    : server_(server),
      bus_(bus),
      log_(log),
      pollTimeout_(pollTimeout),
      requested_(std::move(requested)) {}

// ---- the server's thread

void ServiceSubscriptions::add(Char8ArrayMessage&& request, GpibAddress address) {
  const auto client = server_.clientOf(request);
  if (client == 0) return;  // the client has disconnected
  remove(client, address);
  {
    const std::lock_guard lock(mutex_);
    auto reply = server_.allocReplyMessage<Char8Array>(request, 0);
    *reply = *request;
    reply.setSize(0);
    reply->status = gpib::gpibStatusOK;
    static_cast<void>(server_.reply(std::move(reply)));
    subscriptions_.push_back({std::move(request), client, address});
  }
  watchLineIfNeeded();
}

void ServiceSubscriptions::remove(GpibUser client, std::optional<GpibAddress> address) {
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(subscriptions_, [&](const Subscription& subscription) {
      return subscription.client == client && (!address || subscription.address == *address);
    });
  }
  watchLineIfNeeded();
}

void ServiceSubscriptions::removeGone() {
  {
    const std::lock_guard lock(mutex_);
    const auto removed = std::erase_if(subscriptions_, [&](const Subscription& subscription) {
      return server_.clientOf(subscription.request) != subscription.client;
    });
    if (removed == 0) return;
  }
  watchLineIfNeeded();
}

void ServiceSubscriptions::watchLineIfNeeded() {
  bool isEmpty = false;
  {
    const std::lock_guard lock(mutex_);
    isEmpty = subscriptions_.empty();
  }
  if (isEmpty) {
    line_.reset();
  } else if (!line_) {
    line_ = bus_.onServiceRequest([this] {
      isRequested_.store(true, std::memory_order_relaxed);
      requested_();
    });
  }
}

// ---- the bus thread

std::vector<GpibAddress> ServiceSubscriptions::instrumentsOf(GpibUser holder) const {
  std::vector<GpibAddress> addresses;
  const std::lock_guard lock(mutex_);
  for (const auto& subscription : subscriptions_)
    if (holder == 0 || subscription.client == holder) addresses.push_back(subscription.address);
  std::ranges::sort(addresses);
  addresses.erase(std::ranges::unique(addresses).begin(), addresses.end());
  return addresses;
}

void ServiceSubscriptions::pollInstruments(GpibUser holder) {
  if (holder != std::exchange(holder_, holder)) round_.clear();
  if (round_.empty()) {
    if (!noPollsBefore_.hasPassed() || !isRequested_.exchange(false, std::memory_order_relaxed))
      return;
    round_ = instrumentsOf(holder);
    isFound_ = false;
    if (round_.empty()) return;
  }
  const auto address = round_.back();
  round_.pop_back();
  const auto poll = bus_.serialPoll(address, Deadline::after(pollTimeout_), holder);
  if (poll.ok()) {
    isFound_ = isFound_ || (poll.statusByte & kGpibRequestsService) != 0;
    report(address, poll.statusByte);
  } else {
    log_->debug("the poll of instrument {} failed: {}", toString(address), poll.reason);
  }
  if (!round_.empty()) return requested_();  // requests come between two polls
  pause_ = isFound_ ? milliseconds(0) : std::clamp(pause_ * 2, kFirstPause, kLongestPause);
  noPollsBefore_ = Deadline::after(pause_);
}

void ServiceSubscriptions::report(GpibAddress address, std::uint8_t statusByte) {
  if ((statusByte & kGpibRequestsService) == 0) return;
  const std::lock_guard lock(mutex_);
  for (auto& subscription : subscriptions_)
    if (subscription.address == address) send(subscription, statusByte);
}

void ServiceSubscriptions::send(Subscription& subscription, std::uint8_t statusByte) {
  auto message = server_.allocReplyMessage<OutOfBand>(subscription.request);
  *message = {.cmd = gpib::cmdSubscribe,
              .address = subscription.address.number(),
              .extra = subscription.lost,
              .value = statusByte};
  if (server_.reply(std::move(message)) == ReplyResult::sent) subscription.lost = 0;
  else if (subscription.lost < std::numeric_limits<std::int32_t>::max()) ++subscription.lost;
}

}  // namespace mpf
