// SPDX-License-Identifier: MIT
// Layout: every byte that processes share. docs/shm-layout.md describes the same layout for
// programs that read it without this header.
//
// Each segment is a file in /dev/shm that starts with a SegmentHeader. The names:
//
//   mpf.<backplane>.s.<location>.<server>   server window   WindowControl
//   mpf.<backplane>.c.<incarnation>         client window   WindowControl
//   mpf.<backplane>.h.<incarnation>         hints           WindowHints
//   mpf.<backplane>.l.<server>.<link>       link            LinkControl, rings of slots
//   mpf.<backplane>.b.<link>.<side>.<n>     bulk            chunks
//   mpf.<backplane>.p.<incarnation>.<n>     fan-out         one chunk
//   mpf.<backplane>.w.<incarnation>         pending bind    only the header
//   mpf.<backplane>.r.<incarnation>         router          RouterLines
//
//   window        state, counters and histograms of one process; its peers map it read-only
//   hints         bell, knocks and ready bits of one window; every peer writes them
//   link          mapped only by one client and one server
//   bulk          bodies of messages that do not fit into a ring; written by `side` of the link
//   fan-out       a body that a server sends to many clients, which map it read-only
//   pending bind  says that a client waits for a server
//   router        the connections of a router, for reports; written and locked by the router
//
// Threads  each word has one writing process, which is named next to it. Only WindowHints have
//          several writers; they are hints, and a lost one costs a wake-up, never a message.
// Crash    a segment gets its name when it is complete and locked, or not at all; a message appears
//          with one release store.
// Trust    a reader checks or masks each value from a segment before it uses it.
// Version  a new minor version only uses reserved bytes; any other change is a new major version.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace mpf::layout {

// "MPF-WIN1" as bytes on a little-endian host; a host of another byte order reads another number
inline constexpr std::uint64_t kMagic = 0x314e'4957'2d46'504d;
inline constexpr std::uint16_t kMajor = 1;
inline constexpr std::uint16_t kMinor = 0;
inline constexpr std::uint16_t kOldestMajor = 1;  // oldest major version that this code reads

inline constexpr std::size_t kCacheLineBytes = 64;
// two cache lines: the adjacent-line prefetcher loads both
inline constexpr std::size_t kPairBytes = 128;
inline constexpr std::size_t kPageBytes = 4096;

inline constexpr std::uint32_t kMaxLinks = 16384;  // links of one window
inline constexpr std::uint32_t kMaxRingSlots = 1u << 16;  // slots of one ring
inline constexpr std::uint32_t kKnocks = 64;
// sizes of texts, including the terminating zero
inline constexpr std::size_t kBackplaneChars = 40;
inline constexpr std::size_t kNameChars = 64;
inline constexpr std::size_t kProgramChars = 32;

using Word32 = std::atomic<std::uint32_t>;
using Word64 = std::atomic<std::uint64_t>;
static_assert(Word32::is_always_lock_free && sizeof(Word32) == 4);
static_assert(Word64::is_always_lock_free && sizeof(Word64) == 8);

enum class SegmentKind : std::uint32_t {
  serverWindow = 1,
  clientWindow = 2,
  hints = 3,
  link = 4,
  bulk = 5,
  pendingBind = 6,
  router = 7,
  fanOut = 8
};

