// SPDX-License-Identifier: MIT
#include "router/transport/line.h"

#include <capnp/serialize-async.h>
#include <fmt/format.h>

#include "router/transport/kj_text.h"
#include "router/transport/tls.h"

namespace mpf::router {
namespace {

// This many bytes of a frame that is still arriving are a sign of life.
constexpr std::size_t kProgressBytes = std::size_t{64} << 10;
// While the peer's pings make pings of this side unnecessary, this side sends a ping at this
// interval all the same, to measure the round trip.
constexpr std::int64_t kMeasureEveryNs = 10'000'000'000;
constexpr std::int64_t kTurnNs = 2'000'000;  // longest turn with the items of one peer
// The frame size that each side must accept, and the largest size of a greeting.
constexpr std::uint64_t kLeastFrame = std::uint64_t{64} << 10;

constexpr const char* kTlsOnPlain =
    "the peer uses TLS, this side of the connection plain TCP: set the same security, \"tls\" or "
    "\"plain\", at both routers";

std::uint64_t maxFrameBytes(const Limits& limits) {
  constexpr std::uint64_t kFields = std::uint64_t{1} << 20;  // for everything but the bodies
  return std::max<std::uint64_t>(limits.maxMessageBytes, limits.bufferBytes) + kFields;
}

}  // namespace

Line::Line(kj::Own<kj::AsyncIoStream> stream, kj::Timer& timer, const Limits& limits,
           PeerRecord& record, Owner& owner)
    : stream_(kj::mv(stream)),
      timer_(timer),
      limits_(limits),
      record_(record),
      owner_(owner),
      reader_(kLeastFrame),
      checkAfterNs_(halfDeadNs()) {
  record_->queueSize.store(limits.queueSize, std::memory_order_relaxed);
}

Line::~Line() = default;

void Line::describe(wire::Greeting::Builder greeting, const Limits& limits) {
  greeting.setProtocolMajor(wire::PROTOCOL_MAJOR);
  greeting.setProtocolMinor(wire::PROTOCOL_MINOR);
  greeting.setMaxFrameBytes(maxFrameBytes(limits));
  greeting.setMaxMessageBytes(limits.maxMessageBytes);
  greeting.setDeadTimeMs(static_cast<std::uint32_t>(limits.deadTime.count()));
}

kj::Promise<LineEnd> Line::run(Note greeting) {
  auto paf = kj::newPromiseAndFulfiller<LineEnd>();
  ended_ = kj::mv(paf.fulfiller);
  lastReceiveNs_ = Clock::nowNs();
  greetingDueNs_ = lastReceiveNs_ + std::chrono::nanoseconds(limits_.handshakeTime).count();
  send([greeting = std::move(greeting)](wire::Item::Builder item) { greeting(item); });
  reads_ = watched(&Line::readLoop);
  liveness_ = watched(&Line::livenessLoop);
  return kj::mv(paf.promise);
}

// Any exception from a loop ends the line. A loop may also throw before it returns its promise,
// when the peer has closed the connection already.
kj::Promise<void> Line::watched(kj::Promise<void> (Line::*loop)()) {
  return kj::evalNow([&] { return (this->*loop)(); })
      .eagerlyEvaluate([this](kj::Exception&& error) {
        finish({farewell_.empty() ? tlsProblem(error) : farewell_});
      });
}

void Line::finish(LineEnd end) {
  if (std::exchange(phase_, Phase::finished) == Phase::finished) return;
  ended_->fulfill(std::move(end));
}

std::uint64_t Line::maxMessageBytes() const noexcept {
  constexpr std::uint64_t kFrameOverhead = 1024;
  return std::min(
      {limits_.maxMessageBytes, peer_.maxMessageBytes, peer_.maxFrameBytes - kFrameOverhead});
}

void Line::end(FarewellCode code, const std::string& why) {
  if (isEnding()) return;
  const auto text = displayText(why);
  send([code, text](wire::Item::Builder item) {
    auto farewell = item.initFarewell();
    farewell.setCode(code);
    farewell.setReason(text);
  });
  phase_ = Phase::leaving;
  farewell_ = text;
  drains_ = code != FarewellCode::SILENCE;
  farewellTimer_ = timer_.afterDelay(kFarewellTime)
                       .then([this, text] { finish({text}); })
                       .eagerlyEvaluate(nullptr);
}

// ---- in

kj::Promise<void> Line::readLoop() {
  auto room = reader_.room();
  return stream_->tryRead(room.begin(), 1, room.size())
      .then([this, most = room.size()](std::size_t bytes) -> kj::Promise<void> {
        if (bytes == 0) {
          finish({farewell_.empty() ? closedReason() : farewell_});
          return kj::READY_NOW;
        }
        if (discardsInput()) return readAndDiscard();
        count(record_->bytesReceived, bytes);
        partialBytes_ += bytes;
        hasMore_ = bytes == most;
        reader_.filled(bytes);
        return handleReceived();
      });
}

std::string Line::closedReason() const {
  if (greeted_) return "the peer closed the connection";
  return "the peer closed the connection before its greeting: is it a router, and does it have the "
         "same security, \"tls\" or \"plain\"?";
}

// After our own farewell, only the end of the peer's data matters.
kj::Promise<void> Line::readAndDiscard() {
  constexpr std::size_t kReadBytes = std::size_t{64} << 10;
  auto room = kj::heapArray<kj::byte>(kReadBytes);
  auto read = stream_->tryRead(room.begin(), 1, room.size());
  return read.attach(kj::mv(room)).then([this](std::size_t bytes) -> kj::Promise<void> {
    if (bytes != 0) return readAndDiscard();
    finish({farewell_});
    return kj::READY_NOW;
  });
}

// Handles the received items, in turns of at most kTurnNs. Continues with the next turn when the
// peer has read enough of the answers.
kj::Promise<void> Line::handleReceived() {
  if (discardsInput()) return readAndDiscard();
  bool isDone = false;
  try {
    isDone = handleSome();
  } catch (const ProtocolError& error) {
    end(error.code(), error.what());
  } catch (const kj::Exception& error) {  // an invalid pointer in the frame
    end(FarewellCode::PROTOCOL, fmt::format("the peer sent a frame that cannot be read: {}",
                                            toStd(error.getDescription())));
  } catch (const std::exception& error) {
    // Not caused by the peer: no memory or no descriptor is left.
    end(FarewellCode::STOPPING, error.what());
  }
  if (discardsInput()) return readAndDiscard();
  if (isDone && !hasMore_) return readLoop();
  return whenAnswersAreSent().then(
      [this, isDone] { return isDone ? readLoop() : handleReceived(); });
}

kj::Promise<void> Line::whenAnswersAreSent() {
  // Let the other tasks of the event loop run.
  if (answers_ < kMaxNotes) return timer_.afterDelay(0 * kj::NANOSECONDS);
  auto paf = kj::newPromiseAndFulfiller<void>();
  resumeReading_ = kj::mv(paf.fulfiller);
  return kj::mv(paf.promise);
}

// Returns false when items are left for the next turn.
bool Line::handleSome() {
  constexpr unsigned kItemsPerCheck = 16;  // between two looks at the clock
  const auto endNs = Clock::nowNs() + kTurnNs;
  if (items_) lastReceiveNs_ = Clock::nowNs();  // the peer is not late: its items were waiting
  handling_ = true;
  KJ_DEFER(handling_ = false);
  for (unsigned handled = 1; answers_ < kMaxNotes; ++handled) {
    if (handled % kItemsPerCheck == 0 && Clock::nowNs() >= endNs) return false;
    if (!items_ && !tryNextFrame()) return true;
    if (!items_ || nextItem_ == items_->size()) {
      items_.reset();
      continue;
    }
    handle((*items_)[nextItem_++]);
    if (discardsInput()) return true;
  }
  return false;
}

bool Line::tryNextFrame() {
  if (!greeted_ && reader_.beginsAsTls()) throw ProtocolError(FarewellCode::PROTOCOL, kTlsOnPlain);
  auto* frame = reader_.tryNext();
  if (frame == nullptr) return false;
  lastReceiveNs_ = Clock::nowNs();
  partialBytes_ = 0;
  count(record_->framesReceived);
  items_ = frame->getRoot<wire::Frame>().getItems();
  nextItem_ = 0;
  return true;
}

void Line::handle(wire::Item::Reader item) {
  if (phase_ == Phase::broken && !item.isFarewell()) return;
  if (!greeted_) {
    if (item.isGreeting()) return takeGreeting(item.getGreeting());
    if (!item.isFarewell())
      throw ProtocolError(FarewellCode::PROTOCOL, "the first item is not a greeting");
  }
  switch (item.which()) {
    case wire::Item::NONE:
    case wire::Item::GREETING:
      return;
    case wire::Item::FAREWELL:
      return finish({fmt::format("the peer ended the connection: {}",
                                 displayText(item.getFarewell().getReason()))});
    case wire::Item::PING:
      return onPing(item.getPing().getStamp());
    case wire::Item::PONG: {
      const auto trip = static_cast<std::uint64_t>(Clock::nowNs()) - item.getPong().getStamp();
      return record_->roundTripNs.store(trip, std::memory_order_relaxed);
    }
    case wire::Item::REQUEST:
    case wire::Item::REPLY:
      count(record_->messagesReceived);
      return owner_.onItem(item);
    default:
      return owner_.onItem(item);
  }
}

void Line::takeGreeting(wire::Greeting::Reader greeting) {
  if (greeting.getProtocolMajor() != wire::PROTOCOL_MAJOR) {
    throw ProtocolError(FarewellCode::VERSION,
                        fmt::format("the peer has protocol {}.{}, this router {}.x: install the "
                                    "same release of mpf-router on both hosts",
                                    greeting.getProtocolMajor(), greeting.getProtocolMinor(),
                                    wire::PROTOCOL_MAJOR));
  }
  peer_.router = displayText(greeting.getRouter());
  peer_.program = displayText(greeting.getProgram());
  peer_.maxFrameBytes = greeting.getMaxFrameBytes();
  peer_.maxMessageBytes = greeting.getMaxMessageBytes();
  peer_.maxClients = greeting.getMaxClients();
  if (peer_.maxFrameBytes < kLeastFrame) {
    throw ProtocolError(FarewellCode::PROTOCOL,
                        fmt::format("maxFrameBytes is {}; at least {} are required",
                                    peer_.maxFrameBytes, kLeastFrame));
  }
  reader_.setMaxFrameBytes(maxFrameBytes(limits_));
  limits_.bufferBytes = static_cast<std::uint32_t>(
      std::min<std::uint64_t>(limits_.bufferBytes, peer_.maxFrameBytes / 2));
  greeted_ = true;
  record_.setPeer(peer_.router, peer_.program);
  ping();
  owner_.onGreeting(peer_);
  owner_.onRoom();
}

// ---- signs of life

// Time until the next check: at most checkAfterNs_, and no later than the peer's deadline.
std::int64_t Line::nextCheckNs(std::int64_t nowNs) {
  auto dueNs = lastReceiveNs_ + std::chrono::nanoseconds(limits_.deadTime).count();
  if (!greeted_) dueNs = std::min(dueNs, greetingDueNs_);
  return std::clamp<std::int64_t>(dueNs - nowNs, 1'000'000,
                                  std::exchange(checkAfterNs_, halfDeadNs()));
}

// Which deadline the peer has missed; an empty text when it has missed no deadline.
std::string Line::silenceReason(std::int64_t nowNs) const {
  if (nowNs - lastReceiveNs_ >= std::chrono::nanoseconds(limits_.deadTime).count()) {
    return fmt::format("received nothing from the peer for {} ms (dead-time)",
                       (nowNs - lastReceiveNs_) / 1'000'000);
  }
  if (greeted_ || nowNs < greetingDueNs_) return {};
  return fmt::format("the peer sent no greeting within {} ms (handshake-time)",
                     limits_.handshakeTime.count());
}

kj::Promise<void> Line::livenessLoop() {
  const auto checkNs = nextCheckNs(Clock::nowNs());
  return timer_.afterDelay(checkNs * kj::NANOSECONDS)
      .then([this, dueNs = Clock::nowNs() + checkNs]() -> kj::Promise<void> {
        const auto nowNs = Clock::nowNs();
        // Time during which this process did not run does not count against the peer.
        const auto lateNs = std::max<std::int64_t>(nowNs - dueNs, 0);
        lastReceiveNs_ = std::min(lastReceiveNs_ + lateNs, nowNs);
        greetingDueNs_ += lateNs;
        if (partialBytes_ >= kProgressBytes) {
          lastReceiveNs_ = nowNs;
          partialBytes_ = 0;
        }
        // Only the second check in a row counts: if this process did not run for a while, data of
        // the peer may not have been read yet.
        if (const auto text = silenceReason(nowNs); text.empty()) {
          overdue_ = false;
        } else if (std::exchange(overdue_, true)) {
          if (writing_) finish({text});  // the peer would not read a farewell, either
          else end(FarewellCode::SILENCE, text);
          return kj::NEVER_DONE;
        }
        if (greeted_ && !isEnding()) ping();
        return livenessLoop();
      });
}

void Line::ping() {
  lastPingNs_ = Clock::nowNs();
  send([](wire::Item::Builder item) {
    item.initPing().setStamp(static_cast<std::uint64_t>(Clock::nowNs()));
  });
}

// A ping of the peer is a sign of life, so this side postpones its own ping. On an idle connection
// only one side sends pings, which halves the number of frames. The delay is random, because
// otherwise both sides might send their pings at the same time again and again.
void Line::onPing(std::uint64_t stamp) {
  send([stamp](wire::Item::Builder pong) { pong.initPong().setStamp(stamp); });
  const auto nowNs = Clock::nowNs();
  if (nowNs - lastPingNs_ >= kMeasureEveryNs) ping();
  const auto quarter = halfDeadNs() / 4;
  if (nowNs - lastPostponeNs_ < quarter) return;
  lastPostponeNs_ = nowNs;
  checkAfterNs_ = halfDeadNs() + quarter +
                  static_cast<std::int64_t>(random_() % static_cast<std::uint64_t>(quarter + 1));
  liveness_ = watched(&Line::livenessLoop);
}

}  // namespace mpf::router
