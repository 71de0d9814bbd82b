// SPDX-License-Identifier: MIT
#include "server/server_core.h"

#include <algorithm>
#include <cstring>
#include <fmt/format.h>
#include <stdexcept>

#include "base/step.h"
#include "base/thread_number.h"
#include "shm/histogram.h"
#include "shm/rights_text.h"
#include "shm/segment_name.h"

namespace mpf {
namespace {

// One receive() looks at more links than there are, so that it reaches each of them.
constexpr std::uint32_t kMaxLooks = 2 * layout::kMaxLinks;

int checkedQueueSize(int size) {
  if (size < 1 || size > static_cast<int>(LinkGeometry::kMaxQueueSize)) {
    throw std::invalid_argument(
        fmt::format("queue size {}: use 1 to {}", size, LinkGeometry::kMaxQueueSize));
  }
  return size;
}

std::string windowName(const Backplane& backplane, const std::string& name, std::int32_t location) {
  SegmentName::checkServer(name);
  return SegmentName::serverWindow(backplane.name(), location, name);
}

}  // namespace

ServerCore::ServerCore(const Backplane& backplane, const std::string& name,
                       const ServerOptions& options, std::uint32_t hops)
    : name_(name),
      location_(options.location),
      endpoint_(
          backplane, layout::SegmentKind::serverWindow,
          windowName(backplane, name, options.location), checkServerRights(options.rights),
          options.waitMode,
          [&](layout::SegmentHeader& header) {
            const auto queueSize = static_cast<std::uint32_t>(checkedQueueSize(options.queueSize));
            header.location = options.location;
            name.copy(header.name.data(), header.name.size() - 1);
            header.queueSize = queueSize;
            header.maxMessageBytes = options.maxMessageBytes;
            header.maxPoolBytes = options.maxPoolBytes;
            header.hops = hops;
            auto* control = reinterpret_cast<std::byte*>(&header) + layout::kWindowControlOffset;
            reinterpret_cast<layout::WindowControl*>(control)->queueSize.store(
                queueSize, std::memory_order_relaxed);
          }),
      connections_(endpoint_),
      acceptor_(endpoint_, connections_),
      replyCounts_(endpoint_.control()),
      replies_(replyCounts_, options.stampsReplies),
      publisher_(backplane.name(), endpoint_.window(), replyCounts_, options),
      keeper_(RequestKeeper::make(replies_)),
      progress_(endpoint_.control()) {}

ServerCore::~ServerCore() {
  handlers_.clear();  // refuses the requests that they keep
  keeper_.leave();
  if (endpoint_.forkGuard().isInherited()) return;
  MPF_STEP(server_leaving);
  Connections::drain(closeAll());
}

Connections::Channels ServerCore::closeAll() noexcept {
  // Before the links, so that no client makes another link meanwhile.
  // PAIR(window-closed): the messages that were sent before.
  endpoint_.control().state.store(layout::WindowState::closed, std::memory_order_release);
  connections_.onClient(nullptr);
  return connections_.closeAll();
}

void ServerCore::setQueueSize(int size) {
  endpoint_.forkGuard().check("MessageServer");
  endpoint_.control().queueSize.store(static_cast<std::uint32_t>(checkedQueueSize(size)),
                                      std::memory_order_relaxed);
}

bool ServerCore::wait(Deadline deadline) {
  endpoint_.forkGuard().check("MessageServer");
  endHandling();
  // A handler that waits leaves the interrupt to the run() that has called it.
  const auto stopped = [this] {
    return stop_.load(std::memory_order_relaxed) &&
           (handlers_.isCalling() || stop_.exchange(false, std::memory_order_relaxed));
  };
  if (stopped()) return false;
  const bool hasEvent = endpoint_.wait(deadline);
  if (endpoint_.slept()) progress_.noteSleep();
  return hasEvent && !stopped();
}

ServerCore::Run::Run(ServerCore& core) : core_(core) {
  core.endpoint_.forkGuard().check("MessageServer");
  std::uint64_t runner = 0;
  const auto self = threadNumber();
  isOutermost_ = core.runner_.compare_exchange_strong(runner, self, std::memory_order_relaxed);
  if (!isOutermost_ && runner != self)
    throw std::logic_error(fmt::format(
        "MessageServer::run(): another thread runs the server \"{}\" already", core.name()));
}

ServerCore::Run::~Run() {
  if (isOutermost_) core_.runner_.store(0, std::memory_order_relaxed);
}

void ServerCore::interrupt() noexcept {
  stop_.store(true, std::memory_order_relaxed);
  endpoint_.interrupt();
}

int ServerCore::descriptor() {
  endpoint_.forkGuard().check("MessageServer");
  hasDescriptor_ = true;
  static_cast<void>(endpoint_.arm());
  return endpoint_.descriptor();
}

void ServerCore::handleControlEvents() {
  acceptor_.acceptAll();
  if (endpoint_.takeLocalEvent() && endpoint_.takePeerDeath()) connections_.closeDead();
}

inline void ServerCore::noteTaken(Connection& connection, std::uint32_t requestId, Times times,
                                  MessageType type, std::int32_t cmd) noexcept {
  if (times.sentTick != 0) {
    noteTimes(connection, requestId, times.sentTick);
  } else if (progress_.isDue()) {
    progress_.note(Clock::nowNs());
  }
  progress_.begin(type, cmd);
  takeBeforeNs_ = times.deadlineNs;
}

// Whether there is a request. If not, closes the connection if its client has closed the link.
bool ServerCore::hasRequest(Connection& connection) noexcept {
  if (connection.channel->hasMessage()) return true;
  connections_.closeIfClientClosed(connection);
  return false;
}

[[gnu::always_inline]] inline bool ServerCore::tryBegin(Connection& connection,
                                                        Envelope& envelope) noexcept {
  if (!connection.channel->tryBegin(envelope)) {
    closeForProtocolError(connection);
    return false;
  }
  auto& control = endpoint_.control();
  count(control.received);
  if (!connection.tryNoteRequest(envelope.requestId)) {
    closeForProtocolError(connection);
    return false;
  }
  MPF_STEP(request_taken);
  if (envelope.timeNs == 0 || !hasPassed(envelope.timeNs)) return true;
  count(control.expired);
  connection.channel->discard(envelope.body());
  replies_.sendFate(connection, envelope.marks(), Fate::expired);
  return false;
}

[[gnu::always_inline]] inline Message ServerCore::finishShort(Connection& connection,
                                                              const Envelope& envelope) noexcept {
  auto message = connection.channel->finishShort(
      envelope, connection.routeOf(envelope.requestId, &keeper_), 0);
  std::int32_t cmd = 0;
  std::memcpy(&cmd, message.body().data() + layout::kCmdOffset, sizeof cmd);
  noteTaken(connection, envelope.requestId, {envelope.sentTick, envelope.timeNs}, message.getType(),
            cmd);
  return message;
}

// Returns an empty handle if the body cannot be read.
Message ServerCore::finishLong(Connection& connection, BodyFields fields, RequestMarks marks,
                               Times times) noexcept {
  const auto cmd = connection.channel->cmdOfLong(fields);
  MessageLink::Finish finish{};
  auto message = connection.channel->finishLong(
      fields,
      {connection.routeOf(marks.requestId, &keeper_), marks.clientType(), marks.clientExtra(), 0},
      finish);
  switch (finish) {
    case MessageLink::Finish::invalid:
      closeForProtocolError(connection);
      break;
    case MessageLink::Finish::unavailable:
      replyCounts_.refused();
      replies_.sendFate(connection, marks, Fate::refused);
      break;
    case MessageLink::Finish::message:
      noteTaken(connection, marks.requestId, times, message.getType(), cmd);
      break;
  }
  return message;
}

Message ServerCore::receive() {
  return receiveUnless([](Connection&) { return false; });
}

Message ServerCore::receiveOrHandleRun(bool& hasHandledRun) {
  return receiveUnless(
      [&](Connection& connection) { return hasHandledRun = tryHandleRun(connection); });
}

Message ServerCore::receiveOrTakeRun(MessageRun& run, std::uint64_t& client, std::size_t most) {
  client = 0;
  return receiveUnless([&](Connection& connection) {
    auto& ring = connection.channel->link().incoming();
    const auto type = static_cast<MessageType>(ring.nextType());
    if (most < 2 || !MessageRun::canHold(type) || !ring.hasSecond()) return false;
    const auto number = connection.client();  // tryTakeRun() may close the connection
    run.begin(type);
    if (!tryTakeRun(connection, run, most)) return false;
    client = number;
    return true;
  });
}

// Returns an empty handle when no request waits, or when `tryHandle(connection)` has handled one.
template <class TryHandle>
[[gnu::always_inline]] inline Message ServerCore::receiveUnless(const TryHandle& tryHandle) {
  endpoint_.forkGuard().check("MessageServer");
  // Limited, because faulty clients may set hints without end, and receive() must return.
  for (std::uint32_t looks = 0; looks < kMaxLooks; ++looks) {
    auto* link = endpoint_.nextPolled();
    const bool isPolled = link != nullptr;
    if (!isPolled) link = nextOther();
    if (link == nullptr) {
      if (hasDescriptor_) {
        if (!endpoint_.arm()) continue;
        progress_.noteSleep();  // the caller sleeps at the descriptor
      }
      endHandling();
      return {};
    }
    auto& connection = static_cast<Connection&>(link->user());
    if (!isPolled && !hasRequest(connection)) continue;
    if (tryHandle(connection)) return {};
    Envelope envelope;
    if (!tryBegin(connection, envelope)) continue;
    // The message is made in the memory of the caller.
    if (MessageLink::isShort(envelope.body())) return finishShort(connection, envelope);
    if (auto message = finishLong(connection, envelope.body(), envelope.marks(),
                                  {envelope.sentTick, envelope.timeNs}))
      return message;
  }
  endHandling();
  keepReadable();
  return {};
}

// Handles the next requests of a connection together, if there are several for such a handler.
// A single request is received as a message, which is faster.
[[gnu::always_inline]] inline bool ServerCore::tryHandleRun(Connection& connection) {
  auto& ring = connection.channel->link().incoming();
  const auto type = ring.nextType();  // read once: the client may change it
  const auto* const handle = handlers_.findForRun(type);
  return handle != nullptr && ring.hasSecond() &&
         tryHandleRun(connection, static_cast<MessageType>(type), *handle);
}

bool ServerCore::tryHandleRun(Connection& connection, MessageType type, const HandleRun& handle) {
  MessageRun run(type);
  if (!tryTakeRun(connection, run, MessageRun::kMost)) return false;
  if (run.size() == 0) return true;
  const auto generation = connection.generation;
  try {
    callHandler([&] { handle(run.values()); });
  } catch (...) {
    replies_.refuse(connection, generation, run, 0);
    throw;
  }
  replies_.sendRun(connection, generation, run);
  return true;
}

// Takes up to `most` requests without a deadline of the type of `run`. Returns false if there is
// none. If the id of a request is invalid, closes the connection, leaves the run empty, and returns
// true.
bool ServerCore::tryTakeRun(Connection& connection, MessageRun& run, std::size_t most) noexcept {
  auto& link = connection.channel->link();
  if (link.maxMessageBytes() < layout::kFirstSlotBodyBytes) return false;
  const auto accept = [&](const EnvelopeWords& words) {
    if (!run.accepts(words) || words.timeNs != 0) return false;
    run.add(words);
    return true;
  };
  link.incoming().takeRun(std::min(most, MessageRun::kMost), accept,
                          [&](std::size_t count, const auto& body) { run.add(count, body); });
  if (run.size() == 0) return false;
  endpoint_.countTurns(static_cast<std::uint32_t>(run.size() - 1));
  if (!tryNoteTaken(connection, run)) {
    run.begin(run.type());
    return true;
  }
  std::int32_t cmd = 0;
  std::memcpy(&cmd, run.values().data() + layout::kCmdOffset, sizeof cmd);
  progress_.begin(run.type(), cmd);
  return true;
}

// Returns false, and has closed the connection, if the id of a request is invalid. The service time
// of a run is that of the first request that says when it was sent.
bool ServerCore::tryNoteTaken(Connection& connection, const MessageRun& run) noexcept {
  count(endpoint_.control().received, run.size());
  std::size_t timed = run.size();
  for (std::size_t index = run.size(); index-- != 0;) {
    if (!connection.tryNoteRequest(run[index].requestId())) {
      closeForProtocolError(connection);
      return false;
    }
    if (run[index].sentTick() != 0) timed = index;
  }
  MPF_STEP(request_taken);
  takeBeforeNs_ = 0;
  if (timed != run.size()) {
    noteTimes(connection, run[timed].requestId(), run[timed].sentTick());
  } else if (progress_.isDue()) {
    progress_.note(Clock::nowNs());
  }
  return true;
}

// Handles control events and exceptions of client callbacks, then looks at the other links.
Link* ServerCore::nextOther() {
  replyCounts_.noteServerThread();
  if (endpoint_.hasControlEvents()) handleControlEvents();
  if (connections_.hasThrown()) throwNext();
  return endpoint_.nextOther();
}

void ServerCore::keepReadable() noexcept {
  if (hasDescriptor_) endpoint_.keepReadable();
}

void ServerCore::throwNext() {
  // More exceptions or requests may wait: the next wait() returns immediately.
  endpoint_.interrupt();
  connections_.throwNext();
}

void ServerCore::closeForProtocolError(Connection& connection) noexcept {
  count(endpoint_.control().protocolErrors);
  connections_.close(connection);
}

bool ServerCore::hasPassed(std::int64_t deadlineNs) noexcept {
  // PAIR(taken-before-clock): the client sees that the server counted the request as taken, or the
  // server sees that the deadline has passed.
  doorbell::fence();
  return Clock::nowNs() >= deadlineNs;
}

void ServerCore::noteTimes(Connection& connection, std::uint32_t requestId,
                           std::uint32_t sentTick) noexcept {
  const auto nowNs = Clock::nowNs();
  const auto waitedNs = Tick::nsSince(sentTick, nowNs);
  record(endpoint_.control().queueWaitNs, waitedNs);
  if (endpoint_.slept()) endpoint_.noteWake(waitedNs);
  progress_.note(nowNs);
  const BiasedLock::Guard lock(*connection.lock);
  connection.timedId = requestId;
  connection.timedFromNs = nowNs;
}

ServerCore::Counts ServerCore::counts() const {
  endpoint_.forkGuard().check("MessageServer");
  const auto& control = endpoint_.control();
  Counts counts{control.queueSize.load(std::memory_order_relaxed), 0,
                control.received.load(std::memory_order_relaxed), 0,
                control.sent.load(std::memory_order_relaxed) +
                    control.sentElsewhere.load(std::memory_order_relaxed)};
  for (const auto& connection : connections_.all()) {
    const BiasedLock::Guard lock(*connection->lock);
    if (!connection->channel) continue;
    const auto& link = connection->channel->link().control();
    const auto sent = link.clientSent.load(std::memory_order_relaxed);
    const auto taken = link.requests.taken.load(std::memory_order_relaxed);
    counts.inQueue += sent > taken ? sent - taken : 0;
    counts.queueFull += link.clientRefused.load(std::memory_order_relaxed);
  }
  return counts;
}

}  // namespace mpf
