// SPDX-License-Identifier: MIT
// Line: one connection to another router: receives and sends frames, queues items, checks signs of
// life, and ends the connection with a farewell.
//
//   send() ─► queue ─► a frame of all that waits, up to Limits::bufferBytes ─► stream
//   stream ─► frames ─► Owner::onItem
//
// While a frame is being written, items for the next one gather in the queue. A waiting message
// stays in the shared memory of its sender, and is converted when its frame is built. When a peer
// does not read the answers to its items, its items are not read, either. A long frame is handled
// in turns with the other tasks of the event loop.
//
// Threads  that of the event loop.
// Crash    the line ends when a peer has crashed, is stopped or unreachable for Limits::deadTime.
// Trust    a protocol error ends the line with a farewell that names it.
#pragma once

#include <algorithm>
#include <capnp/message.h>
#include <deque>
#include <functional>
#include <kj/async-io.h>
#include <memory>
#include <random>
#include <string>
#include <variant>

#include <mpf/clock.h>

#include "router/config/router_config.h"
#include "router/statistics.h"
#include "router/transport/frame_reader.h"
#include "schema/conversion.h"

namespace mpf::router {

// A message that is sent as an item of a frame.
struct Carried {
  bool isRequest = false;
  bool isFirst = false;  // of a reply: it ends the request
  std::uint32_t client = 0;
  std::uint32_t requestId = 0;
  Deadline takeBefore = Deadline::never();  // of a request
  Message message;
};

// The bytes that a reply takes from its client's window (router.capnp, Credit): those of its
// elements, and a fixed number for the rest.
inline constexpr std::uint32_t kWindowBytesBeside = 64;
[[nodiscard]] inline std::uint32_t windowBytesOf(const Message& reply) noexcept {
  return kWindowBytesBeside + reply.arrayLength() * layoutOf(reply.getType()).elementBytes;
}

// The largest size of a body without its elements. Limits on the wire count elements, those in
// shared memory count whole bodies.
inline constexpr std::uint64_t kMostBesideElements = [] {
  std::uint64_t most = 0;
  for (std::uint16_t type = 1; layoutOf(static_cast<MessageType>(type)).headerBytes != 0; ++type) {
    most = std::max<std::uint64_t>(most, layoutOf(static_cast<MessageType>(type)).headerBytes);
  }
  return most;
}();

// The fields of a peer's greeting.
struct PeerGreeting {
  std::string router;
  std::string program;
  std::uint64_t maxFrameBytes = 0;
  std::uint64_t maxMessageBytes = 0;
  std::uint32_t maxClients = 0;
};

// Why a line ended, as text for logs and tools.
struct LineEnd {
  std::string text;
};

class Line {
 public:
  using Note = std::function<void(wire::Item::Builder)>;

  class Owner {
   public:
    // A valid greeting of the peer has arrived.
    virtual void onGreeting(const PeerGreeting& greeting) = 0;
    // A later item that is not a ping, pong or farewell has arrived. May throw ProtocolError.
    virtual void onItem(wire::Item::Reader item) = 0;
    // hasRoom() may have become true.
    virtual void onRoom() = 0;
    // A message cannot be sent, for the reason `why`. If it is a request, it has not been handled.
    // `instead` is sent in its place; it is empty unless this function fills it.
    virtual void onUnsendable(const Carried& carried, const std::string& why,
                              wire::Item::Builder instead) = 0;

   protected:
    ~Owner() = default;
  };

  Line(kj::Own<kj::AsyncIoStream> stream, kj::Timer& timer, const Limits& limits,
       PeerRecord& record, Owner& owner);
  ~Line();
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;

  // Sends the greeting, and runs until the line ends. Call it once.
  [[nodiscard]] kj::Promise<LineEnd> run(Note greeting);
  // Ends the line with a farewell, behind the items that wait. The line is finished when the peer
  // has also closed the connection, at the latest after kFarewellTime.
  void end(FarewellCode code, const std::string& why);

  // Queues an item that is not a message, even without room. Answers to items of the peer are
  // bounded: when too many wait, no more is read from the peer.
  void send(Note note);
  // Queues a message, even without room. A caller that can wait checks hasRoom() first.
  void send(Carried carried);
  [[nodiscard]] bool hasRoom() const noexcept {
    return greeted_ && !isEnding() && waiting_ < limits_.queueSize && notes() < kMaxNotes;
  }
  [[nodiscard]] const PeerGreeting& peer() const noexcept { return peer_; }
  [[nodiscard]] bool hasGreeted() const noexcept { return greeted_; }
  // The limits of the configuration when the line started. Only bufferBytes may be smaller: a frame
  // must fit into what the peer accepts.
  [[nodiscard]] const Limits& limits() const noexcept { return limits_; }
  // The largest body that may be sent.
  [[nodiscard]] std::uint64_t maxMessageBytes() const noexcept;

