// SPDX-License-Identifier: MIT
#include "server/programs/sniff/sniff_server.h"

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>

#include "server/programs/hardware/other_types.h"

namespace mpf {
namespace {

// The thread never spins: listeners need no low latency, and the line needs the processor. About
// 250 messages may wait for each listener, with bodies of at most 16 MB.
ServerOptions sniffOptions(ServerOptions options) {
  options.queueSize = 128;
  options.maxPoolBytes = 16ULL << 20;
  options.waitMode = WaitMode::block;
  return options;
}

// The part of a count that fits a field.
std::int32_t clamped(std::uint64_t count) noexcept {
  return static_cast<std::int32_t>(std::min<std::uint64_t>(count, INT32_MAX));
}

}  // namespace

SniffServer::SniffServer(const Backplane& backplane, const std::string& server,
                         const ServerOptions& like, SniffSource source, const ServerLog& log,
                         const SniffBatching& batching)
    : log_(log),
      source_(std::move(source)),
      queue_(batching),
      server_(backplane, server + std::string(serial::sniffSuffix), sniffOptions(like)) {
  server_.on<Int32>([this](Int32Message&& request) { handle(std::move(request)); });
  answerOtherTypes<Int32>(server_, [this](MessageType type) {
    log_->debug("listeners: a request of type {}: status -1", toString(type));
  });
}

void SniffServer::start(std::function<void()> failed) {
  thread_.start(log_, [this] { run(); }, std::move(failed));
}

SniffServer::~SniffServer() {
  ends_.store(true, std::memory_order_relaxed);
  server_.interrupt();
  thread_.join();
}

void SniffServer::run() {
  while (!ends_.load(std::memory_order_relaxed)) {
    static_cast<void>(server_.waitForMessage(queue_.dueAt()));
    // After each request: a client that sends many must not delay the listeners.
    for (bool mayHaveMore = true; mayHaveMore && !ends_.load(std::memory_order_relaxed);) {
      mayHaveMore = server_.handleOne();
      if (queue_.dueAt().hasPassed()) deliver();
    }
    forgetGone();
  }
}

void SniffServer::handle(Int32Message&& request) {
  switch (request->cmd) {
    case serial::cmdSniffStart:
      return listen(std::move(request));
    case serial::cmdSniffStop:
      return leave(request);
    default:
      return answer(request, serial::sniffStatusError);
  }
}

void SniffServer::listen(Int32Message&& request) {
  deliver();  // sends earlier bytes to the other listeners only
  const auto client = server_.clientOf(request);
  if (client == 0) return;  // the client has disconnected
  if (const auto former = find(client); former != listeners_.end()) listeners_.erase(former);
  if (!tap_) {
    tap_ = source_([this](std::span<const SniffBytes> records) {
      if (queue_.push(records)) server_.interrupt();
    });
  }
  listeners_.push_back({std::move(request), client, 0});
  followCount();
  answer(listeners_.back().request, serial::sniffStatusOK);
}

void SniffServer::leave(const Int32Message& request) {
  deliver();
  const auto listener = find(server_.clientOf(request));
  if (listener == listeners_.end()) return answer(request, serial::sniffStatusNotListening);
  const auto lost = listener->lost;
  listeners_.erase(listener);
  followCount();
  answer(request, serial::sniffStatusOK, lost);
}

void SniffServer::answer(const Int32Message& request, std::int32_t status, std::uint64_t lost) {
  auto reply = server_.allocReplyMessage<Int32>(request);
  *reply = {.cmd = request->cmd, .status = status, .address = clamped(lost)};
  static_cast<void>(server_.reply(std::move(reply)));
}

std::vector<SniffServer::Listener>::iterator SniffServer::find(std::uint64_t client) {
  return std::find_if(listeners_.begin(), listeners_.end(),
                      [&](const Listener& listener) { return listener.client == client; });
}

void SniffServer::forgetGone() {
  std::erase_if(listeners_, [&](const Listener& listener) {
    return server_.clientOf(listener.request) != listener.client;
  });
  followCount();
}

void SniffServer::followCount() {
  const auto before = count_.load(std::memory_order_relaxed);
  const auto now = listeners_.size();
  if (now != before) log_->info("{} clients listen to every byte", now);
  if (now == 0 && tap_) {
    tap_.reset();
    queue_.take(records_);
  }
  count_.store(now, std::memory_order_relaxed);
}

void SniffServer::deliver() {
  const auto lost = queue_.take(records_);
  if (records_.empty()) return;
  for (auto& listener : listeners_) {
    send(listener);
    listener.lost += lost;  // they were lost after these bytes
  }
}

void SniffServer::send(Listener& listener) {
  auto message =
      server_.allocReplyMessage<Char8Array>(listener.request, records_.size() * sizeof(SniffBytes));
  message->extra = static_cast<std::int32_t>(records_.size());
  message->address = clamped(listener.lost);
  auto at = message.value().begin();
  for (const auto& record : records_) at = std::copy(record.begin(), record.end(), at);
  const auto reported = static_cast<std::uint64_t>(message->address);
  if (server_.reply(std::move(message)) == ReplyResult::sent) {
    listener.lost -= reported;
  } else {
    listener.lost += records_.size();
  }
}

}  // namespace mpf
