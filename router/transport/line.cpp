// SPDX-License-Identifier: MIT
#include "router/transport/line.h"

#include <algorithm>
#include <fmt/format.h>
#include <utility>

#include <mpf/clock.h>

#include "router/transport/kj_text.h"
#include "router/transport/tls.h"
#include "shm/histogram.h"

namespace mpf::router {
namespace {

constexpr std::int64_t kTurnNs = 2'000'000;  // longest turn with the items of one peer

constexpr std::size_t kEnoughBytes = std::size_t{256} << 10;  // when poll() stops reading
// After so many polls without bytes (about 1 ms), poll() leaves the reading to a task. Otherwise it
// would delay other lines by a system call in each turn.
constexpr std::uint32_t kIdlePolls = 256;

constexpr const char* kTlsOnPlain =
    "the peer uses TLS, this side of the connection plain TCP: set the same security, \"tls\" or "
    "\"plain\", at both routers";

}  // namespace

Line::Line(kj::Own<kj::AsyncIoStream> stream, Security security, const Loop& loop,
           const Limits& limits, PeerRecord& record, Events events)
    : stream_(kj::mv(stream)),
      direct_(security == Security::plain ? DirectIo(*stream_) : DirectIo()),
      loop_(loop),
      limits_(limits),
      record_(record),
      events_(std::move(events)),
      reader_(kLeastFrameBytes),
      writer_(*this, *stream_, direct_, loop.writes, {limits.queueSize, record},
              events_.onUnsendable),
      keepAlive_(limits) {}

void Line::endPolling() noexcept {
  isPolled_ = false;
  if (loop_.polling != nullptr) loop_.polling->remove(*this);
}

// ---- start and end

kj::Promise<LineEnd> Line::run(FillItem greeting) {
  auto paf = kj::newPromiseAndFulfiller<LineEnd>();
  ended_ = kj::mv(paf.fulfiller);
  keepAlive_.start(Clock::nowNs());
  send(std::move(greeting));
  reads_ = watched([this] { return readLoop(); });
  liveness_ = watched([this] { return livenessLoop(); });
  return kj::mv(paf.promise);
}

// Any exception from a loop ends the line. A loop may also throw before it returns its promise,
// when the peer has closed the connection already.
kj::Promise<void> Line::watched(kj::Function<kj::Promise<void>()> loop) {
  return kj::evalNow([&] { return loop(); }).eagerlyEvaluate([this](kj::Exception&& error) {
    onReadFailure(error);
  });
}

void Line::onReadFailure(const kj::Exception& error) {
  finish({farewell_.empty() ? tlsProblem(error) : farewell_});
}

void Line::end(FarewellCode code, const std::string& why) {
  if (isEnding()) return;
  farewell_ = displayText(why);
  send([code, text = farewell_](wire::Item::Builder item) {
    auto farewell = item.initFarewell();
    farewell.setCode(code);
    farewell.setReason(text);
  });
  state_ = code == FarewellCode::SILENCE ? State::dropping : State::leaving;
  finishLater(farewell_);
}

void Line::finishLater(const std::string& why) {
  farewellTimer_ = loop_.timer.afterDelay(kFarewellTime)
                       .then([this, why] { finish({why}); })
                       .eagerlyEvaluate(nullptr);
}

void Line::finish(LineEnd end) {
  if (std::exchange(state_, State::finished) == State::finished) return;
  ended_->fulfill(std::move(end));
}

// ---- reading

// Leaves the next bytes to poll() while the line is polled. A read that has begun is never given
// up for this: it may have taken bytes from the stream already.
kj::Promise<void> Line::readLoop() {
  pollReads_ = isPolled_;
  if (pollReads_) return kj::READY_NOW;
  auto room = reader_.room();
  return stream_->tryRead(room.begin(), 1, room.size()).then([this](std::size_t bytes) {
    return proceed(received(bytes));
  });
}

void Line::poll() {
  if (!std::exchange(pollReads_, false)) return;
  KJ_IF_MAYBE (error, kj::runCatchingExceptions([this] { readDirectly(); })) onReadFailure(*error);
}

void Line::setPolled(bool isPolled) {
  isPolled_ = isPolled;
  if (!isPolled && std::exchange(pollReads_, false))
    reads_ = watched([this] { return readLoop(); });
}

void Line::readDirectly() {
  auto next = Next::read;
  std::size_t total = 0;
  while (next == Next::read && total < kEnoughBytes) {
    const auto room = reader_.room();
    const auto bytes = direct_.tryRead(room);
    total += bytes.value_or(0);
    if (bytes) next = received(*bytes);
    if (bytes != room.size()) break;
  }
  idlePolls_ = total == 0 ? idlePolls_ + 1 : 0;
  if (idlePolls_ >= kIdlePolls) endPolling();
  pollReads_ = next == Next::read && isPolled_;
  if (!pollReads_) reads_ = watched([this, next] { return proceed(next); });
}

// Returns what follows.
Line::Next Line::received(std::size_t bytes) {
  if (bytes == 0) {
    finish({farewell_.empty() ? closedReason() : farewell_});
    return Next::nothing;
  }
  if (discardsInput()) return Next::discard;
  count(record_->bytesReceived, bytes);
  keepAlive_.bytesReceived(bytes);
  reader_.filled(bytes);
  return handleReceived();
}

kj::Promise<void> Line::proceed(Next next) {
  if (next == Next::nothing) return kj::READY_NOW;
  if (next == Next::discard) return readAndDiscard();
  return whenAnswersAreSent().then(
      [this, next] { return next == Next::read ? readLoop() : proceed(handleReceived()); });
}

std::string Line::closedReason() const {
  if (hasGreeted()) return "the peer closed the connection";
  return "the peer closed the connection before its greeting: is it a router, and does it have the "
         "same security, \"tls\" or \"plain\"?";
}

// After our own farewell, only the end of the peer's data matters. With unread data, the kernel
// would reset the connection, and the peer might not receive the farewell.
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

// Handles the received items, for at most kTurnNs. The next turn follows when the peer has read
// enough of the answers.
Line::Next Line::handleReceived() {
  if (discardsInput()) return Next::discard;
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
  if (discardsInput()) return Next::discard;
  if (std::exchange(hasHandled_, false) && events_.onHandled) events_.onHandled();
  return isDone ? Next::read : Next::handle;
}

kj::Promise<void> Line::whenAnswersAreSent() {
  // Let the other tasks of the event loop run, and the answers be written.
  if (!queue().hasMaxAnswers()) return loop_.timer.afterDelay(0 * kj::NANOSECONDS);
  auto paf = kj::newPromiseAndFulfiller<void>();
  resumeReading_ = kj::mv(paf.fulfiller);
  return kj::mv(paf.promise);
}

// Returns false when items are left for the next turn.
bool Line::handleSome() {
  constexpr capnp::uint kItemsPerCheck = 16;  // between two looks at the clock
  const auto endNs = Clock::nowNs() + kTurnNs;
  if (items_) keepAlive_.received(Clock::nowNs());  // the peer is not late: its items were waiting
  origin_ = SendQueue::Origin::answer;
  KJ_DEFER(origin_ = SendQueue::Origin::own);
  NoticeBatch notices;
  capnp::uint handled = 0;  // items and frames, since the last look
  while (!queue().hasMaxAnswers()) {
    if (handled >= kItemsPerCheck) {
      if (Clock::nowNs() >= endNs) return false;
      handled = 0;
    }
    if (!items_ && !tryNextFrame()) return true;
    if (!items_ || nextItem_ == items_->size()) {
      items_.reset();
      ++handled;
      continue;
    }
    hasHandled_ = true;
    const auto plain = handlePlain(notices);
    const auto at = std::exchange(nextItem_, nextItem_ + std::max(plain, 1u));
    handled += std::max(plain, 1u);
    if (plain == 0) {
      notices.give();  // this item may take long
      handle((*items_)[at]);
      notices.give();
    }
    if (discardsInput()) return true;
  }
  return false;
}

bool Line::tryNextFrame() {
  if (!hasGreeted() && reader_.beginsAsTls())
    throw ProtocolError(FarewellCode::PROTOCOL, kTlsOnPlain);
  auto* frame = reader_.tryNext();
  if (frame == nullptr) return false;
  keepAlive_.frameReceived(Clock::nowNs());
  count(record_->framesReceived);
  noteTraffic();
  items_ = frame->getRoot<wire::Frame>().getItems();
  nextItem_ = 0;
  plain_.reset();
  if (frame->getSegment(1) == nullptr) plain_ = PlainFrame::tryOpen(frame->getSegment(0));
  return true;
}

// Returns how many items it has handled: 0 if the next one is not plain.
capnp::uint Line::handlePlain(NoticeBatch& notices) {
  if (!plain_ || state_ != State::open || !events_.onPlain) return 0;
  const auto noteClient = [&](std::uint32_t client) {
    // The next messages may cause no notice.
    if (std::exchange(plainClient_, client) != client) notices.give();
  };
  if (nextItem_ + 1 < items_->size() && events_.onPlainItems) {
    const auto items = plain_->readItems(nextItem_, items_->size(), plainMessages_);
    if (const auto handled = static_cast<capnp::uint>(plainMessages_.size()); handled > 1) {
      noteClient(items.client);
      count(record_->messagesReceived, handled);
      events_.onPlainItems(items);
      return handled;
    }
  }
  if (!plain_->tryRead(nextItem_, plainItem_)) return 0;
  noteClient(plainItem_.client);
  count(record_->messagesReceived);
  events_.onPlain(plainItem_);
  return 1;
}

void Line::handle(wire::Item::Reader item) {
  if (state_ == State::broken && !item.isFarewell()) return;
  if (state_ == State::greeting) {
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
      return events_.onItem(item);
    default:
      return events_.onItem(item);
  }
}

void Line::takeGreeting(wire::Greeting::Reader greeting) {
  peer_ = PeerGreeting::read(greeting);
  state_ = State::open;
  reader_.setMaxFrameBytes(maxFrameBytes(limits_));
  limits_.bufferBytes = static_cast<std::uint32_t>(
      std::min<std::uint64_t>(limits_.bufferBytes, peer_.maxFrameBytes / 2));
  keepAlive_.greetingReceived();
  record_.setPeer(peer_.router, peer_.program);
  ping();
  events_.onGreeting(peer_);
  events_.onRoom();
}

// ---- writing

void Line::send(Carried carried) {
  if (isEnding()) queue().reject(std::move(carried));
  else writer_.push(std::move(carried));
}

void Line::send(const PlainOutgoing& item) {
  if (isEnding()) queue().reject(item);
  else writer_.push(item);
}

void Line::send(const PlainItems& items) {
  if (!isEnding()) return writer_.push(items);
  for (std::size_t at = 0; at < items.run.size(); ++at) queue().reject(items[at]);
}

SendQueue::FrameLimits Line::onFrames() {
  noteTraffic();
  return {.items = hasGreeted() ? SIZE_MAX : 1,  // the greeting, alone
          .bytes = limits_.bufferBytes,
          .messageBytes = maxMessageBytes()};
}

// Not for each part of a long frame, because a router that polls for these reads many small ones.
void Line::noteTraffic() {
  if (loop_.polling != nullptr) {
    loop_.polling->noteTraffic();
    if (direct_) loop_.polling->addLine(*this);
  }
  if (events_.onTraffic) events_.onTraffic();
}

void Line::onWritten() {
  if (resumeReading_ && !queue().hasMaxAnswers()) std::exchange(resumeReading_, nullptr)->fulfill();
  if (!isEnding()) events_.onRoom();
}

void Line::onIdle() {
  if (state_ == State::leaving) stream_->shutdownWrite();
  else if (state_ == State::dropping) finish({farewell_});
}

// Keeps reading for a while: the peer may have sent a farewell with the reason.
void Line::onWriteFailure(const kj::Exception& error) {
  const auto why = tlsProblem(error);
  if (isEnding()) return finish({farewell_.empty() ? why : farewell_});
  state_ = State::broken;
  finishLater(why);
}

// ---- signs of life

kj::Promise<void> Line::livenessLoop() {
  const auto afterNs = keepAlive_.beginCheck(Clock::nowNs());
  return loop_.timer.afterDelay(afterNs * kj::NANOSECONDS).then([this]() -> kj::Promise<void> {
    if (const auto why = keepAlive_.check(Clock::nowNs()); !why.empty()) {
      if (!queue().isBeingWritten()) end(FarewellCode::SILENCE, why);
      else finish({why});  // the peer would not read a farewell, either
      return kj::NEVER_DONE;
    }
    if (state_ == State::open) ping();
    return livenessLoop();
  });
}

void Line::ping() {
  keepAlive_.pingSent(Clock::nowNs());
  send([](wire::Item::Builder item) {
    item.initPing().setStamp(static_cast<std::uint64_t>(Clock::nowNs()));
  });
}

void Line::onPing(std::uint64_t stamp) {
  send([stamp](wire::Item::Builder pong) { pong.initPong().setStamp(stamp); });
  const auto nowNs = Clock::nowNs();
  if (keepAlive_.shouldMeasure(nowNs)) ping();
  if (keepAlive_.tryPostpone(nowNs)) liveness_ = watched([this] { return livenessLoop(); });
}

}  // namespace mpf::router
