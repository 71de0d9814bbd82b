// SPDX-License-Identifier: MIT
#include "server/programs/digital_io_server/input_server.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "server/programs/hardware/bits_request.h"
#include "server/programs/hardware/other_types.h"

namespace mpf {
namespace {

constexpr std::size_t kMaxQueuedChanges = 1000;
constexpr std::chrono::milliseconds kSendAgainAfter{20};

}  // namespace

DigitalInputServer::DigitalInputServer(const Backplane& backplane, const std::string& name,
                                       const ServerOptions& options, DigitalIo& io,
                                       const ServerLog& log, std::function<void()> failed)
    : io_(io), log_(log), server_(backplane, name, options), faults_(server_, log) {
  server_.on<Int32>([this](Int32Message&& request) { handle(std::move(request)); });
  answerOtherTypes<Int32>(server_, [this](MessageType type) {
    log_->debug("inputs: a request of type {}: status -1", toString(type));
  });
  logShortages(server_, *log_);
  subscription_ = io.subscribe([this](const DigitalIoChange& change) { enqueue(change); });
  state_ = io.look();
  thread_.start(log, [this] { run(); }, std::move(failed));
}

DigitalInputServer::~DigitalInputServer() {
  ends_.store(true, std::memory_order_relaxed);
  server_.interrupt();
  thread_.join();
  subscription_ = {};
}

void DigitalInputServer::run() {
  while (!ends_.load(std::memory_order_relaxed)) {
    static_cast<void>(server_.waitForMessage(sendAgainAt_));
    deliver();
    // deliver() after each request: a client that sends many requests must not delay monitors.
    while (!ends_.load(std::memory_order_relaxed) && server_.handleOne()) deliver();
    forgetGone();
  }
}

void DigitalInputServer::handle(Int32Message&& request) {
  const auto asked = *request;  // a copy: the client can write to the request while we work
  if (asked.cmd == digital::cmdStartMonitor) return start(std::move(request));
  auto fields = asked;
  fields.status = 0;
  if (asked.cmd == digital::cmdStopMonitor) {
    fields.status = stop(request);
  } else if (isReadRequest(asked.cmd)) {
    read(fields);
  } else if (asked.cmd == digital::cmdSetEdges) {
    const auto status = io_.trySetEdges(static_cast<std::uint32_t>(asked.address),
                                        static_cast<std::uint32_t>(asked.value));
    if (isFault(status)) faults_.fault(toString(status));
    fields.status = status == DigitalIoStatus::success ? 0 : -1;
  } else {
    log_->debug("inputs: unknown cmd {}: status -1", asked.cmd);
    fields.status = -1;
  }
  answer(request, fields);
}

void DigitalInputServer::answer(const Int32Message& request, const Int32& fields) {
  auto reply = server_.allocReplyMessage<Int32>(request);
  *reply = fields;
  static_cast<void>(server_.reply(std::move(reply)));
}

void DigitalInputServer::read(Int32& fields) {
  const auto inputs = io_.tryReadInputs();
  if (!inputs || !tryAnswerBits(fields, fields.cmd, *inputs)) fields.status = -1;
  if (inputs) return faults_.success();
  faults_.fault(toString(DigitalIoStatus::gone));
}

// The monitor first gets the state after the last change that was delivered to the others: a change
// may be reported between the look and deliver().
void DigitalInputServer::start(Int32Message&& request) {
  const auto client = server_.clientOf(request);
  if (client == 0) return;  // the client has disconnected
  io_.look();
  deliver();
  if (const auto former = find(client); former != monitors_.end()) monitors_.erase(former);
  const auto mask = static_cast<std::uint32_t>(request->address);
  Monitor monitor{std::move(request), client, mask == 0 ? ~0U : mask};
  if (send(monitor, monitor.mask & io_.kind().inputs)) monitors_.push_back(std::move(monitor));
  followCount();
}

std::int32_t DigitalInputServer::stop(const Int32Message& request) {
  deliver();
  const auto monitor = find(server_.clientOf(request));
  if (monitor == monitors_.end()) return -1;
  monitors_.erase(monitor);
  followCount();
  return 0;
}

// Runs on a thread of the driver, or on a thread that calls the driver.
void DigitalInputServer::enqueue(const DigitalIoChange& change) {
  {
    const std::lock_guard lock(mutex_);
    using Kind = DigitalIoChange::Kind;
    if (changes_.size() >= kMaxQueuedChanges && change.kind == Kind::inputs &&
        changes_.back().kind == Kind::inputs) {
      changes_.back().inputs = change.inputs;
      changes_.back().changed |= change.changed;
    } else {
      changes_.push_back(change);
    }
  }
  server_.interrupt();
}

void DigitalInputServer::deliver() {
  sendAgain();
  std::deque<DigitalIoChange> all;
  {
    const std::lock_guard lock(mutex_);
    if (changes_.empty()) return;
    all = std::exchange(changes_, {});
  }
  for (const auto& change : all) {
    note(change);
    using Kind = DigitalIoChange::Kind;
    const bool isForAll = change.kind == Kind::gone || change.kind == Kind::back;
    if (isForAll) state_.isThere = change.kind == Kind::back;
    state_.inputs = change.inputs;
    std::erase_if(monitors_, [&](Monitor& monitor) {
      const auto changed = change.changed & monitor.mask;
      return (isForAll || changed != 0) && !send(monitor, changed);
    });
  }
  followCount();
}

void DigitalInputServer::note(const DigitalIoChange& change) {
  switch (change.kind) {
    case DigitalIoChange::Kind::inputs:
      return;
    case DigitalIoChange::Kind::back:
      log_->warn(
          "the module works again, or was reset: its settings and outputs have been restored");
      break;
    case DigitalIoChange::Kind::gone:
      log_->warn("the module does not respond");
      break;
    case DigitalIoChange::Kind::lostInterrupt:
      log_->warn("interrupts do not arrive: changes are found by polling the inputs");
      break;
    case DigitalIoChange::Kind::storm:
      log_->warn(
          "an interrupt storm: interrupts are disabled for a while, and the inputs are polled");
      break;
  }
  server_.countAlarm();
}

bool DigitalInputServer::send(Monitor& monitor, std::uint32_t changed) {
  if (monitor.unsent) changed |= static_cast<std::uint32_t>(monitor.unsent->address);
  return trySend(monitor, {.cmd = digital::cmdStartMonitor,
                           .status = state_.isThere ? 0 : -1,
                           .address = static_cast<std::int32_t>(changed),
                           .value = static_cast<std::int32_t>(state_.inputs)});
}

bool DigitalInputServer::trySend(Monitor& monitor, const Int32& fields) {
  auto message = server_.allocReplyMessage<Int32>(monitor.request);
  *message = fields;
  const auto result = server_.reply(std::move(message));
  if (result == ReplyResult::sent) {
    monitor.unsent.reset();
  } else if (result != ReplyResult::clientGone) {
    if (!monitor.unsent)
      log_->warn("a client does not receive its messages: changes are merged until it does ({})",
                 toString(result));
    monitor.unsent = fields;
    sendAgainAt_ = std::min(sendAgainAt_, Deadline::after(kSendAgainAfter));
  }
  return result != ReplyResult::clientGone;
}

void DigitalInputServer::sendAgain() {
  if (!sendAgainAt_.hasPassed()) return;
  sendAgainAt_ = Deadline::never();
  std::erase_if(monitors_, [this](Monitor& monitor) {
    return monitor.unsent && !trySend(monitor, Int32(*monitor.unsent));
  });
  followCount();
}

std::vector<DigitalInputServer::Monitor>::iterator DigitalInputServer::find(std::uint64_t client) {
  return std::find_if(monitors_.begin(), monitors_.end(),
                      [&](const Monitor& monitor) { return monitor.client == client; });
}

void DigitalInputServer::forgetGone() {
  std::erase_if(monitors_, [&](const Monitor& monitor) {
    return server_.clientOf(monitor.request) != monitor.client;
  });
  followCount();
}

void DigitalInputServer::followCount() {
  const auto now = monitors_.size();
  if (count_.exchange(now, std::memory_order_relaxed) != now)
    log_->info("{} clients monitor the inputs", now);
}

}  // namespace mpf