// Start of every segment. Written before the segment gets its name; constant afterwards. The bytes
// up to kHeaderBytes are reserved; they are not in this structure, because processes keep copies.
inline constexpr std::size_t kHeaderBytes = 512;
struct SegmentHeader {
  std::uint64_t magic;
  std::uint16_t layoutMajor;
  std::uint16_t layoutMinor;
  SegmentKind kind;
  std::uint64_t totalBytes;  // the file is at least this long
  std::uint64_t incarnation;  // unique on this host
  // incarnation of the window whose lock proves that the owner is alive; for a window its own
  std::uint64_t ownerWindow;
  std::int32_t ownerPid;  // as seen in pidNamespace
  std::uint32_t ownerUid;
  std::uint64_t ownerStartTicks;  // field 22 of /proc/<pid>/stat
  std::uint64_t pidNamespace;  // inode of /proc/self/ns/pid
  std::int64_t createdMonotonicNs;
  std::int64_t createdRealtimeNs;
  std::int32_t location;
  // windows: 1 if barriers of other processes (membarrier) reach the owner; else 0
  std::uint32_t takesBarriers;
  std::array<char, kBackplaneChars> backplane;
  // server window, pending bind, link: the server; client window: the client's label
  std::array<char, kNameChars> name;
  std::array<char, kProgramChars> program;

  // Geometry of rings and pools. A link has all of these values. In a server window, the limits and
  // rights are the ones that the server offers.
  std::uint32_t queueSlots;  // slots of the request ring, a power of two
  std::uint32_t replySlots;  // slots of the first reply ring, a power of two
  std::uint32_t queueSize;  // requests of one client that may wait
  std::uint32_t maxOutstanding;  // requests of one client that may be unanswered
  std::uint64_t maxMessageBytes;
  std::uint64_t maxPoolBytes;  // bulk memory that one side of a link may create
  std::uint32_t linkMode;  // permission bits of links and hints, as for chmod
  std::uint32_t linkGroup;  // group of links and hints, or ~0 for the group of their creator
  std::uint32_t waitMode;  // wait mode of the owner: 0 spin, 1 adaptive, 2 block

  // Link only.
  std::uint32_t clientIndex;  // bit of this link in the client window's ready bits
  std::uint64_t serverWindow;  // incarnation
  std::uint64_t clientWindow;  // incarnation
  std::uint64_t ringBytesOffset;  // offset of LinkControl; rings follow it

  // Bulk and fan-out.
  std::uint64_t chunkBytes;
  std::uint32_t chunkCount;
  std::uint32_t bulkSide;  // 0 the client's, 1 the server's

  // Link only: slots of the second reply ring, a power of two; 0: the first one is enough.
  std::uint32_t moreReplySlots;
  // Server window only: connections between routers over which its owner reaches the server; 0: its
  // owner is the server.
  std::uint32_t hops;
};
static_assert(sizeof(SegmentHeader) == 320);
static_assert(offsetof(SegmentHeader, backplane) == 88 && offsetof(SegmentHeader, name) == 128);
static_assert(offsetof(SegmentHeader, queueSlots) == 224 &&
              offsetof(SegmentHeader, chunkBytes) == 296 && offsetof(SegmentHeader, hops) == 316);

// Log-linear histogram of durations [ns]: 4 buckets for each power of two, from 16 ns to 2^40 ns.
// Written by one thread; a server's `serviceNs` by all that reply.
inline constexpr std::uint32_t kHistogramBuckets = 4 * 37;
struct Histogram {
  std::array<Word64, kHistogramBuckets> buckets;
  Word64 maxNs;
  std::array<std::uint64_t, 3> reserved;
};
static_assert(sizeof(Histogram) == sizeof(std::uint64_t) * (kHistogramBuckets + std::size_t{4}));

enum class WindowState : std::uint32_t { open = 1, closed = 2 };
enum class SleepState : std::uint32_t { awake = 0, onFutex = 1, onDescriptor = 2 };
// What a server lacks to accept another client.
enum class Shortage : std::uint32_t {
  none = 0,
  descriptors = 1,
  openFiles = 2,
  memory = 3,
  threads = 4
};

