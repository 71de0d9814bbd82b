// SPDX-License-Identifier: MIT
#include "server/programs/gpib_server/gpib_server.h"

#include <algorithm>
#include <utility>

#include <mpf/gpib_commands.h>

#include "server/programs/hardware/other_types.h"

namespace mpf {
namespace {

// NOLINTNEXTLINE(google-build-using-namespace): most constants of <mpf/gpib_commands.h>
using namespace gpib;

std::vector<std::uint8_t> bytesOf(const std::string& text) { return {text.begin(), text.end()}; }

}  // namespace

GpibServer::GpibServer(MessageServer& server, GpibBus& bus, const GpibLimits& limits,
                       const ServerLog& log)
    : server_(server),
      bus_(bus),
      limits_(limits),
      log_(log),
      subscriptions_(server, bus, log, limits.pollTimeout, [this] { queue_.wake(); }) {
  server.on<Char8Array>([this](Char8ArrayMessage&& message) { handle(std::move(message)); });
  answerOtherTypes<Char8Array>(server, [this](MessageType type) {
    log_->debug("a request of type {}: status -1", toString(type));
  });
}

GpibServer::~GpibServer() {
  stop();
  receiving_.join();
  serving_.join();
}

void GpibServer::start(const std::function<void()>& failed) {
  receiving_.start(log_, [this] { receive(); }, failed);
  serving_.start(log_, [this] { serveBus(); }, failed);
}

void GpibServer::stop() {
  ends_.store(true, std::memory_order_relaxed);
  server_.interrupt();
  queue_.wake();
}

// ---- the server's thread

void GpibServer::receive() {
  while (!ends_.load(std::memory_order_relaxed)) {
    static_cast<void>(server_.waitForMessage(queue_.nextExpiry()));
    // After each request: clients that send many must not delay the others' timeouts.
    for (bool mayHaveMore = true; mayHaveMore && !ends_.load(std::memory_order_relaxed);) {
      mayHaveMore = server_.handleOne();
      forgetGone();
      endExpired();
    }
  }
  queue_.removeGone([](const GpibWork&) { return true; });  // they end as `refused` now
}

void GpibServer::handle(Char8ArrayMessage&& message) {
  auto request = GpibRequest::from(message, limits_);
  const auto client = server_.clientOf(message);
  if (client == 0) return;  // the client has disconnected
  if (!request.problem.empty()) {
    log_->warn("an invalid request: {}", request.problem);
    return reply(message, {gpibStatusInvalid, request.extra, bytesOf(request.problem), {}});
  }
  switch (request.command) {
    case cmdLeaseHolder:
      return reply(message, holder());
    case cmdSubscribe:
      return subscriptions_.add(std::move(message), request.addresses.front());
    case cmdUnsubscribe:
      subscriptions_.remove(client, request.addresses.empty()
                                        ? std::nullopt
                                        : std::optional(request.addresses.front()));
      return reply(message, {gpibStatusOK, request.extra, {}, {}});
    default:
      return queue_.push({std::move(message), client, std::move(request)});
  }
}

GpibReply GpibServer::holder() const {
  const auto holder = bus_.leaseHolder();
  if (!holder) return {};
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(holder->until.left());
  return {gpibStatusOK, static_cast<std::int32_t>(left.count()), bytesOf(holder->name), {}};
}

void GpibServer::reply(const Char8ArrayMessage& request, const GpibReply& reply) {
  auto message = server_.allocReplyMessage<Char8Array>(request, reply.value.size());
  *message = *request;
  message.setSize(reply.value.size());
  std::ranges::copy(reply.value, message.value().begin());
  message->status = reply.status;
  message->extra = reply.extra;
  static_cast<void>(server_.reply(std::move(message)));
}

void GpibServer::endExpired() {
  for (const auto& work : queue_.takeExpired()) reply(work.message, notBegun(work));
}

// What a request gets whose timeout has passed before its turn.
GpibReply GpibServer::notBegun(const GpibWork& work) const {
  const bool isRead = work.request.limits.maxBytes != 0;
  const auto extra = isRead ? 0 : work.request.extra;
  const auto holder = bus_.leaseHolder();
  if (holder && holder->user != work.client)
    return {gpibStatusLeased, extra, bytesOf(holder->name), {}};
  return {gpibStatusTimeout, extra, {}, {}};
}

void GpibServer::forgetGone() {
  {
    const std::lock_guard lock(mutex_);
    if (lease_ && server_.clientOf(lease_->request) != lease_->client) {
      bus_.release(lease_->client);
      lease_.reset();
      queue_.wake();
    }
  }
  subscriptions_.removeGone();
  queue_.removeGone(
      [this](const GpibWork& work) { return server_.clientOf(work.message) != work.client; });
}

// ---- the bus thread

void GpibServer::serveBus() {
  while (!ends_.load(std::memory_order_relaxed)) {
    const auto holder = bus_.leaseHolder();
    const auto user = holder ? holder->user : 0;
    subscriptions_.pollInstruments(user);
    if (auto work = queue_.tryTake(user)) {
      perform(std::move(*work));
    } else {
      queue_.wait(holder ? holder->until : Deadline::never());
    }
  }
}

void GpibServer::perform(GpibWork&& work) {
  auto result = performGpib(bus_, work.request, work.client);
  if (result.status == gpibStatusLeased) result = notBegun(work);
  reply(work.message, result);
  note(work, result);
  const auto command = work.request.command;
  if (command == cmdSerialPoll && !result.value.empty())
    subscriptions_.report(work.request.addresses.front(), result.value.front());
  if (command == cmdLease && result.status == gpibStatusOK)
    keepLease(std::move(work.message), work.client);
}

void GpibServer::keepLease(Char8ArrayMessage&& request, GpibUser client) {
  const std::lock_guard lock(mutex_);
  if (server_.isClientConnected(request)) {
    lease_ = {std::move(request), client};
  } else {
    bus_.release(client);  // forgetGone() has looked before
  }
}

// One line when the requests to an instrument begin to fail, and one when they succeed again.
void GpibServer::note(const GpibWork& work, const GpibReply& reply) {
  log_->debug("{}: status {}{}{}", work.request.text(), reply.status,
              reply.reason.empty() ? "" : ": ", reply.reason);
  if (reply.status == gpibStatusError) {
    server_.countAlarm();
    log_->warn("{}: {}", work.request.text(), reply.reason);
    return;
  }
  if (work.request.addresses.size() != 1) return;
  const auto& address = work.request.addresses.front();
  if (reply.status == gpibStatusOK || reply.status == gpibStatusOverflow) {
    if (failing_.erase(address) != 0)
      log_->info("requests to instrument {} succeed again", toString(address));
  } else if (failing_.insert(address).second) {
    log_->warn("requests to instrument {} fail: {}: {}", toString(address), work.request.text(),
               reply.reason);
  }
}

}  // namespace mpf
