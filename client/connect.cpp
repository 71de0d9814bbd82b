// SPDX-License-Identifier: MIT
// Binding, continued: to whom, and how it gets there.
#include <time.h>

#include <array>
#include <chrono>
#include <ctime>
#include <fmt/format.h>
#include <mutex>
#include <utility>

#include "base/step.h"
#include "client/binding.h"
#include "client/dispatcher_impl.h"
#include "shm/handling.h"
#include "shm/segment_name.h"

namespace mpf {

namespace {

constexpr std::int64_t kBusyNs = 20'000'000;

// The local time so long ago.
std::string timeText(std::int64_t agoNs) {
  const auto when = std::chrono::system_clock::now() - std::chrono::nanoseconds(agoNs);
  const auto seconds = std::chrono::system_clock::to_time_t(when);
  std::tm local{};
  ::localtime_r(&seconds, &local);
  std::array<char, 32> text{};
  return {text.data(), std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M:%S", &local)};
}

}  // namespace

void Binding::setServer(const std::string& server, std::int32_t location) {
  SegmentName::checkServer(server);
  {
    const std::lock_guard lock(reasonMutex_);
    if (isBound())
      throw std::logic_error(
          fmt::format("bind: the client is bound to server \"{}\" already", server_));
    server_ = server;
    location_ = location;
    // PAIR(bound): whom to, which the dispatcher's thread looks at.
    bound_.store(true, std::memory_order_release);
  }
  setReason(fmt::format("server \"{}\" at location {} is not there yet", server, location));
}

void Binding::tryConnect() try {
  // somebody was quicker: another thread's bind(), a callback that ran the dispatcher
  if (channel_ || left_) return;
  auto& endpoint = dispatcher_.endpoint();
  const auto& backplane = endpoint.backplane().name();
  auto server = endpoint.peer(SegmentName::serverWindow(backplane, location_, server_),
                              layout::SegmentKind::serverWindow);
  if (!server) return pendingBind();
  const auto index = endpoint.tryReserve();
  if (!index) {
    setReason(fmt::format("this process has {} clients on the backplane, no more are possible",
                          layout::kMaxLinks));
    return wakeAt(Clock::nowNs() + kRetryNs);
  }
  index_ = *index;
  try {
    makeChannel(server);
  } catch (...) {
    endpoint.detach(index_);  // or each attempt would cost one
    throw;
  }
  auto& created = channel_->link();
  incarnation_ = server->header().incarnation;
  MPF_STEP(link_created);
  if (pendingBind_) segments::remove(pendingBind_.name());
  pendingBind_ = {};
  endpoint.attach(index_, created);
  setReason(notAcceptedBecause(*server));
  server->knock(created.header().incarnation);
  knockedNs_ = Clock::nowNs();
  nudgeEveryNs_ = kFirstNudgeNs;
  wakeAt(knockedNs_ + nudgeEveryNs_);
} catch (const std::exception& error) {
  // No memory, no right, a window of another version: the reason is told, and it is tried again.
  setReason(error.what());
  wakeAt(Clock::nowNs() + kRetryNs);
}

// Why a server that lacks something does not accept the client; empty when it lacks nothing.
std::string Binding::shortageAt(const layout::WindowControl& server) const {
  switch (server.shortage.load(std::memory_order_relaxed)) {
    case layout::Shortage::descriptors:
      return fmt::format(
          "server \"{}\" cannot accept the client: its process has no file descriptor left; "
          "start it with a higher limit (ulimit -n)",
          server_);
    case layout::Shortage::openFiles:
      return fmt::format(
          "server \"{}\" cannot accept the client: its host has no open file left; raise "
          "fs.file-max",
          server_);
    case layout::Shortage::memory:
      return fmt::format("server \"{}\" cannot accept the client: it has no memory left", server_);
    default:
      return {};
  }
}

// A server that works on a request accepts nobody meanwhile.
std::string Binding::notAcceptedBecause(const PeerWindow& server) const {
  const auto& control = server.control();
  if (auto shortage = shortageAt(control); !shortage.empty()) return shortage;
  const auto handling = Handling::of(control.handling.load(std::memory_order_relaxed));
  const auto sinceNs =
      static_cast<std::int64_t>(control.progressAtNs.load(std::memory_order_relaxed));
  const auto busyNs = Clock::nowNs() - sinceNs;
  if (!handling || server.header().layoutMinor < Handling::kSinceMinor || busyNs < kBusyNs) {
    return fmt::format("server \"{}\" has not accepted the client yet", server_);
  }
  return fmt::format(
      "server \"{}\" is busy with a request, {} cmd={}, since {}, and has not accepted the client "
      "yet",
      server_, toString(static_cast<MessageType>(handling->type)), handling->cmd, timeText(busyNs));
}

void Binding::makeChannel(const std::shared_ptr<PeerWindow>& server) {
  auto& endpoint = dispatcher_.endpoint();
  endpoint.window().admit(Link::rightsAt(*server));  // it writes our hints
  auto link = Link::create(endpoint.backplane().name(), endpoint.window(), index_, server);
  auto requests = std::make_shared<RequestTable>(link->header().maxOutstanding,
                                                 requests_ ? requests_->lastId() : 0);
  auto channel = std::make_shared<MessageLink>(std::move(link), lock_);
  dispatcher_.setLink(index_, this);
  const std::lock_guard lock(*lock_);
  requests_ = std::move(requests);
  channel_ = std::move(channel);
  nudging_ = true;
}

// Shows whom we wait for, and has us told when a server appears.
void Binding::pendingBind() {
  setReason(fmt::format("server \"{}\" at location {} is not there", server_, location_));
  dispatcher_.waitForNames(true);
  if (pendingBind_) return;
  auto& endpoint = dispatcher_.endpoint();
  auto pendingBind =
      Segment::create(sizeof(layout::SegmentHeader), layout::SegmentKind::pendingBind,
                      endpoint.backplane().name(), {0644, ~std::uint32_t{0}});
  auto& header = pendingBind.sharedHeader();
  header.ownerWindow = endpoint.window().header().incarnation;
  header.location = location_;
  server_.copy(header.name.data(), header.name.size() - 1);
  static_cast<void>(pendingBind.tryPublish(
      SegmentName::keyed(endpoint.backplane().name(), NameKind::pendingBind, header.incarnation)));
  MPF_STEP(wish_named);
  pendingBind.closeFile();
  pendingBind_ = std::move(pendingBind);
}

}  // namespace mpf
