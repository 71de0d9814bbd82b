// SPDX-License-Identifier: MIT
#include "tools/inspect/dissect.h"

#include <ctime>
#include <filesystem>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <utility>

#include "shm/segment.h"
#include "shm/segment_name.h"
#include "tools/inspect/dissect_link.h"
#include "tools/inspect/segment_image.h"
#include "tools/report/router_json.h"
#include "tools/report/snapshot.h"

namespace mpf::tools {
namespace {

using layout::SegmentHeader;
using layout::SegmentKind;

template <class Word>
auto now(const Word& word) noexcept {
  return word.load(std::memory_order_relaxed);
}

const char* kindName(SegmentKind kind) noexcept {
  constexpr std::array<const char*, 9> kNames{"unknown",      "server window", "client window",
                                              "hints",        "link",          "bulk",
                                              "pending bind", "router",        "fan-out"};
  const auto number = static_cast<std::size_t>(kind);
  return number < kNames.size() ? kNames[number] : kNames[0];
}

std::string timeText(std::int64_t realtimeNs) {
  const auto seconds = static_cast<std::time_t>(realtimeNs / 1'000'000'000);
  std::tm utc{};
  return ::gmtime_r(&seconds, &utc) == nullptr ? "unknown"
                                               : fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", utc);
}

Tree treeOf(const SegmentImage& image, const std::string& path) {
  const auto& header = image.header();
  return {{"file", path},
          {"kind", kindName(header.kind)},
          {"layout", fmt::format("{}.{}", header.layoutMajor, header.layoutMinor)},
          {"bytes", image.fileBytes()},
          {"backplane", segments::text(header.backplane)},
          {"incarnation", hex(header.incarnation)},
          {"created", timeText(header.createdRealtimeNs)},
          {"owner",
           {{"pid", header.ownerPid},
            {"program", segments::text(header.program)},
            {"user", header.ownerUid},
            {"window", hex(header.ownerWindow)},
            {"start_ticks", header.ownerStartTicks},
            {"pid_namespace", header.pidNamespace}}}};
}

std::string windowStateText(layout::WindowState state) {
  if (state == layout::WindowState::open) return "open";
  if (state == layout::WindowState::closed) return "closed";
  return fmt::format("unknown {}", static_cast<std::uint32_t>(state));
}

Tree offerOf(const SegmentHeader& header) {
  return {{"queue_size", header.queueSize},
          {"max_message_bytes", header.maxMessageBytes},
          {"max_pool_bytes", header.maxPoolBytes},
          {"link_mode", fmt::format("{:04o}", header.linkMode)},
          {"link_group", static_cast<std::int32_t>(header.linkGroup)},
          {"hops", header.hops}};
}

Tree controlOf(const layout::WindowControl& control) {
  return {{"state", windowStateText(now(control.state))},
          {"sleeping", toString(now(control.sleeping))},
          {"link_count", now(control.linkCount)},
          {"queue_size", now(control.queueSize)},
          {"progress_at_ns", now(control.progressAtNs)},
          {"handling", fmt::format("{:x}", now(control.handling))},
          {"received", now(control.received)},
          {"sent", now(control.sent)},
          {"sent_elsewhere", now(control.sentElsewhere)},
          {"reply_queue_full", now(control.replyQueueFull)},
          {"expired", now(control.expired)},
          {"refused", now(control.refused)},
          {"wakes", now(control.wakes)},
          {"links_opened", now(control.linksOpened)},
          {"links_closed", now(control.linksClosed)},
          {"peers_died", now(control.peersDied)},
          {"protocol_errors", now(control.protocolErrors)},
          {"alarms", now(control.alarms)}};
}

void dissectHints(Tree& tree, const layout::WindowHints& hints) {
  tree["bell"] = now(hints.bell);
  tree["knocked"] = now(hints.knocked);
  tree["rescan"] = now(hints.rescan) != 0;
  tree["knocks"] = Tree::array();
  for (const auto& knock : hints.knocks) {
    if (const auto link = now(knock); link != 0) tree["knocks"].push_back(hex(link));
  }
  tree["ready"] = Tree::array();
  for (std::size_t word = 0; word < hints.readyBits.size(); ++word) {
    const auto bits = now(hints.readyBits[word]);
    for (std::size_t bit = 0; bit < 64; ++bit) {
      if ((bits >> bit & 1u) != 0) tree["ready"].push_back(word * 64 + bit);
    }
  }
}

// The hints of a window, from the file in the same folder whose name the window's header implies.
Tree hintsBeside(const std::string& path, const SegmentHeader& header) try {
  const auto backplane = segments::text(header.backplane);
  SegmentName::checkBackplane(backplane);
  const auto name = SegmentName::keyed(backplane, NameKind::hints, header.incarnation);
  const auto beside = std::filesystem::path(path).replace_filename(name).string();
  return tryDissect(beside, {}).value_or(Tree{{"problem", beside + ": the file does not exist"}});
} catch (const std::exception& error) {
  return {{"problem", error.what()}};
}

void dissectWindow(Tree& tree, const SegmentImage& image, const std::string& path) {
  const auto& header = image.header();
  tree["name"] = segments::text(header.name);
  tree["location"] = header.location;
  tree["wait_mode"] = waitModeName(header.waitMode);
  if (header.kind == SegmentKind::serverWindow) tree["offers"] = offerOf(header);
  tree["control"] = controlOf(image.window());
  tree["hints"] = hintsBeside(path, header);
}

void dissectRouter(Tree& tree, const SegmentImage& image, const std::string& path) {
  tree["name"] = segments::text(image.header().name);
  tree["lines"] = Tree::array();
  for (const auto& line : routerLines(image, path)) {
    Tree entry{{"row", line.row}};
    addFacts(entry, line, toString(line.state));
    entry["since_ns"] = line.sinceNs;
    entry["locations"] = line.locations;
    tree["lines"].push_back(std::move(entry));
  }
}

}  // namespace

std::string hex(std::uint64_t incarnation) { return fmt::format("{:x}", incarnation); }

std::optional<Tree> tryDissect(const std::string& path, const DissectOptions& options) {
  const auto image = SegmentImage::tryReadFile(path);
  if (!image) return std::nullopt;
  auto tree = treeOf(*image, path);
  const auto& header = image->header();
  switch (header.kind) {
    case SegmentKind::serverWindow:
    case SegmentKind::clientWindow:
      dissectWindow(tree, *image, path);
      break;
    case SegmentKind::hints:
      dissectHints(tree, image->hints());
      break;
    case SegmentKind::link:
      dissectLink(tree, *image, path, options);
      break;
    case SegmentKind::bulk:
      tree["chunk_bytes"] = header.chunkBytes;
      tree["chunk_count"] = header.chunkCount;
      tree["side"] = header.bulkSide;
      break;
    case SegmentKind::fanOut:
      tree["chunk_bytes"] = header.chunkBytes;
      tree["server_window"] = hex(header.serverWindow);
      break;
    case SegmentKind::pendingBind:
      tree["server"] = segments::text(header.name);
      tree["location"] = header.location;
      break;
    case SegmentKind::router:
      dissectRouter(tree, *image, path);
      break;
    default:
      tree["problem"] = fmt::format("kind {} is unknown to this program",
                                    static_cast<std::uint32_t>(header.kind));
  }
  if (options.raw) {
    // The bytes of a link's slots are shown with the messages.
    const auto shown = header.kind == SegmentKind::link
                           ? std::min(image->bytes().size(), layout::kLinkRingsOffset)
                           : image->bytes().size();
    tree["raw"] = hexDigits(image->bytes().first(shown));
  }
  return tree;
}

}  // namespace mpf::tools
