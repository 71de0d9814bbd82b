// SPDX-License-Identifier: MIT
// Line: one connection to another router. It reads the peer's frames and hands on their items,
// writes the frames of its SendQueue, and ends the connection with a farewell.
//
//   stream ─► FrameReader ─► items ─► Events::onItem, plain items ─► Events::onPlain, onPlainItems
//   send() ─► SendQueue ─► frames of all that waits, up to Limits::bufferBytes ─► stream
//
// States:
//   greeting ─ the peer's greeting ─► open
//
//   greeting, open ─ end() ──────────────► leaving   the farewell is queued or sent; waits until
//                  │                                 the peer has also closed the connection
//                  ├ the peer is silent ─► dropping  the farewell is queued; ends once it is sent
//                  └ a write fails ──────► broken    still reads: the peer may have sent a farewell
//
//   any ─ the peer closes, its farewell, kFarewellTime is over ─► finished
//
// When a peer does not read the answers to its items, its items are not read, either. A long frame
// is handled in turns with the other tasks of the event loop.
//
// While the router polls a line of plain TCP, the line is read by poll(), and no task waits for its
// bytes.
//
// Threads  that of the event loop.
// Crash    the line ends when a peer has crashed, is stopped or unreachable for Limits::deadTime.
// Trust    a protocol error ends the line with a farewell that names it.
#pragma once

#include <functional>
#include <kj/async-io.h>
#include <kj/function.h>
#include <optional>
#include <string>
#include <vector>

#include <mpf/clock.h>

#include "router/config/router_config.h"
#include "router/polling.h"
#include "router/protocol_error.h"
#include "router/statistics.h"
#include "router/transport/direct_io.h"
#include "router/transport/frame_reader.h"
#include "router/transport/frame_writer.h"
#include "router/transport/keep_alive.h"
#include "router/transport/peer_greeting.h"
#include "router/transport/plain_item.h"
#include "router/transport/send_queue.h"
#include "shm/notice_batch.h"

namespace mpf::router {

// Why a line ended, as text for logs and tools.
struct LineEnd {
  std::string text;
};

class Line final : public Polled, private FrameWriter::Owner {
 public:
  using FillItem = SendQueue::FillItem;

  // What the line reports to the object that made it.
  struct Events {
    // A valid greeting of the peer has arrived.
    std::function<void(const PeerGreeting& greeting)> onGreeting;
    // A later item that is not a ping, pong or farewell has arrived. May throw ProtocolError.
    std::function<void(wire::Item::Reader item)> onItem;
    // As onItem, for requests and replies that are plain; empty: they go to onItem, too. The
    // message of `item` may be moved away.
    std::function<void(PlainItem& item)> onPlain{};
    // The same for several items together, at least 2, which are valid until it returns; empty:
    // each goes to onPlain.
    std::function<void(const PlainItems& items)> onPlainItems{};
    // hasRoom() may have become true.
    std::function<void()> onRoom;
    // A frame has arrived, or frames are sent; Polling was notified already. May be empty.
    std::function<void()> onTraffic{};
    // Items were handled: all that have arrived, or those of one turn. May be empty.
    std::function<void()> onHandled{};
    // A message cannot be sent. If it is a request, it has not been handled.
    SendQueue::OnUnsendable onUnsendable;
  };

  // What a line needs of the event loop.
  struct Loop {
    kj::Timer& timer;
    DueWrites& writes;
    Polling* polling = nullptr;  // nullptr: the router never polls
  };

  // What `loop` refers to, and `record`, outlive this object.
  Line(kj::Own<kj::AsyncIoStream> stream, Security security, const Loop& loop, const Limits& limits,
       PeerRecord& record, Events events);
  ~Line() { endPolling(); }
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;

  // Sends the greeting, and runs until the line ends. Call it once.
  [[nodiscard]] kj::Promise<LineEnd> run(FillItem greeting);
  // Ends the line with a farewell, behind the items that wait. The line is finished when the peer
  // has also closed the connection, at the latest after kFarewellTime.
  void end(FarewellCode code, const std::string& why);

