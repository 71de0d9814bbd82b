// SPDX-License-Identifier: MIT
// Layout: every byte that processes share. docs/shm-layout.md tells the same to writers of a second
// reader.
//
// Each kind of segment is a file in /dev/shm that starts with a SegmentHeader:
//
//   mpf.<backplane>.s.<location>.<server>   server window   ┐ WindowControl: sleeping, state, counters, histograms.
//   mpf.<backplane>.c.<incarnation>         client window   ┘ Written by the owner alone, mapped read-only by its peers.
//   mpf.<backplane>.h.<incarnation>         hints           WindowHints of one window: bell,
//   knocks, ready bits. Every peer writes. mpf.<backplane>.l.<server>.<link>       link
//   two rings of one client-server pair, mapped by these two alone.
//   mpf.<backplane>.b.<link>.<side>.<n>     bulk            chunks for messages that do not fit a
//   ring; `side` writes. mpf.<backplane>.w.<incarnation>         pending bind            a client
//   that waits for a server: the header alone. mpf.<backplane>.r.<incarnation>         router
//   a router's connections to others, for reports. Locked and written by the router.
//
// Threads  each word has one writing process, named next to it; WindowHints are the exception and
//          only hints.
// Crash    segments appear under their name complete and locked (or not at all); messages appear
//          with one release store.
// Trust    a reader checks or masks whatever it takes from here before use.
// Version  a new minor version only fills reserved bytes; whatever else changes is a new major
//          version.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace mpf::layout {

inline constexpr std::uint64_t kMagic =
    0x314e'4957'2d46'504d;  // "MPF-WIN1" as bytes on a little-endian host; another byte order mismatches
inline constexpr std::uint16_t kMajor = 1;
inline constexpr std::uint16_t kMinor = 1;
inline constexpr std::uint16_t kOldestMajor = 1;  // oldest major version that this code reads

inline constexpr std::size_t kCacheLineBytes = 64;
// two lines: the adjacent-line prefetcher pulls both
inline constexpr std::size_t kPairBytes = 128;
inline constexpr std::size_t kPageBytes = 4096;

inline constexpr std::uint32_t kMaxLinks = 16384;  // links of one window
inline constexpr std::uint32_t kMaxRingSlots = 1u << 16;  // slots of one ring
inline constexpr std::uint32_t kKnocks = 64;
inline constexpr std::size_t kBackplaneChars = 40;  // including the terminating zero, as below
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
  router = 7
};

// First 512 bytes of every segment. Written before the segment gets its name, constant afterwards.
struct SegmentHeader {
  std::uint64_t magic;
  std::uint16_t layoutMajor;
  std::uint16_t layoutMinor;
  SegmentKind kind;
  std::uint64_t totalBytes;  // the file is at least this long
  std::uint64_t incarnation;  // unique on this host
  // incarnation of the window whose lock tells whether the owner lives; a window names itself
  std::uint64_t ownerWindow;
  std::int32_t ownerPid;  // as seen in pidNamespace
  std::uint32_t ownerUid;
  std::uint64_t ownerStartTicks;  // field 22 of /proc/<pid>/stat
  std::uint64_t pidNamespace;  // inode of /proc/self/ns/pid
  std::int64_t createdMonotonicNs;
  std::int64_t createdRealtimeNs;
  std::int32_t location;
  std::uint32_t reserved0;
  std::array<char, kBackplaneChars> backplane;
  // server window, pending bind, link: the server; client window: the client's label
  std::array<char, kNameChars> name;
  std::array<char, kProgramChars> program;

  // Geometry of rings and pools. A link has all of it; of a server window, the limits and rights
  // are what it offers.
  std::uint32_t queueSlots;  // slots of the request ring, a power of two
  std::uint32_t replySlots;  // slots of the reply ring, a power of two
  std::uint32_t queueSize;  // requests of one client that may wait
  std::uint32_t maxOutstanding;  // requests of one client that may be unanswered
  std::uint64_t maxMessageBytes;
  std::uint64_t maxPoolBytes;  // bulk memory that one side of a link may create
  std::uint32_t linkMode;  // rights of links and hints, as in chmod
  std::uint32_t linkGroup;  // their group, or ~0 for the creator's own
  std::uint32_t waitMode;  // of the owner: 0 spin, 1 adaptive, 2 block

  // Link only.
  std::uint32_t clientIndex;  // bit of this link in the client window's ready bits
  std::uint64_t serverWindow;  // incarnation
  std::uint64_t clientWindow;  // incarnation
  std::uint64_t ringBytesOffset;  // offset of LinkControl; rings follow it

  // Bulk only.
  std::uint64_t chunkBytes;
  std::uint32_t chunkCount;
  std::uint32_t bulkSide;  // 0 the client's, 1 the server's

