// SPDX-License-Identifier: MIT
#include "router/transport/line.h"

#include <capnp/serialize-async.h>
#include <fmt/format.h>

#include "router/transport/kj_text.h"
#include "router/transport/tls.h"

namespace mpf::router {
namespace {

// so much of a long frame is a sign of life
constexpr std::size_t kProgressBytes = std::size_t{64} << 10;
// the round trip, where the peer's pings make ours needless
constexpr std::int64_t kMeasureEveryNs = 10'000'000'000;
constexpr std::int64_t kTurnNs = 2'000'000;  // with one peer's items, while others wait
// what each side must read, and the longest greeting
constexpr std::uint64_t kLeastFrame = std::uint64_t{64} << 10;

constexpr const char* kTlsOnPlain =
    "the peer uses TLS, this side of the connection plain TCP: set the same security, \"tls\" or "
    "\"plain\", at both routers";

std::uint64_t maxFrameBytes(const Limits& limits) {
  constexpr std::uint64_t kFields = std::uint64_t{1} << 20;  // around bodies
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
      lookAfterNs_(halfDeadNs()) {
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
  heardNs_ = Clock::nowNs();
  greetBeforeNs_ = heardNs_ + std::chrono::nanoseconds(limits_.handshakeTime).count();
  send([greeting = std::move(greeting)](wire::Item::Builder item) { greeting(item); });
  reads_ = watched(&Line::readLoop);
  life_ = watched(&Line::aliveLoop);
  return kj::mv(paf.promise);
}

// Whatever stops a loop ends the line: a peer that is gone by now may stop it at once.
kj::Promise<void> Line::watched(kj::Promise<void> (Line::*loop)()) {
  return kj::evalNow([&] { return (this->*loop)(); })
      .eagerlyEvaluate([this](kj::Exception&& error) {
        finish({farewell_.empty() ? tlsTrouble(error) : farewell_});
      });
}

void Line::finish(LineEnd end) {
  if (std::exchange(phase_, Phase::finished) == Phase::finished) return;
  ended_->fulfill(std::move(end));
}

std::uint64_t Line::maxMessageBytes() const noexcept {
  constexpr std::uint64_t kAround = 1024;
  return std::min({limits_.maxMessageBytes, peer_.maxMessageBytes, peer_.maxFrameBytes - kAround});
}

void Line::end(FarewellCode code, const std::string& why) {
  if (isEnding()) return;
  const auto text = forPeople(why);
  send([code, text](wire::Item::Builder item) {
    auto farewell = item.initFarewell();
    farewell.setCode(code);
    farewell.setReason(text);
  });
  phase_ = Phase::leaving;
  farewell_ = text;
  drains_ = code != FarewellCode::SILENCE;
  lastMoment_ = timer_.afterDelay(kLastMoment)
                    .then([this, text] { finish({text}); })
                    .eagerlyEvaluate(nullptr);
}

// ---- in

kj::Promise<void> Line::readLoop() {
  auto room = reader_.room();
  return stream_->tryRead(room.begin(), 1, room.size())
      .then([this, most = room.size()](std::size_t bytes) -> kj::Promise<void> {
        if (bytes == 0) {
          finish({farewell_.empty() ? closed() : farewell_});
          return kj::READY_NOW;
        }
        if (isDeaf()) return readAndDiscard();
        count(record_->bytesReceived, bytes);
        heardBytes_ += bytes;
        hasMore_ = bytes == most;
        reader_.filled(bytes);
        return readOn();
      });
}

std::string Line::closed() const {
  if (greeted_) return "the peer closed the connection";
  return "the peer closed the connection before its greeting: is it a router, and does it have the "
         "same security, \"tls\" or \"plain\"?";
}

// What comes behind our own farewell matters no more, but for its end.
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

// Handles what has come: in turns, of a peer that sends more than a turn takes, and while it reads
// what it gets.
kj::Promise<void> Line::readOn() {
  if (isDeaf()) return readAndDiscard();
  bool isThrough = false;
  try {
    isThrough = handleSome();
  } catch (const ProtocolError& error) {
    end(error.code(), error.what());
  } catch (const kj::Exception& error) {  // a pointer that leads nowhere
    end(FarewellCode::PROTOCOL, fmt::format("the peer sent a frame that cannot be read: {}",
                                            toStd(error.getDescription())));
  } catch (const std::exception& error) {  // ours, for lack of memory or descriptors
    end(FarewellCode::STOPPING, error.what());
  }
  if (isDeaf()) return readAndDiscard();
  if (isThrough && !hasMore_) return readLoop();
  return whenAnswersHaveGone().then(
      [this, isThrough] { return isThrough ? readLoop() : readOn(); });
}

kj::Promise<void> Line::whenAnswersHaveGone() {
  // others have their turn
  if (answers_ < kManyNotes) return timer_.afterDelay(0 * kj::NANOSECONDS);
  auto paf = kj::newPromiseAndFulfiller<void>();
  readOn_ = kj::mv(paf.fulfiller);
  return kj::mv(paf.promise);
}

// False: there is more, for the next turn.
bool Line::handleSome() {
  constexpr unsigned kLooks = 16;  // items between looks at the clock
  const auto endNs = Clock::nowNs() + kTurnNs;
  if (items_) heardNs_ = Clock::nowNs();  // it is we who are late
  handling_ = true;
  KJ_DEFER(handling_ = false);
  for (unsigned handled = 1; answers_ < kManyNotes; ++handled) {
    if (handled % kLooks == 0 && Clock::nowNs() >= endNs) return false;
    if (!items_ && !tryNextFrame()) return true;
    if (!items_ || nextItem_ == items_->size()) {
      items_.reset();
      continue;
    }
    handle((*items_)[nextItem_++]);
    if (isDeaf()) return true;
  }
  return false;
}

bool Line::tryNextFrame() {
  if (!greeted_ && reader_.beginsAsTls()) throw ProtocolError(FarewellCode::PROTOCOL, kTlsOnPlain);
  auto* frame = reader_.tryNext();
  if (frame == nullptr) return false;
  heardNs_ = Clock::nowNs();
  heardBytes_ = 0;
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
      return finish({fmt::format("the peer says: {}", forPeople(item.getFarewell().getReason()))});
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
  peer_.router = forPeople(greeting.getRouter());
  peer_.program = forPeople(greeting.getProgram());
  peer_.maxFrameBytes = greeting.getMaxFrameBytes();
  peer_.maxMessageBytes = greeting.getMaxMessageBytes();
  peer_.maxClients = greeting.getMaxClients();
  if (peer_.maxFrameBytes < kLeastFrame) {
    throw ProtocolError(
        FarewellCode::PROTOCOL,
        fmt::format("maxFrameBytes {}: at least {} are needed", peer_.maxFrameBytes, kLeastFrame));
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

// Time until the next look: now and then, and when the peer is overdue.
std::int64_t Line::nextLookNs(std::int64_t nowNs) {
  auto dueNs = heardNs_ + std::chrono::nanoseconds(limits_.deadTime).count();
  if (!greeted_) dueNs = std::min(dueNs, greetBeforeNs_);
  return std::clamp<std::int64_t>(dueNs - nowNs, 1'000'000,
                                  std::exchange(lookAfterNs_, halfDeadNs()));
}

// What the peer did not do in time; empty: it is in time.
std::string Line::silence(std::int64_t nowNs) const {
  if (nowNs - heardNs_ >= std::chrono::nanoseconds(limits_.deadTime).count()) {
    return fmt::format("nothing was heard of the peer for {} ms (dead-time)",
                       (nowNs - heardNs_) / 1'000'000);
  }
  if (greeted_ || nowNs < greetBeforeNs_) return {};
  return fmt::format("the peer sent no greeting within {} ms (handshake-time)",
                     limits_.handshakeTime.count());
}

kj::Promise<void> Line::aliveLoop() {
  const auto lookNs = nextLookNs(Clock::nowNs());
  return timer_.afterDelay(lookNs * kj::NANOSECONDS)
      .then([this, dueNs = Clock::nowNs() + lookNs]() -> kj::Promise<void> {
        const auto nowNs = Clock::nowNs();
    // while we do not run, the peer need not, either
        const auto lateNs = std::max<std::int64_t>(nowNs - dueNs, 0);
        heardNs_ = std::min(heardNs_ + lateNs, nowNs);
        greetBeforeNs_ += lateNs;
        if (heardBytes_ >= kProgressBytes) {
          heardNs_ = nowNs;
          heardBytes_ = 0;
        }
        // Twice: if we did not run for long, what it said meanwhile has yet to be read.
        if (const auto text = silence(nowNs); text.empty()) {
          overdue_ = false;
        } else if (std::exchange(overdue_, true)) {
          if (writing_) finish({text});  // it does not take a farewell, either
          else end(FarewellCode::SILENCE, text);
          return kj::NEVER_DONE;
        }
        if (greeted_ && !isEnding()) ping();
        return aliveLoop();
      });
}

void Line::ping() {
  pingedNs_ = Clock::nowNs();
  send([](wire::Item::Builder item) {
    item.initPing().setStamp(static_cast<std::uint64_t>(Clock::nowNs()));
  });
}

// While the peer asks for signs of life we hear some, too, and put off asking ourselves: at rest
// one of both does it, and half of the frames go. By how long is left to chance, or both might do
// so at once again and again.
void Line::onPing(std::uint64_t stamp) {
  send([stamp](wire::Item::Builder pong) { pong.initPong().setStamp(stamp); });
  const auto nowNs = Clock::nowNs();
  if (nowNs - pingedNs_ >= kMeasureEveryNs) ping();
  const auto quarter = halfDeadNs() / 4;
  if (nowNs - putOffNs_ < quarter) return;
  putOffNs_ = nowNs;
  lookAfterNs_ = halfDeadNs() + quarter +
                 static_cast<std::int64_t>(random_() % static_cast<std::uint64_t>(quarter + 1));
  life_ = watched(&Line::aliveLoop);
}

}  // namespace mpf::router
