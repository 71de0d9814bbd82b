// SPDX-License-Identifier: MIT
// Line: one connection to another router: frames both ways, a queue of what is to go, signs of
// life, and the end.
//
//   send...() ─► queue ─► one frame of all that waits, up to a size ─► stream      while one is being written, the next one gathers
//   stream ─► frames ─► Owner::onItem
//
// A message that waits is kept as it came, in the shared memory of its sender, and is converted
// when its frame is built. A peer that does not read what it asked for is not read, either. A long
// frame is handled in turns with what else the loop has to do.
//
// Threads  that of the event loop.
// Crash    a peer that is gone, stopped or cut off is noticed within Limits::deadTime.
// Trust    nonsense ends the line with a farewell that says what was wrong.
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

// A message on its way, as an item of a frame.
struct Carried {
  bool isRequest = false;
  bool isFirst = false;  // of a reply
  std::uint32_t client = 0;
  std::uint32_t requestId = 0;
  Deadline takeBefore = Deadline::never();  // of a request
  Message message;
};

// What a reply takes of its client's window (router.capnp, Credit): the bytes of its elements, and
// some for the rest.
inline constexpr std::uint32_t kWindowBytesBeside = 64;
[[nodiscard]] inline std::uint32_t windowBytesOf(const Message& reply) noexcept {
  return kWindowBytesBeside + reply.arrayLength() * layoutOf(reply.getType()).elementBytes;
}

// The largest body but for its elements. Limits on the wire are of elements, those of shared memory
// of whole bodies.
inline constexpr std::uint64_t kMostBesideElements = [] {
  std::uint64_t most = 0;
  for (std::uint16_t type = 1; layoutOf(static_cast<MessageType>(type)).headerBytes != 0; ++type) {
    most = std::max<std::uint64_t>(most, layoutOf(static_cast<MessageType>(type)).headerBytes);
  }
  return most;
}();

// What a peer said of itself.
struct PeerGreeting {
  std::string router;
  std::string program;
  std::uint64_t maxFrameBytes = 0;
  std::uint64_t maxMessageBytes = 0;
  std::uint32_t maxClients = 0;
};

// Why a line ended, for people.
struct LineEnd {
  std::string text;
};

class Line {
 public:
  using Note = std::function<void(wire::Item::Builder)>;

  class Owner {
   public:
    // The peer's greeting has come and is one that we understand.
    virtual void onGreeting(const PeerGreeting& greeting) = 0;
    // Any later item but pings and farewells. May throw ProtocolError.
    virtual void onItem(wire::Item::Reader item) = 0;
    // hasRoom() may have become true.
    virtual void onRoom() = 0;
    // A message that cannot go, and why; its request, if it is one, was not done. `instead`: goes
    // in its place, and may be filled.
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

  // Greets and runs until the line ends. Once.
  [[nodiscard]] kj::Promise<LineEnd> run(Note greeting);
  // Ends it with a farewell: once what waits has gone and the peer has closed, too, or a moment has
  // passed.
  void end(FarewellCode code, const std::string& why);

  // Always taken. Those that come of what the peer sent are bounded: when too many wait, no more is
  // read of it.
  void send(Note note);
  // Taken even without room; who has a choice looks at hasRoom() first.
  void send(Carried carried);
  [[nodiscard]] bool hasRoom() const noexcept {
    return greeted_ && !isEnding() && waiting_ < limits_.queueSize && notes() < kManyNotes;
  }
  [[nodiscard]] const PeerGreeting& peer() const noexcept { return peer_; }
  [[nodiscard]] bool hasGreeted() const noexcept { return greeted_; }
  // Those that it began with: what we greeted with.
  [[nodiscard]] const Limits& limits() const noexcept { return limits_; }
  // Largest body that may be sent.
  [[nodiscard]] std::uint64_t maxMessageBytes() const noexcept;

  // Requests that never reached the stream, once the line has ended.
  [[nodiscard]] std::vector<Carried> takeUnsentRequests();

  // What the greeting says of the limits.
  static void describe(wire::Greeting::Builder greeting, const Limits& limits);

 private:
  struct Answer {  // a note that came of what the peer sent
    Note note;
  };
  enum class Phase {
    running,
    leaving,  // our farewell is on its way
    broken,  // nothing can be sent: a farewell of the peer would say why
    finished,  // its owner knows
  };
  [[nodiscard]] bool isEnding() const noexcept { return phase_ != Phase::running; }
  // Whatever comes yet matters no more.
  [[nodiscard]] bool isDeaf() const noexcept {
    return phase_ == Phase::leaving || phase_ == Phase::finished;
  }
  using Outgoing = std::variant<Note, Answer, Carried>;
  static constexpr std::size_t kManyNotes = 4096;
  static constexpr auto kLastMoment = 500 * kj::MILLISECONDS;  // for the farewell to be written
  kj::Promise<void> readLoop();
  kj::Promise<void> aliveLoop();
  [[nodiscard]] std::int64_t nextLookNs(std::int64_t nowNs);
  [[nodiscard]] std::string silence(std::int64_t nowNs) const;
  void onPing(std::uint64_t stamp);
  void ping();
  kj::Promise<void> watched(kj::Promise<void> (Line::*loop)());
  kj::Promise<void> readOn();
  [[nodiscard]] std::string closed() const;
  kj::Promise<void> readAndDiscard();
  kj::Promise<void> whenAnswersHaveGone();
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
    std::size_t bytes;  // about
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
  bool hasMore_ = false;  // bytes that have come, and were not read yet
  PeerGreeting peer_;
  bool greeted_ = false;
  std::deque<Outgoing> queue_;
  std::size_t waiting_ = 0;  // messages among them
  std::size_t answers_ = 0;
  bool writing_ = false;
  Phase phase_ = Phase::running;
  std::vector<Carried> late_;  // requests that came behind our farewell
  std::string farewell_;  // what we ended it with
  // After the farewell, input is read and discarded until the peer closes: TCP would reset the
  // connection because of unread input, and the peer could lose the farewell.
  bool drains_ = false;
  std::int64_t heardNs_ = 0;  // when there was a sign of life
  std::size_t heardBytes_ = 0;  // since then, of a frame that is still coming
  bool overdue_ = false;  // at the last look
  std::int64_t greetBeforeNs_ = 0;  // the peer
  std::int64_t lookAfterNs_;  // at most, from the last look on
  std::int64_t pingedNs_ = 0;  // when we asked last
  std::int64_t putOffNs_ = 0;  // when we put off asking last
  std::minstd_rand random_{std::random_device{}()};
  kj::Array<capnp::word> scratch_;
  kj::Own<capnp::MallocMessageBuilder> frame_;
  kj::Own<kj::PromiseFulfiller<LineEnd>> ended_;
  kj::Own<kj::PromiseFulfiller<void>> readOn_;  // nobody waits for it: nullptr
  kj::Promise<void> writes_ = nullptr;
  kj::Promise<void> reads_ = nullptr;
  kj::Promise<void> life_ = nullptr;
  kj::Promise<void> lastMoment_ = nullptr;
};

}  // namespace mpf::router