  std::array<std::uint8_t, 200> reserved;
};
static_assert(sizeof(SegmentHeader) == 512);
static_assert(offsetof(SegmentHeader, backplane) == 88 && offsetof(SegmentHeader, name) == 128);
static_assert(offsetof(SegmentHeader, queueSlots) == 224 &&
              offsetof(SegmentHeader, chunkBytes) == 296);

// Log-linear histogram of nanoseconds: bucket = 4 per power of two, from 16 ns to 2^40 ns. Written
// by one thread.
inline constexpr std::uint32_t kHistogramBuckets = 4 * 37;
struct Histogram {
  std::array<Word64, kHistogramBuckets> buckets;
  Word64 maxNs;
  std::array<std::uint64_t, 3> reserved;
};
static_assert(sizeof(Histogram) == sizeof(std::uint64_t) * (kHistogramBuckets + std::size_t{4}));

enum class WindowState : std::uint32_t { open = 1, closed = 2 };
enum class SleepState : std::uint32_t { awake = 0, onFutex = 1, onDescriptor = 2 };
// What a server lacks to accept another client. Since 1.1.
enum class Shortage : std::uint32_t { none = 0, descriptors = 1, openFiles = 2, memory = 3 };

// What a window's owner says of itself. At offset 512 of a server or client window. Every word is
// written by the owner.
struct WindowControl {
  // announced before a sleep, withdrawn after it
  alignas(kPairBytes) std::atomic<SleepState> sleeping;
  // of the sleep that is announced: who has rung for it need not ring again; 0: nobody says
  Word64 sleepNumber;
  alignas(kPairBytes) std::atomic<WindowState> state;
  Word32 linkCount;
  // requests of one client that may wait, for links made from now on (server windows)
  Word32 queueSize;
  std::atomic<Shortage> shortage;  // of a server that cannot accept a client; none once it can
  Word64 progress;  // grows with every message handled
  Word64 progressAtNs;  // CLOCK_MONOTONIC when `progress` was last sampled
  alignas(kPairBytes) Word64 received;  // messages taken
  Word64 sent;  // messages pushed
  Word64 replyQueueFull;  // replies refused because the client did not take them
  // sends refused because the server's queue was full or owed too many replies (client windows)
  Word64 queueFull;
  Word64 expired;  // requests that were dropped because their deadline had passed
  Word64 refused;  // requests answered with the fate `refused`
  Word64 wakes;  // times that the owner slept and was woken
  Word64 linksOpened;
  Word64 linksClosed;
  Word64 peersDied;
  Word64 protocolErrors;  // nonsense read from a peer; each costs that link
  // server windows: faults of the hardware; client windows: exceptions that nobody could catch
  Word64 alarms;
  Word64 handling;  // the request that a server works on, see Handling; 0: none. Since layout 1.1
  std::array<Word64, (kHistogramBuckets / 4) - 2> reserved;
  Histogram queueWaitNs;  // from push to take, sampled
  Histogram serviceNs;  // server: from take to reply; client: from send to reply, sampled
};
inline constexpr std::size_t kWindowControlOffset = 512;
inline constexpr std::size_t kWindowBytes = kWindowControlOffset + sizeof(WindowControl);

// Hints of a window, written by every peer and by the owner. Losing or inventing one costs a
// wake-up, never a message.
struct WindowHints {
  SegmentHeader header;
  alignas(kPairBytes) Word32 bell;  // changes with every ring; the futex that the owner sleeps on
  alignas(kPairBytes) Word32 knocked;  // changes with every knock
  Word32 rescan;  // not 0: a knock was overwritten, look for new links by name
  // incarnations of links that wait to be accepted
  alignas(kPairBytes) std::array<Word64, kKnocks> knocks;
  // bit w: readyBits[w] is not zero
  alignas(kPairBytes) std::array<Word64, kMaxLinks / 64 / 64> readyWords;
  alignas(kPairBytes) std::array<Word64, kMaxLinks / 64> readyBits;  // bit i: link i has news
};
static_assert(offsetof(WindowHints, bell) == 512);

// One 64-byte slot. A message is one first slot and up to three more; only the first one's sequence
// says that it is there.
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
  std::uint32_t sentTick;  // CLOCK_MONOTONIC / 16 ns, low 32 bits, of sampled messages; else 0
  std::int64_t deadlineNs;  // CLOCK_MONOTONIC; 0 none
  std::array<std::byte, 24> body;
};
static_assert(sizeof(Slot) == kCacheLineBytes && offsetof(Slot, body) == 40);

// Slots after the first: 56 bytes of body behind a sequence word that stays as it was.
struct alignas(kCacheLineBytes) MoreSlot {
  Word64 sequence;
  std::array<std::byte, 56> body;
};
static_assert(sizeof(MoreSlot) == sizeof(Slot));

inline constexpr std::uint32_t kMaxMessageSlots = 4;
inline constexpr std::size_t kFirstSlotBodyBytes = sizeof(Slot::body);
// 192
inline constexpr std::size_t kInlineBodyBytes =
    kFirstSlotBodyBytes + (kMaxMessageSlots - 1) * sizeof(MoreSlot::body);

