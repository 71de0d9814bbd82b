// SPDX-License-Identifier: MIT
#include "crate/capsule/capsule.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <fmt/chrono.h>
#include <fmt/format.h>

#include <mpf/clock.h>

#include "base/printable.h"
#include "base/signal_name.h"
#include "base/system_call.h"
#include "base/whole_file.h"
#include "crate/capsule/core_file.h"
#include "crate/capsule/link_record.h"
#include "schema/text.h"
#include "shm/handling.h"
#include "shm/histogram.h"
#include "shm/segment.h"
#include "tools/inspect/segment_image.h"
#include "tools/report/snapshot.h"

namespace mpf::crate {

using layout::WindowControl;
using tools::SegmentImage;
using tools::value;

namespace {

constexpr std::size_t kMostFileBytes = std::size_t{256} << 20;
constexpr int kMostDepth = 100;  // of its JSON; functions that show it are recursive

Tree describe(const layout::Histogram& histogram) {
  const auto latencies = tools::Latencies::of(histogram);
  Tree tree{{"count", latencies.count}};
  for (const auto percent : {50.0, 90.0, 99.0, 99.9})
    tree[fmt::format("p{}Ns", percent)] = latencies.percentileNs(percent);
  tree["maxNs"] = latencies.maxNs;
  return tree;
}

Tree countersOf(const WindowControl& control) {
  return {{"received", value(control.received)},
          {"sent", value(control.sent) + value(control.sentElsewhere)},
          {"replyQueueFull", value(control.replyQueueFull)},
          {"expired", value(control.expired)},
          {"refused", value(control.refused)},
          {"wakes", value(control.wakes)},
          {"linksOpened", value(control.linksOpened)},
          {"linksClosed", value(control.linksClosed)},
          {"peersDied", value(control.peersDied)},
          {"protocolErrors", value(control.protocolErrors)},
          {"alarms", value(control.alarms)}};
}

// Whether a request that was taken can be the one that the window names.
bool matches(const Tree& request, const Handling& handling) {
  if (request.at("type") != handling.type) return false;
  const auto message = request.find("message");
  if (message == request.end() || !message->contains("cmd")) return true;
  return message->at("cmd") == handling.cmd;
}

// The request that the server was handling. Its window names type and cmd; the link of which it is
// the last request that was taken names the rest. If several match, those without a reply are more
// probable.
Tree handlingOf(const Handling& handling, std::int64_t atMostNs,
                const std::vector<std::pair<Tree, Tree>>& taken) {
  Tree tree{{"type", toString(static_cast<MessageType>(handling.type))},
            {"cmd", handling.cmd},
            {"forAtMostNs", atMostNs}};
  auto candidates = Tree::array();
  for (const auto* const wanted : {"no", "unknown", "yes"}) {
    for (const auto& [link, request] : taken) {
      if (!matches(request, handling) || request.at("answered") != wanted) continue;
      auto candidate = link;
      candidate["request"] = request;
      candidates.push_back(std::move(candidate));
    }
    if (!candidates.empty()) break;
  }
  tree["candidates"] = std::move(candidates);
  return tree;
}

void readWindow(Tree& tree, const WitnessedWindow& window, const CapsuleLimits& limits) {
  const auto image = SegmentImage::readOpen(
      window.file.get(), window.name, layout::SegmentKind::serverWindow, layout::kWindowBytes);
  const auto& header = image.header();
  const auto& control = image.window();
  tree["name"] = segments::text(header.name);
  tree["location"] = header.location;
  tree["program"] = segments::text(header.program);
  tree["queueSize"] = value(control.queueSize);
  tree["counters"] = countersOf(control);
  tree["queueWait"] = describe(control.queueWaitNs);
  tree["service"] = describe(control.serviceNs);
  tree["handling"] = nullptr;
  auto links = Tree::array();
  std::vector<std::pair<Tree, Tree>> taken;
  const auto rings = std::max<std::size_t>(1, 2 * window.links.size());
  const auto last = std::max<std::size_t>(1, std::min(limits.messages, limits.allMessages / rings));
  for (const auto& [incarnation, link] : window.links) {
    auto record = LinkRecord::of(link, last);
    if (record.lastTaken)
      taken.emplace_back(Tree{{"client", link.client}, {"clientPid", link.clientPid}},
                         std::move(*record.lastTaken));
    links.push_back(std::move(record.tree));
  }
  if (const auto handling = Handling::of(value(control.handling))) {
    const auto since = static_cast<std::int64_t>(value(control.progressAtNs));
    tree["handling"] =
        handlingOf(*handling, std::max<std::int64_t>(0, Clock::nowNs() - since), taken);
  }
  tree["linksLeftOut"] = window.linksLeftOut;
  tree["links"] = std::move(links);
}

Tree describe(const Cause& cause) {
  Tree tree{{"kind", toString(cause.kind)}};
  if (cause.kind == CauseKind::exit) tree["status"] = cause.number;
  if (cause.kind != CauseKind::signal) return tree;
  tree["signal"] = cause.number;
  tree["name"] = signalName(cause.number);
  return tree;
}

// The last `limit` bytes of the log.
Tree endOfLog(const std::string& path, std::size_t limit) {
  Tree tree{{"file", path}};
  if (path.empty()) return nullptr;
  try {
    const auto end = readEndOfFile(path, limit);
    tree["leftOutBytes"] = end.leftOutBytes;
    tree["text"] = printableLines(end.text);
  } catch (const std::exception& error) {
    tree["problem"] = error.what();
  }
  return tree;
}

std::string hostName() {
  std::array<char, 256> name{};
  ::gethostname(name.data(), name.size() - 1);
  return name.data();
}

}  // namespace

const char* toString(CauseKind kind) noexcept {
  constexpr std::array<const char*, 6> kNames{"signal", "exit",      "stalled",
                                              "busy",   "restarted", "unknown"};
  return kNames[static_cast<std::size_t>(kind)];
}

Cause Cause::ofWaitStatus(int status) noexcept {
  if (WIFSIGNALED(status)) return {CauseKind::signal, WTERMSIG(status), WCOREDUMP(status) != 0};
  if (WIFEXITED(status)) return {.kind = CauseKind::exit, .number = WEXITSTATUS(status)};
  return {};
}

nlohmann::ordered_json capsuleOf(const Death& death, const WitnessedProcess* witnessed,
                                 const CapsuleLimits& limits) {
  const auto now = std::chrono::system_clock::now();
  Tree tree{{"mpfCapsule", kCapsuleVersion},
            {"at", fmt::format("{:%FT%TZ}", std::chrono::floor<std::chrono::milliseconds>(now))},
            {"host", hostName()},
            {"crate", death.crate},
            {"process", death.process},
            {"command", death.command},
            {"folder", death.folder},
            {"pid", death.pid},
            {"upNs", std::max<std::int64_t>(0, Clock::nowNs() - death.startedNs)},
            {"restarts", death.restarts},
            {"cause", describe(death.cause)},
            {"core", nullptr}};
  if (death.cause.hasCore) tree["core"] = describeCore({death.pid, death.folder}, limits.coreTime);
  auto servers = Tree::array();
  if (witnessed != nullptr) {
    for (const auto& [incarnation, window] : witnessed->windows) {
      Tree server{{"file", window.name}};
      try {
        readWindow(server, window, limits);
      } catch (const std::exception& error) {
        server["problem"] = printable(error.what());
      }
      servers.push_back(std::move(server));
    }
  }
  tree["servers"] = std::move(servers);
  tree["log"] = endOfLog(death.log, limits.logBytes);
  return tree;
}

nlohmann::ordered_json readCapsule(const std::string& path) {
  const FileDescriptor file(
      checkCall(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK), "open", path));
  struct stat status{};
  checkCall(::fstat(file.get(), &status), "look at", path);
  if (!S_ISREG(status.st_mode)) throw std::runtime_error(path + ": not a file");
  const auto size = static_cast<std::size_t>(status.st_size);
  if (size > kMostFileBytes)
    throw std::runtime_error(fmt::format("{}: {} bytes are too many for a capsule", path, size));
  std::string text(size, '\0');
  text.resize(static_cast<std::size_t>(
      checkCall(::pread(file.get(), text.data(), text.size(), 0), "read", path)));
  try {
    auto tree = Tree::parse(text, [&](int depth, Tree::parse_event_t, Tree&) {
      if (depth > kMostDepth)
        throw std::runtime_error(
            fmt::format("{}: not a capsule, or damaged: more than {} nested lists and objects",
                        path, kMostDepth));
      return true;
    });
    const auto version = tree.at("mpfCapsule").get<int>();
    if (version != kCapsuleVersion) {
      throw std::runtime_error(fmt::format("{}: a capsule of version {}; this program reads {}",
                                           path, version, kCapsuleVersion));
    }
    return tree;
  } catch (const Tree::exception& error) {
    throw std::runtime_error(
        fmt::format("{}: not a capsule, or damaged: {}", path, printable(error.what())));
  }
}

}  // namespace mpf::crate