// State, counters and histograms of a window's owner, at offset 512 of a server or client window.
// Every word is written by the owner.
struct WindowControl {
  // set before a sleep, `awake` after it
  alignas(kPairBytes) std::atomic<SleepState> sleeping;
  // number of the announced sleep; a peer that has rung for it need not ring again; 0: not provided
  Word64 sleepNumber;
  alignas(kPairBytes) std::atomic<WindowState> state;
  Word32 linkCount;
  // requests of one client that may wait, for links created from now on (server windows)
  Word32 queueSize;
  std::atomic<Shortage> shortage;  // why the server cannot accept a client now
  Word64 progressAtNs;  // CLOCK_MONOTONIC at the take of the last timed request
  alignas(kPairBytes) Word64 received;  // messages taken
  Word64 sent;  // server windows: messages pushed by the first thread that took requests
  Word64 replyQueueFull;  // replies refused because the client did not take them
  // client windows: sends refused because the server's queue was full or too many requests were
  // unanswered
  Word64 queueFull;
  Word64 expired;  // requests that were dropped because their deadline had passed
  Word64 refused;  // requests answered with the fate `refused`
  Word64 wakes;  // times that the owner slept and was woken
  Word64 linksOpened;
  Word64 linksClosed;
  Word64 peersDied;
  Word64 protocolErrors;  // invalid data read from peers; each ends that link
  // server windows: faults of the hardware; client windows: exceptions that callbacks threw on the
  // thread of the shared dispatcher, where no caller can catch them
  Word64 alarms;
  Word64 handling;  // the request that a server works on, see Handling; 0: none
  Word64 sentElsewhere;  // server windows: messages pushed by other threads
  std::array<Word64, (kHistogramBuckets / 4) - 3> reserved;
  Histogram queueWaitNs;  // from push to take, sampled
  Histogram serviceNs;  // server: from take to reply; client: from send to reply, sampled
};
inline constexpr std::size_t kWindowControlOffset = 512;
inline constexpr std::size_t kWindowBytes = kWindowControlOffset + sizeof(WindowControl);

// Hints of a window, written by every peer and by the owner. A hint that is lost or set without
// reason costs a wake-up, never a message.
struct WindowHints {
  SegmentHeader header;
  std::array<std::uint8_t, kHeaderBytes - sizeof(SegmentHeader)> reserved;
  alignas(kPairBytes) Word32 bell;  // changes with every ring; the futex that the owner sleeps on
  alignas(kPairBytes) Word32 knocked;  // changes with every knock
  Word32 rescan;  // not 0: a knock was overwritten; the owner must search for new links by name
  // incarnations of links that wait to be accepted
  alignas(kPairBytes) std::array<Word64, kKnocks> knocks;
  // bit w: readyBits[w] is not zero
  alignas(kPairBytes) std::array<Word64, kMaxLinks / 64 / 64> readyWords;
  // bit i: link i has a message or a change of state
  alignas(kPairBytes) std::array<Word64, kMaxLinks / 64> readyBits;
};
static_assert(offsetof(WindowHints, bell) == 512);

// One 64-byte slot. A message is one first slot and up to three more. Only the sequence of the
// first slot says that the message is there.
struct alignas(kCacheLineBytes) Slot {
  // written by the producer, last: position + 1 once the message that starts here is complete
  Word64 sequence;
  std::uint16_t type;
  std::uint8_t slots;  // 1 to kMaxMessageSlots
  std::uint8_t flags;  // kSlot...
  std::uint32_t bodyBytes;
  std::uint32_t requestId;
  std::int32_t clientType;
  std::int32_t clientExtra;
  std::uint32_t sentTick;  // sampled messages: CLOCK_MONOTONIC / 16 ns, low 32 bits; others: 0
  // requests: CLOCK_MONOTONIC; replies: the server's time stamp, since 1970; 0: none
  std::int64_t deadlineNs;
  std::array<std::byte, 24> body;
};
static_assert(sizeof(Slot) == kCacheLineBytes && offsetof(Slot, body) == 40);

// Slots after the first: 56 bytes of body behind a sequence word that the producer does not change.
struct alignas(kCacheLineBytes) MoreSlot {
  Word64 sequence;
  std::array<std::byte, 56> body;
};
static_assert(sizeof(MoreSlot) == sizeof(Slot));