  // After the end of the line: returns the requests that were never written to the stream.
  [[nodiscard]] std::vector<Carried> takeUnsentRequests();

  // Fills in the fields of a greeting that follow from the limits.
  static void describe(wire::Greeting::Builder greeting, const Limits& limits);

 private:
  struct Answer {  // a note that answers an item of the peer
    Note note;
  };
  enum class Phase {
    running,
    leaving,  // our farewell is queued or sent
    broken,  // writing has failed; still reads, because the peer may have sent a farewell
    finished,  // the promise of run() is fulfilled
  };
  [[nodiscard]] bool isEnding() const noexcept { return phase_ != Phase::running; }
  // Whether items of the peer are no longer handled.
  [[nodiscard]] bool discardsInput() const noexcept {
    return phase_ == Phase::leaving || phase_ == Phase::finished;
  }
  using Outgoing = std::variant<Note, Answer, Carried>;
  static constexpr std::size_t kMaxNotes = 4096;
  static constexpr auto kFarewellTime = 500 * kj::MILLISECONDS;
  kj::Promise<void> readLoop();
  kj::Promise<void> livenessLoop();
  [[nodiscard]] std::int64_t nextCheckNs(std::int64_t nowNs);
  [[nodiscard]] std::string silenceReason(std::int64_t nowNs) const;
  void onPing(std::uint64_t stamp);
  void ping();
  kj::Promise<void> watched(kj::Promise<void> (Line::*loop)());
  kj::Promise<void> handleReceived();
  [[nodiscard]] std::string closedReason() const;
  kj::Promise<void> readAndDiscard();
  kj::Promise<void> whenAnswersAreSent();
  bool handleSome();
  bool tryNextFrame();
  void handle(wire::Item::Reader item);
  void takeGreeting(wire::Greeting::Reader greeting);
  void scheduleWrite();
  kj::Promise<void> writeAll();
  void buildFrame();
  void build(wire::Item::Builder item, Carried& carried);
  void onWriteFailure(const std::string& why);
  struct FrameSize {
    std::size_t items;
    std::size_t bytes;  // an estimate
  };
  [[nodiscard]] FrameSize sizeOfNextFrame() const;
  void noteQueue() noexcept;
  [[nodiscard]] std::size_t notes() const noexcept { return queue_.size() - waiting_; }
  void makeScratch(std::size_t bytes);
  void finish(LineEnd end);
  [[nodiscard]] std::int64_t halfDeadNs() const noexcept {
    return std::chrono::nanoseconds(limits_.deadTime).count() / 2;
  }

  kj::Own<kj::AsyncIoStream> stream_;
  kj::Timer& timer_;
  Limits limits_;
  PeerRecord& record_;
  Owner& owner_;
  FrameReader reader_;
  std::optional<capnp::List<wire::Item>::Reader> items_;  // of the frame that is being handled
  capnp::uint nextItem_ = 0;
  bool handling_ = false;
  bool hasMore_ = false;  // the last read filled its buffer: more bytes may be waiting
  PeerGreeting peer_;
  bool greeted_ = false;
  std::deque<Outgoing> queue_;
  std::size_t waiting_ = 0;  // messages in queue_
  std::size_t answers_ = 0;  // answers in queue_
  bool writing_ = false;
  Phase phase_ = Phase::running;
  std::vector<Carried> lateRequests_;  // requests that were sent after our farewell
  std::string farewell_;  // the text of our farewell
  // After our farewell, read until the peer closes: with unread data the kernel would reset the
  // connection, and the peer might not receive the farewell.
  bool drains_ = false;
  std::int64_t lastReceiveNs_ = 0;  // time of the last sign of life
  std::size_t partialBytes_ = 0;  // received since then, of a frame that is still arriving
  bool overdue_ = false;  // the last check has found the peer overdue
  std::int64_t greetingDueNs_ = 0;  // deadline of the peer's greeting
  std::int64_t checkAfterNs_;  // longest time until the next check
  std::int64_t lastPingNs_ = 0;  // when the last ping was sent
  std::int64_t lastPostponeNs_ = 0;  // when the own ping was postponed last
  std::minstd_rand random_{std::random_device{}()};
  kj::Array<capnp::word> scratch_;
  kj::Own<capnp::MallocMessageBuilder> frame_;
  kj::Own<kj::PromiseFulfiller<LineEnd>> ended_;
  kj::Own<kj::PromiseFulfiller<void>> resumeReading_;  // nullptr: reading is not suspended
  kj::Promise<void> writes_ = nullptr;
  kj::Promise<void> reads_ = nullptr;
  kj::Promise<void> liveness_ = nullptr;
  kj::Promise<void> farewellTimer_ = nullptr;
};

}  // namespace mpf::router
