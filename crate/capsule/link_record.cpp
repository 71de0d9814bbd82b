// SPDX-License-Identifier: MIT
#include "crate/capsule/link_record.h"

#include <unistd.h>

#include <cstring>
#include <fmt/format.h>
#include <ranges>
#include <set>

#include "schema/json.h"
#include "schema/text.h"
#include "shm/segment.h"
#include "tools/inspect/ring_view.h"
#include "tools/inspect/segment_image.h"
#include "tools/report/snapshot.h"

namespace mpf::crate {

using tools::MessageState;
using tools::RingMessage;
using tools::RingView;
using tools::SegmentImage;
using tools::value;

namespace {

constexpr std::size_t kMostBody = std::size_t{64} << 10;  // larger bodies are not shown
constexpr std::size_t kMostFields = 1024;  // larger bodies are shown as text, which is shortened

std::vector<std::byte> readChunk(const WitnessedLink& link, const RingMessage& message) {
  const auto inlined = message.inlineBody();
  layout::ChunkRef ref{};
  std::memcpy(&ref, inlined.data(), sizeof ref);
  const auto bulk = link.bulks.find({ref.side, ref.segment});
  const std::size_t size = message.first.front().bodyBytes;
  if (bulk == link.bulks.end())
    throw SegmentError(fmt::format("its pool segment {} was not open", ref.segment));
  const auto header =
      SegmentImage::readOpen(bulk->second.get(), link.name, layout::SegmentKind::bulk).header();
  if (ref.chunk >= header.chunkCount || size > header.chunkBytes)
    throw SegmentError(fmt::format("its pool has no chunk {} of {} bytes", ref.chunk, size));
  if (size > kMostBody)
    throw SegmentError(fmt::format("a body of {} bytes is too large to show", size));
  std::vector<std::byte> body(size);
  const auto offset = layout::kBulkChunksOffset + ref.chunk * header.chunkBytes;
  if (::pread(bulk->second.get(), body.data(), size, static_cast<off_t>(offset)) !=
      static_cast<ssize_t>(size))
    throw SegmentError(fmt::format("chunk {} of its pool is cut off", ref.chunk));
  return body;
}

Message decode(const WitnessedLink& link, const RingMessage& message) {
  const auto& slot = message.first.front();
  const auto isChunk = (slot.flags & layout::kSlotChunk) != 0;
  auto body = isChunk ? readChunk(link, message) : message.inlineBody();
  if (slot.bodyBytes > body.size())
    throw SegmentError(fmt::format("{} bytes of body do not fit its slots", slot.bodyBytes));
  body.resize(slot.bodyBytes);
  auto decoded = Message::copyOf(static_cast<MessageType>(slot.type), body);
  decoded.setClientType(slot.clientType);
  decoded.setClientExtra(slot.clientExtra);
  return decoded;
}

Tree describe(const WitnessedLink& link, const RingMessage& message) {
  const auto& slot = message.first.front();
  Tree tree{{"position", message.position},
            {"state", toString(message.state)},
            {"requestId", slot.requestId},
            {"type", slot.type}};
  if (slot.deadlineNs != 0) tree["timeNs"] = slot.deadlineNs;
  try {
    const auto decoded = decode(link, message);
    tree["text"] = print(decoded);
    if (slot.bodyBytes <= kMostFields) tree["message"] = toJson(decoded);
  } catch (const std::exception& error) {
    tree["problem"] = error.what();
  }
  return tree;
}

// One ring of the link.
struct Ring {
  Ring(std::span<const layout::Slot> slots, const layout::RingControl& control,
       std::uint64_t sentSoFar)
      : words{value(control.freed), value(control.taken), sentSoFar},
        view(RingView::of(slots, words, slots, words.freed)),
        hasLost(view.end > slots.size()) {}

  [[nodiscard]] Tree summary() const {
    return {{"sent", words.sent}, {"taken", words.taken}, {"waiting", words.waiting()}};
  }

  tools::RingWords words;
  RingView view;
  bool hasLost;  // older messages were overwritten
};

bool isTaken(const RingMessage& message) {
  return message.state == MessageState::taken || message.state == MessageState::freed;
}

// "yes", "no", or "unknown": the reply may have been overwritten.
class Answers {
 public:
  explicit Answers(const Ring& replies) : hasLost_(replies.hasLost) {
    for (const auto& reply : replies.view.messages) {
      if (reply.state == MessageState::unpublished) continue;
      const auto& slot = reply.first.front();
      if ((slot.flags & layout::kSlotFirstReply) != 0) answered_.insert(slot.requestId);
    }
  }
  // newer: number of taken requests that are newer than this one.
  [[nodiscard]] const char* of(std::uint32_t requestId, std::size_t newer) const {
    if (answered_.contains(requestId)) return "yes";
    return hasLost_ && newer >= answered_.size() ? "unknown" : "no";
  }

 private:
  std::set<std::uint32_t> answered_;
  bool hasLost_;
};

void addMessages(LinkRecord& record, const WitnessedLink& link, const Ring& requests,
                 const Ring& replies, std::size_t last) {
  const Answers answers(replies);
  auto shown = Tree::array();
  std::size_t taken = 0;
  std::uint64_t unanswered = 0;
  for (const auto& message : std::views::reverse(requests.view.messages)) {
    const auto isHere = isTaken(message);
    const auto id = message.first.front().requestId;
    const auto* const answered = isHere ? answers.of(id, taken) : "no";
    if (answered == std::string_view("no") && message.state != MessageState::unpublished)
      ++unanswered;
    const auto isLastTaken = isHere && taken == 0;
    if (isHere) ++taken;
    if (shown.size() >= last && !isLastTaken) continue;
    auto tree = describe(link, message);
    tree["answered"] = answered;
    if (isLastTaken) record.lastTaken = tree;
    if (shown.size() < last) shown.insert(shown.begin(), std::move(tree));
  }
  record.tree["requests"] = requests.summary();
  record.tree["requests"]["unanswered"] = unanswered;
  record.tree["requests"]["messages"] = std::move(shown);
  shown = Tree::array();
  const auto& answersSent = replies.view.messages;
  for (auto i = answersSent.size() - std::min(last, answersSent.size()); i < answersSent.size();
       ++i)
    shown.push_back(describe(link, answersSent[i]));
  record.tree["replies"] = replies.summary();
  record.tree["replies"]["messages"] = std::move(shown);
}

void read(LinkRecord& record, const WitnessedLink& link, std::size_t last) {
  const auto image = SegmentImage::readOpen(link.file.get(), link.name, layout::SegmentKind::link);
  const auto& header = image.header();
  const auto& control = image.link();
  record.tree["clientState"] = tools::toString(value(control.clientState));
  record.tree["serverState"] = tools::toString(value(control.serverState));
  record.tree["queueSize"] = header.queueSize;
  record.tree["refused"] = value(control.clientRefused);
  if (!image.hasRings()) throw SegmentError(link.name + ": its rings do not fit its file");
  addMessages(record, link, Ring(image.requestSlots(), control.requests, value(control.clientSent)),
              Ring(image.replySlots(), control.replies, value(control.serverSent)), last);
}

}  // namespace

LinkRecord LinkRecord::of(const WitnessedLink& link, std::size_t last) {
  LinkRecord record;
  record.tree = {{"file", link.name}, {"client", link.client}, {"clientPid", link.clientPid}};
  try {
    read(record, link, last);
  } catch (const std::exception& error) {
    record.tree["problem"] = error.what();
  }
  return record;
}

}  // namespace mpf::crate