// In Slot::sequence, beside position + 1: the message of this position is in the second ring, and
// so are all later ones. Such a slot holds no message.
inline constexpr std::uint64_t kContinuesInSecondRing = std::uint64_t{1} << 63;

inline constexpr std::uint32_t kMaxMessageSlots = 4;
inline constexpr std::size_t kFirstSlotBodyBytes = sizeof(Slot::body);
// longest body in slots: 24 + 3 * 56 = 192
inline constexpr std::size_t kInlineBodyBytes =
    kFirstSlotBodyBytes + (kMaxMessageSlots - 1) * sizeof(MoreSlot::body);

inline constexpr std::uint8_t kSlotChunk = 1;  // the body is a ChunkRef to a bulk segment
inline constexpr std::uint8_t kSlotFirstReply = 2;  // ends the request that it answers

// The side of a ChunkRef to the fan-out pool of the server; only servers send it.
inline constexpr std::uint32_t kFanOutSide = 2;

// Body of a kSlotChunk message.
struct ChunkRef {
  // n of mpf.<backplane>.b.<link>.<side>.<n>, or of mpf.<backplane>.p.<server window>.<n>
  std::uint32_t segment;
  std::uint32_t chunk;
  std::uint32_t side;  // owner of the pool: 0 the client, 1 the server; kFanOutSide
  // kFanOutSide: messages of this request that the server has dropped since the last one
  std::uint32_t missed;
  // Of a request: the word at kCmdOffset of its body, so that the server can show the `cmd` without
  // a transfer of the first line of the body.
  std::uint32_t cmd = 0;
};
static_assert(sizeof(ChunkRef) == 20);
// Offset of the `cmd` in the body of every type that has one.
inline constexpr std::size_t kCmdOffset = 4;

// How the consumer of a ring looks for messages. With `polledUnfenced`, the producer needs no fence
// between its message and its load of this value: a consumer that stops polling stores `unwatched`,
// executes a barrier in all processes, and then looks for messages once more.
enum class Watch : std::uint32_t { polled = 0, unwatched = 1, polledUnfenced = 2 };

// How far a ring's consumer is. `freed` has a line of its own: a producer that waits for room reads
// it again and again, and on a shared line each store to `taken` would wait.
struct RingControl {
  alignas(kPairBytes) Word64 freed;  // slots before this position may be overwritten
  // messages taken so far; the consumer has not looked at the body of a message that is not counted
  alignas(kPairBytes) Word64 taken;
};

// Chunks that the borrower returns to the pool's owner. Written by the borrower, read by the owner.
inline constexpr std::uint32_t kReturnSlots = 256;
struct ReturnRing {
  alignas(kPairBytes) Word64 returned;  // chunks returned so far
  // segment << 16 | chunk, or kReturnsFanOut | segment; the two pools together never lend more than
  // kReturnSlots
  std::array<Word32, kReturnSlots> chunks;
};
inline constexpr std::uint32_t kMaxChunks = 1u << 16;  // of one bulk segment
inline constexpr std::uint32_t kMaxBulks = 8192;  // bulk segments of one side of a link
// In ReturnRing::chunks: a chunk of the fan-out pool.
inline constexpr std::uint32_t kReturnsFanOut = 1u << 31;

enum class LinkState : std::uint32_t { none = 0, open = 1, closed = 2, refused = 3 };

