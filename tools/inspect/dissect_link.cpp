// SPDX-License-Identifier: MIT
#include "tools/inspect/dissect_link.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fmt/format.h>

#include <mpf/file_descriptor.h>

#include "schema/json.h"
#include "schema/text.h"
#include "shm/segment.h"
#include "shm/segment_name.h"
#include "tools/inspect/ring_view.h"
#include "tools/report/snapshot.h"

namespace mpf::tools {
namespace {

using layout::SegmentHeader;

constexpr std::size_t kMostBody = std::size_t{16} << 20;  // larger bodies are not shown

template <class Word>
auto said(const Word& word) noexcept {
  return word.load(std::memory_order_relaxed);
}

// The paths of the pools of a link.
struct Beside {
  std::filesystem::path link;
  std::string backplane;
  std::uint64_t incarnation = 0;
  std::uint64_t serverWindow = 0;
  [[nodiscard]] std::string bulk(std::uint32_t side, std::uint32_t segment) const {
    return of(SegmentName::bulk(backplane, incarnation, side, segment));
  }
  [[nodiscard]] std::string fanOut(std::uint32_t segment) const {
    return of(SegmentName::fanOut(backplane, serverWindow, segment));
  }

 private:
  [[nodiscard]] std::string of(const std::string& name) const {
    return std::filesystem::path(link).replace_filename(name).string();
  }
};

// Reads the body of a message from its chunk. Throws SegmentError with the reason when it cannot.
std::vector<std::byte> readChunk(const Beside& beside, const layout::ChunkRef& ref,
                                 std::size_t bodyBytes) {
  const bool isFanOut = ref.side == layout::kFanOutSide;
  if (ref.side > 1 && !isFanOut)
    throw SegmentError(fmt::format(
        "a chunk of side {}; the sides of a link are 0 and 1, the fan-out pool is 2", ref.side));
  const auto path = isFanOut ? beside.fanOut(ref.segment) : beside.bulk(ref.side, ref.segment);
  const auto kind = isFanOut ? layout::SegmentKind::fanOut : layout::SegmentKind::bulk;
  const auto image = SegmentImage::tryReadFile(path);
  if (!image) throw SegmentError(path + ": the file does not exist");
  const auto& header = image->header();
  if (header.kind != kind || ref.chunk >= header.chunkCount || bodyBytes > header.chunkBytes) {
    throw SegmentError(fmt::format("{}: has no chunk {} of {} bytes", path, ref.chunk, bodyBytes));
  }
  if (bodyBytes > kMostBody)
    throw SegmentError(fmt::format("a body of {} bytes is too large to show", bodyBytes));
  std::vector<std::byte> body(bodyBytes);
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  const auto offset = layout::kBulkChunksOffset + ref.chunk * header.chunkBytes;
  if (!file || ::pread(file.get(), body.data(), body.size(), static_cast<off_t>(offset)) !=
                   static_cast<ssize_t>(body.size())) {
    throw SegmentError(fmt::format("{}: chunk {} is cut off", path, ref.chunk));
  }
  return body;
}

Tree dissectMessage(const RingMessage& message, const Beside& beside, bool raw) {
  const auto& slot = message.first.front();
  Tree tree{{"position", message.position},
            {"state", toString(message.state)},
            {"request_id", slot.requestId}};
  if (slot.deadlineNs != 0) tree["time_ns"] = slot.deadlineNs;
  tree["first_reply"] = (slot.flags & layout::kSlotFirstReply) != 0;
  auto body = message.inlineBody();
  try {
    if ((slot.flags & layout::kSlotChunk) != 0) {
      layout::ChunkRef ref{};
      std::memcpy(&ref, body.data(), sizeof ref);
      tree["chunk"] = {{"side", ref.side}, {"segment", ref.segment}, {"chunk", ref.chunk}};
      if (ref.side == layout::kFanOutSide) tree["missed"] = ref.missed;
      body = readChunk(beside, ref, slot.bodyBytes);
    } else if (slot.bodyBytes > body.size()) {
      throw SegmentError(fmt::format("{} bytes of body in {} slots", slot.bodyBytes,
                                     message.bytes.size() / sizeof(layout::Slot)));
    }
    body.resize(slot.bodyBytes);
    auto decoded = Message::copyOf(static_cast<MessageType>(slot.type), body);
    decoded.setClientType(slot.clientType);
    decoded.setClientExtra(slot.clientExtra);
    tree["text"] = print(decoded);
    tree["message"] = toJson(decoded);
  } catch (const std::exception& error) {
    tree["problem"] = error.what();
  }
  if (raw) tree["raw"] = hexDigits(message.bytes);
  return tree;
}

struct RingPlace {
  std::span<const layout::Slot> slots;
  std::span<const layout::Slot> laterSlots;
  const layout::RingControl& control;
  const layout::RingControl& laterControl;
  layout::Watch watch;
  std::uint64_t sent;
};

Tree dissectRing(const RingPlace& place, const Beside& beside, const DissectOptions& options) {
  const RingWords words{said(place.control.freed), said(place.control.taken), place.sent};
  const auto view =
      RingView::of(place.slots, words, place.laterSlots, said(place.laterControl.freed));
  Tree tree{{"slots", place.slots.size()},
            {"sent", words.sent},
            {"taken", words.taken},
            {"waiting", words.waiting()},
            {"freed", words.freed},
            {"end", view.end},
            {"polled", place.watch != layout::Watch::unwatched}};
  if (view.overwritten != 0) tree["overwritten"] = view.overwritten;
  tree["messages"] = Tree::array();
  const auto skipped = view.messages.size() - std::min(view.messages.size(), options.last);
  for (std::size_t i = skipped; i < view.messages.size(); ++i) {
    tree["messages"].push_back(dissectMessage(view.messages[i], beside, options.raw));
  }
  return tree;
}

Tree dissectPool(std::uint32_t side, const layout::ReturnRing& returns, const Beside& beside) {
  Tree tree{{"returned", said(returns.returned)}};
  auto segments = Tree::array();
  for (std::uint32_t number = 0; number < layout::kMaxBulks; ++number) {
    const auto path = beside.bulk(side, number);
    try {
      const auto image = SegmentImage::tryReadFile(path);
      if (!image) break;
      segments.push_back({{"file", path},
                          {"chunk_count", image->header().chunkCount},
                          {"chunk_bytes", image->header().chunkBytes}});
    } catch (const std::exception& error) {
      segments.push_back({{"file", path}, {"problem", error.what()}});
    }
  }
  tree["segments"] = std::move(segments);
  return tree;
}

}  // namespace

std::string hexDigits(std::span<const std::byte> bytes) {
  std::string text;
  text.reserve(2 * bytes.size());
  for (const auto byte : bytes)
    fmt::format_to(std::back_inserter(text), "{:02x}", std::to_integer<unsigned>(byte));
  return text;
}

void dissectLink(Tree& tree, const SegmentImage& image, const std::string& path,
                 const DissectOptions& options) {
  const auto& header = image.header();
  const auto& control = image.link();
  const auto sent = said(control.clientSent);
  tree["server"] = segments::text(header.name);
  tree["location"] = header.location;
  tree["server_side"] = {{"window", hex(header.serverWindow)},
                         {"state", toString(said(control.serverState))},
                         {"index", said(control.serverIndex)},
                         {"sent", said(control.serverSent)}};
  tree["client_side"] = {{"window", hex(header.clientWindow)},
                         {"state", toString(said(control.clientState))},
                         {"index", header.clientIndex},
                         {"sent", sent},
                         {"refused", said(control.clientRefused)},
                         {"unanswered", sent - std::min(sent, said(control.clientAnswered))}};
  tree["limits"] = {{"queue_size", header.queueSize},
                    {"max_outstanding", header.maxOutstanding},
                    {"max_message_bytes", header.maxMessageBytes},
                    {"max_pool_bytes", header.maxPoolBytes}};
  const Beside beside{path, segments::text(header.backplane), header.incarnation,
                      header.serverWindow};
  if (!image.hasRings()) {
    tree["problem"] =
        fmt::format("rings of {}, {} and {} slots do not fit a file of {} bytes", header.queueSlots,
                    header.replySlots, header.moreReplySlots, image.bytes().size());
    return;
  }
  try {
    SegmentName::checkBackplane(beside.backplane);
  } catch (const std::exception& error) {
    tree["problem"] = error.what();
    return;
  }
  // A second copy shows which messages were overwritten while the first copy was made.
  auto again = SegmentImage::tryReadFile(path);
  const bool isComparable = again && again->bytes().size() == image.bytes().size() &&
                            again->hasRings() &&
                            again->requestSlots().size() == image.requestSlots().size() &&
                            again->replySlots().size() == image.replySlots().size();
  const auto& later = isComparable ? *again : image;
  tree["requests"] =
      dissectRing({image.requestSlots(), later.requestSlots(), control.requests,
                   later.link().requests, control.requestWatch, said(control.clientSent)},
                  beside, options);
  tree["replies"] =
      dissectRing({image.replySlots(), later.replySlots(), control.replies, later.link().replies,
                   control.replyWatch, said(control.serverSent)},
                  beside, options);
  tree["client_pool"] = dissectPool(0, control.requestChunks, beside);
  tree["server_pool"] = dissectPool(1, control.replyChunks, beside);
}

}  // namespace mpf::tools