  // Queues an item that is not a message, even without room. Answers to items of the peer are
  // bounded: when too many wait, no more is read from the peer.
  void send(FillItem fill) {
    if (!isEnding()) writer_.push(std::move(fill), origin_);
  }
  // Queues a message, even without room. A caller that can wait checks hasRoom() first.
  void send(Carried carried);
  void send(const PlainOutgoing& item);
  void send(const PlainItems& items);
  [[nodiscard]] bool hasRoom() const noexcept { return room() != 0; }
  // For how many messages there is room.
  [[nodiscard]] std::size_t room() const noexcept {
    return state_ == State::open ? queue().room() : 0;
  }
  [[nodiscard]] const PeerGreeting& peer() const noexcept { return peer_; }
  [[nodiscard]] bool hasGreeted() const noexcept { return peer_.hasArrived(); }
  // The limits of the configuration when the line started. Only bufferBytes may be smaller: a frame
  // must fit into what the peer accepts.
  [[nodiscard]] const Limits& limits() const noexcept { return limits_; }
  // The largest body that may be sent.
  [[nodiscard]] std::uint64_t maxMessageBytes() const noexcept {
    return peer_.maxMessageBytesWith(limits_);
  }

  // For Polling.
  void poll() override;
  void setPolled(bool isPolled) override;

  // After the end of the line: returns the requests that were never written to the stream.
  [[nodiscard]] std::vector<Carried> takeUnsentRequests() { return queue().takeUnsentRequests(); }

 private:
  enum class State { greeting, open, leaving, dropping, broken, finished };
  // What follows a read: another one, the rest of its items, a read whose bytes are ignored.
  enum class Next { read, handle, discard, nothing };

  [[nodiscard]] bool isEnding() const noexcept {
    return state_ != State::greeting && state_ != State::open;
  }
  // Whether items of the peer are no longer handled.
  [[nodiscard]] bool discardsInput() const noexcept {
    return isEnding() && state_ != State::broken;
  }
  kj::Promise<void> watched(kj::Function<kj::Promise<void>()> loop);
  void finish(LineEnd end);
  void finishLater(const std::string& why);

  kj::Promise<void> readLoop();
  kj::Promise<void> readAndDiscard();
  void readDirectly();
  void endPolling() noexcept;
  Next received(std::size_t bytes);
  Next handleReceived();
  kj::Promise<void> proceed(Next next);
  kj::Promise<void> whenAnswersAreSent();
  bool handleSome();
  bool tryNextFrame();
  capnp::uint handlePlain(NoticeBatch& notices);
  void handle(wire::Item::Reader item);
  void takeGreeting(wire::Greeting::Reader greeting);
  [[nodiscard]] std::string closedReason() const;

  [[nodiscard]] SendQueue& queue() noexcept { return writer_.queue(); }
  [[nodiscard]] const SendQueue& queue() const noexcept { return writer_.queue(); }
  SendQueue::FrameLimits onFrames() override;
  // While reading is suspended, it is the only sign of life.
  void onPart() override {
    if (resumeReading_) keepAlive_.received(Clock::nowNs());
  }
  void onWritten() override;
  void onIdle() override;
  void noteTraffic();
  void onReadFailure(const kj::Exception& error);
  void onWriteFailure(const kj::Exception& error) override;

  kj::Promise<void> livenessLoop();
  void ping();
  void onPing(std::uint64_t stamp);

  kj::Own<kj::AsyncIoStream> stream_;
  DirectIo direct_;
  Loop loop_;
  Limits limits_;
  PeerRecord& record_;
  Events events_;
  State state_ = State::greeting;
  bool isPolled_ = false;
  std::uint32_t idlePolls_ = 0;  // since poll() has read bytes
  bool pollReads_ = false;  // poll(), not a task, reads the next bytes
  PeerGreeting peer_;
  FrameReader reader_;
  std::optional<capnp::List<wire::Item>::Reader> items_;  // of the frame that is being handled
  capnp::uint nextItem_ = 0;
  std::optional<PlainFrame> plain_;  // the same frame
  PlainItem plainItem_;
  MessageRun plainMessages_;
  std::uint32_t plainClient_ = 0;  // of the last plain item
  bool hasHandled_ = false;  // an item, since the last onHandled()
  FrameWriter writer_;
  // Notes that are sent while items of the peer are handled are answers.
  SendQueue::Origin origin_ = SendQueue::Origin::own;
  KeepAlive keepAlive_;
  std::string farewell_;  // the text of our farewell
  kj::Own<kj::PromiseFulfiller<LineEnd>> ended_;
  kj::Own<kj::PromiseFulfiller<void>> resumeReading_;  // nullptr: reading is not suspended
  kj::Promise<void> reads_ = nullptr;
  kj::Promise<void> liveness_ = nullptr;
  kj::Promise<void> farewellTimer_ = nullptr;
};

}  // namespace mpf::router