// NOLINTNEXTLINE(clang-analyzer-optin.performance.Padding): grouped by cache lines
struct LinkControl {
  // Both sides read these words for each message, so nothing here changes with each message.
  alignas(kPairBytes) std::atomic<LinkState> clientState;  // client
  std::atomic<LinkState> serverState;  // server
  std::atomic<Watch> requestWatch;  // server
  std::atomic<Watch> replyWatch;  // client
  Word32 serverIndex;  // bit of this link in the server window's ready bits; server
  // not 0: the second reply ring has memory, and maxOutstanding requests may be unanswered; client
  Word32 hasMoreReplies;
  // 1 + the number of the processor on which the consumer polls the ring; 0: it does not poll, or
  // does not say where. Only the speed depends on it.
  Word32 requestsPolledOn;  // server
  Word32 repliesPolledOn;  // client
  // Written by the client, most of them for each message. The server seldom reads them, except
  // replies.freed.
  RingControl replies;
  Word64 clientSent;
  Word64 clientRefused;  // sends refused: queue full, too many unanswered, too large, no memory
  Word64 clientAnswered;  // requests that have had a reply or a fate
  // Written by the server, most of them for each message. The client seldom reads them, except
  // requests.freed.
  alignas(kPairBytes) RingControl requests;
  Word64 serverSent;
  // 1 + the position of the first reply in the second reply ring; 0: all are in the first one
  Word64 repliesMoved;
  ReturnRing requestChunks;  // client's pool: borrower server
  ReturnRing replyChunks;  // server's pool: borrower client
};
inline constexpr std::size_t kLinkControlOffset = 512;
inline constexpr std::size_t kLinkRingsOffset = kLinkControlOffset + sizeof(LinkControl);
static_assert(kLinkRingsOffset % kPairBytes == 0);

// The slots of the request ring come first, then those of the first and of the second reply ring.
// The second one has memory only when the client has reserved it.
[[nodiscard]] constexpr std::size_t linkBytes(std::uint32_t queueSlots, std::uint32_t replySlots,
                                              std::uint32_t moreReplySlots) {
  return kLinkRingsOffset + (std::size_t{queueSlots} + replySlots + moreReplySlots) * sizeof(Slot);
}

// Chunks of a bulk segment start here, each chunkBytes long.
inline constexpr std::size_t kBulkChunksOffset = kPageBytes;

// One connection of a router, or one remote router to which it tries to connect.
// Written by the router.
enum class RouterLineState : std::uint32_t { none = 0, waiting = 1, connecting = 2, connected = 3 };
enum class RouterRole : std::uint32_t { none = 0, client = 1, server = 2 };
struct RouterLine {
  std::atomic<RouterLineState> state;
  std::atomic<RouterRole> role;
  Word32 isTls;
  Word32 texts;  // changes of the texts; odd while they change
  Word64 sinceNs;  // CLOCK_MONOTONIC of the last change between connected and not connected
  Word64 connects;  // number of connections made so far
  Word64 queueSize;  // messages that may wait for the line
  Word64 inQueue;  // messages that wait for the line
  // requests refused because a server's queue was full: on the other host (role client) or on this
  // host (role server)
  Word64 queueFull;
  Word64 messagesSent;
  Word64 messagesReceived;
  Word64 framesSent;  // a write may have several
  Word64 framesReceived;
  Word64 bytesSent;
  Word64 bytesReceived;
  Word64 roundTripNs;  // of the last ping
  Word64 clients;
  Word64 bindings;  // servers to which clients have bound
  std::array<char, 80> address;
  std::array<char, kNameChars> peer;  // the name that the other router gives itself
  std::array<char, kProgramChars> program;  // program and version of the other router
  std::array<char, kNameChars> locations;  // "1, 2"
  std::array<char, 144> problem;  // why the line is not connected
};
static_assert(sizeof(RouterLine) == 512);

inline constexpr std::uint32_t kRouterLines = 256;
inline constexpr std::size_t kRouterLinesOffset = 512;
inline constexpr std::size_t kRouterBytes = kRouterLinesOffset + kRouterLines * sizeof(RouterLine);

// The structures above have no pointers, bool, size_t or virtual functions, and their constructors
// do nothing.
static_assert(std::is_standard_layout_v<SegmentHeader> &&
              std::is_trivially_copyable_v<SegmentHeader>);
static_assert(std::is_standard_layout_v<WindowControl> && std::is_standard_layout_v<WindowHints>);
static_assert(std::is_standard_layout_v<LinkControl> && std::is_standard_layout_v<Slot>);

}  // namespace mpf::layout
