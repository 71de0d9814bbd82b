// SPDX-License-Identifier: MIT
#include "tests/hostile/attacker.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstring>
#include <stdexcept>

#include "shm/segment_name.h"

namespace mpf::test {

void Attacker::open(const std::string& name) {
  auto path = segments::path(name);
  const FileDescriptor file(::open(path.c_str(), O_RDWR | O_CLOEXEC));
  struct stat status{};
  if (!file || ::fstat(file.get(), &status) != 0 || status.st_size == 0) return;
  files_.push_back({std::move(path), Mapping(file.get(), static_cast<std::size_t>(status.st_size),
                                             Mapping::Access::readWrite)});
}

void Attacker::reach(const Link& link) {
  const std::string backplane(own_.header().backplane.data());
  const auto hintsOf = [&](std::uint64_t window) {
    return SegmentName::keyed(backplane, NameKind::hints, window);
  };
  files_.clear();
  open(link.name());
  open(hintsOf(link.header().serverWindow));
  open(hintsOf(link.header().clientWindow));
  for (std::uint32_t side = 0; side < 2; ++side) {
    for (std::uint32_t number = 0; number < 4; ++number) {
      open(SegmentName::bulk(backplane, link.header().incarnation, side, number));
    }
  }
  if (link.side() == LinkSide::client)
    open(SegmentName::keyed(backplane, NameKind::clientWindow, own_.header().incarnation));
  if (files_.empty()) throw std::runtime_error("nothing to write to");
  position_ = 0;
}

void Attacker::act(Link& link) {
  if (kind_ == "bytes") return writeByte();
  if (kind_ == "words") return writeWord();
  if (kind_ == "slots") return writeSlot(link);
  if (kind_ == "hints") return writeHints();
  if (kind_ == "headers") return writeHeader();
  if (kind_ == "cut") return cut();
  if (kind_ == "backwards") return goBack(link);
  throw std::invalid_argument("unknown attack: " + kind_);
}

void Attacker::writeByte() {
  auto& memory = any();
  memory.data()[random_.below(memory.bytes())] = static_cast<std::byte>(random_.bits());
}

void Attacker::writeWord() {
  auto& memory = any();
  const auto at = random_.below(memory.bytes() / 8) * 8;
  const auto word = random_.nasty();
  std::memcpy(memory.data() + at, &word, sizeof word);
}

// Writes a next message that looks valid and has random contents.
void Attacker::writeSlot(Link& link) {
  const bool isClient = link.side() == LinkSide::client;
  const auto slots = isClient ? link.header().queueSlots : link.header().replySlots;
  const auto& consumer = isClient ? link.control().requests : link.control().replies;
  if (const auto freed = consumer.freed.load(std::memory_order_relaxed); position_ < freed)
    position_ = freed;
  const auto offset = layout::kLinkRingsOffset +
                      (isClient ? 0 : std::size_t{link.header().queueSlots} * sizeof(layout::Slot));
  auto* const memory = reinterpret_cast<std::byte*>(&link.control()) - layout::kLinkControlOffset;
  auto& slot =
      *reinterpret_cast<layout::Slot*>(memory + offset + position_ % slots * sizeof(layout::Slot));
  slot.type = static_cast<std::uint16_t>(random_.oneIn(8) ? random_.bits() : random_.below(12));
  slot.slots = static_cast<std::uint8_t>(random_.below(6));
  slot.flags = static_cast<std::uint8_t>(random_.below(4));
  slot.bodyBytes =
      static_cast<std::uint32_t>(random_.oneIn(2) ? random_.below(300) : random_.nasty());
  slot.requestId =
      static_cast<std::uint32_t>(random_.oneIn(4) ? random_.nasty() : random_.below(100));
  slot.deadlineNs = random_.oneIn(4) ? static_cast<std::int64_t>(random_.nasty()) : 0;
  slot.sentTick = static_cast<std::uint32_t>(random_.bits());
  const layout::ChunkRef ref{static_cast<std::uint32_t>(random_.below(6)),
                             static_cast<std::uint32_t>(random_.below(300)),
                             static_cast<std::uint32_t>(random_.below(3)), 0};
  std::memcpy(slot.body.data(), &ref, sizeof ref);
  // Sometimes says that the replies continue in the second ring.
  const auto continues = random_.oneIn(16) ? layout::kContinuesInSecondRing : 0;
  slot.sequence.store(continues | (position_ + 1), std::memory_order_relaxed);
  position_ += random_.below(3);
  link.notifyPeer();
}

// Sets and clears ready bits at random, and writes invalid knocks.
void Attacker::writeHints() {
  for (const auto& file : files_) {
    if (file.path.find(".h.") == std::string::npos) continue;
    auto& hints = *reinterpret_cast<layout::WindowHints*>(file.memory.data());
    for (auto& word : hints.readyWords)
      word.store(random_.oneIn(2) ? 0 : UINT64_MAX, std::memory_order_relaxed);
    for (auto& bits : hints.readyBits)
      bits.store(random_.oneIn(2) ? 0 : UINT64_MAX, std::memory_order_relaxed);
    for (auto& knock : hints.knocks) knock.store(random_.nasty(), std::memory_order_relaxed);
    hints.knocked.fetch_add(1, std::memory_order_relaxed);
    hints.rescan.store(1, std::memory_order_relaxed);
    hints.bell.store(static_cast<std::uint32_t>(random_.bits()), std::memory_order_relaxed);
  }
}

void Attacker::writeHeader() {
  auto& memory = any();
  const auto word = random_.nasty();
  std::memcpy(memory.data() + random_.below(layout::kHeaderBytes / 8) * 8, &word, sizeof word);
}

void Attacker::cut() {
  const auto& file = files_[random_.below(files_.size())];
  const auto bytes = random_.oneIn(3) ? 0 : random_.below(file.memory.bytes());
  [[maybe_unused]] const int result = ::truncate(file.path.c_str(), static_cast<off_t>(bytes));
}

// Writes wrong positions and counts, and returns chunks that were never lent.
void Attacker::goBack(Link& link) {
  const bool isClient = link.side() == LinkSide::client;
  auto& control = link.control();
  auto& consumer = isClient ? control.replies : control.requests;
  auto& returns = isClient ? control.replyChunks : control.requestChunks;
  consumer.freed.store(random_.nasty(), std::memory_order_relaxed);
  consumer.taken.store(random_.oneIn(2) ? 0 : random_.nasty(), std::memory_order_relaxed);
  auto& watch = isClient ? control.replyWatch : control.requestWatch;
  watch.store(static_cast<layout::Watch>(random_.below(4)), std::memory_order_relaxed);
  returns.chunks[random_.below(returns.chunks.size())].store(
      static_cast<std::uint32_t>(random_.oneIn(2) ? layout::kReturnsFanOut | random_.below(8)
                                                  : random_.below(4) << 16 | random_.below(40)),
      std::memory_order_relaxed);
  auto& polledOn = isClient ? control.repliesPolledOn : control.requestsPolledOn;
  polledOn.store(static_cast<std::uint32_t>(random_.below(4)), std::memory_order_relaxed);
  control.hasMoreReplies.store(static_cast<std::uint32_t>(random_.below(2)),
                               std::memory_order_relaxed);
  control.repliesMoved.store(random_.oneIn(2) ? 0 : random_.nasty(), std::memory_order_relaxed);
  returns.returned.store(random_.oneIn(4) ? random_.nasty() : random_.below(1000),
                         std::memory_order_relaxed);
  if (random_.oneIn(2)) writeSlot(link);
}

}  // namespace mpf::test