inline constexpr std::uint8_t kSlotChunk = 1;  // the body is a ChunkRef to a bulk segment
inline constexpr std::uint8_t kSlotFirstReply = 2;  // ends the request that it answers

// Body of a kSlotChunk message.
struct ChunkRef {
  std::uint32_t segment;  // n of mpf.<backplane>.b.<link>.<side>.<n>
  std::uint32_t chunk;
  std::uint32_t side;  // whose pool: 0 the client's, 1 the server's
  std::uint32_t reserved;
};
static_assert(sizeof(ChunkRef) == 16);

// What the consumer of a ring says. Written by the consumer alone.
struct RingControl {
  alignas(kPairBytes) Word32 unwatched;  // 1: not polled directly, set the ready bit; 0: polled
  alignas(kPairBytes) Word64 freed;  // slots before this position may be overwritten
  Word64 taken;  // messages taken so far; one that is not counted here has not been looked at
};

// Chunks on their way home. Written by the borrower, read by the pool's owner.
inline constexpr std::uint32_t kReturnSlots = 256;
struct ReturnRing {
  alignas(kPairBytes) Word64 returned;  // borrower
  // segment << 32 | chunk; a pool never lends more than kReturnSlots
  std::array<Word64, kReturnSlots> chunks;
};

enum class LinkState : std::uint32_t { none = 0, open = 1, closed = 2, refused = 3 };

struct LinkControl {
  alignas(kPairBytes) std::atomic<LinkState> clientState;  // client
  Word64 clientSent;
  Word64 clientRefused;  // sends refused: queue full, too many unanswered, too large, no memory
  Word64 clientUnanswered;  // requests without a reply or fate
  alignas(kPairBytes) std::atomic<LinkState> serverState;  // server
  Word32 serverIndex;  // bit of this link in the server window's ready bits
  Word32 reserved0;
  Word64 serverSent;
  RingControl requests;  // consumer: server
  RingControl replies;  // consumer: client
  ReturnRing requestChunks;  // client's pool: borrower server
  ReturnRing replyChunks;  // server's pool: borrower client
};
inline constexpr std::size_t kLinkControlOffset = 512;
inline constexpr std::size_t kLinkRingsOffset = kLinkControlOffset + sizeof(LinkControl);
static_assert(kLinkRingsOffset % kPairBytes == 0);

[[nodiscard]] constexpr std::size_t linkBytes(std::uint32_t queueSlots, std::uint32_t replySlots) {
  return kLinkRingsOffset + (std::size_t{queueSlots} + replySlots) * sizeof(Slot);
}

// Chunks of a bulk segment start here, each chunkBytes long.
inline constexpr std::size_t kBulkChunksOffset = kPageBytes;

// One connection of a router, or one remote that it is to be connected to. Written by the router.
enum class RouterLineState : std::uint32_t { none = 0, waiting = 1, connecting = 2, connected = 3 };
enum class RouterRole : std::uint32_t { none = 0, client = 1, server = 2 };
struct RouterLine {
  std::atomic<RouterLineState> state;
  std::atomic<RouterRole> role;
  Word32 isTls;
  Word32 texts;  // changes of the texts; odd while they change
  Word64 sinceNs;  // CLOCK_MONOTONIC since when it is connected, or is not
  Word64 connects;  // times that it was connected
  Word64 queueSize;  // messages that may wait for the line
  Word64 inQueue;  // and that do
  // requests that found a far server's queue full (client), or a server's here (server)
  Word64 queueFull;
  Word64 messagesSent;
  Word64 messagesReceived;
  Word64 framesSent;  // each one write
  Word64 framesReceived;
  Word64 bytesSent;
  Word64 bytesReceived;
  Word64 roundTripNs;  // of the last ping
  Word64 clients;
  Word64 bindings;  // servers that somebody wanted
  std::array<char, 80> address;
  std::array<char, kNameChars> peer;  // what it calls itself
  std::array<char, kProgramChars> program;  // its program and version
  std::array<char, kNameChars> locations;  // "1, 2"
  std::array<char, 144> problem;  // why it is not connected
};
static_assert(sizeof(RouterLine) == 512);

inline constexpr std::uint32_t kRouterLines = 256;
inline constexpr std::size_t kRouterLinesOffset = 512;
inline constexpr std::size_t kRouterBytes = kRouterLinesOffset + kRouterLines * sizeof(RouterLine);

// Nothing above has a constructor that does work, a pointer, a bool or a size_t.
static_assert(std::is_standard_layout_v<SegmentHeader> &&
              std::is_trivially_copyable_v<SegmentHeader>);
static_assert(std::is_standard_layout_v<WindowControl> && std::is_standard_layout_v<WindowHints>);
static_assert(std::is_standard_layout_v<LinkControl> && std::is_standard_layout_v<Slot>);

}  // namespace mpf::layout
