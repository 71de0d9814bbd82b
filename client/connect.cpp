// SPDX-License-Identifier: MIT
// Binding: finds its server and makes the connection.
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

// A server counts as busy when it has worked on one request for at least this long.
constexpr std::int64_t kBusyNs = 20'000'000;

// The local time `agoNs` ago.
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
          fmt::format("bind: the client is already bound to server \"{}\"", server_));
    server_ = server;
    location_ = location;
    // PAIR(bound): server_ and location_, which the dispatcher's thread reads.
    bound_.store(true, std::memory_order_release);
  }
  setReason(fmt::format("server \"{}\" at location {} is not there yet", server, location));
}

std::string Binding::notConnectedBecause() const {
  if (isConnected()) return {};
  const std::lock_guard lock(reasonMutex_);
  return reason_;
}

void Binding::setReason(const std::string& reason) {
  const std::lock_guard lock(reasonMutex_);
  reason_ = reason;
}

bool Binding::waitConnected(Deadline deadline) {
  std::unique_lock lock(reasonMutex_);
  const auto connected = [this] { return isConnected(); };
  if (deadline.isNever()) {
    connectedChanged_.wait(lock, connected);
    return true;
  }
  return connectedChanged_.wait_for(lock, deadline.left(), connected);
}

void Binding::tryConnect() try {
  // Another thread in bind(), or a callback that ran the dispatcher, may have connected already.
  if (channel_ || left_) return;
  auto& endpoint = dispatcher_.endpoint();
  const auto& backplane = endpoint.backplane().name();
  auto server = endpoint.peers().tryOpen(SegmentName::serverWindow(backplane, location_, server_),
                                         layout::SegmentKind::serverWindow);
  if (!server) return pendingBind();
  const auto index = endpoint.tryReserve();
  if (!index) {
    setReason(fmt::format("this process has {} clients on the backplane, which is the maximum",
                          layout::kMaxLinks));
    return wakeAt(Clock::nowNs() + kRetryNs);
  }
  index_ = *index;
  try {
    makeChannel(server);
  } catch (...) {
    endpoint.detach(index_);  // else each failed attempt would use up an index
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
  // No memory, no permission, a window of another version: report the reason and try again later.
  setReason(error.what());
  wakeAt(Clock::nowNs() + kRetryNs);
}

// The shortage at the server that keeps it from accepting the client; empty when it reports none.
std::string Binding::shortageAt(const layout::WindowControl& server) const {
  switch (server.shortage.load(std::memory_order_relaxed)) {
    case layout::Shortage::descriptors:
      return fmt::format(
          "server \"{}\" cannot accept the client: its process has no file descriptor left; "
          "restart it with a higher limit (ulimit -n)",
          server_);
    case layout::Shortage::openFiles:
      return fmt::format(
          "server \"{}\" cannot accept the client: its host has the maximum number of open files; "
          "raise fs.file-max",
          server_);
    case layout::Shortage::memory:
      return fmt::format("server \"{}\" cannot accept the client: it has no memory left", server_);
    default:
      return {};
  }
}

// A server does not accept clients while it handles a request.
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
  endpoint.window().admit(Link::rightsAt(*server));  // the server writes hints into this window
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

// Publishes the name of the missing server, for tools, and watches for new servers.
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
  MPF_STEP(pending_bind_named);
  pendingBind.closeFile();
  pendingBind_ = std::move(pendingBind);
}

}  // namespace mpf
