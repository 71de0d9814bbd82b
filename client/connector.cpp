// SPDX-License-Identifier: MIT
#include "client/connector.h"

#include <time.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <ctime>
#include <fmt/format.h>
#include <new>
#include <stdexcept>
#include <utility>

#include "base/step.h"
#include "shm/handling.h"
#include "shm/histogram.h"
#include "shm/segment_name.h"
#include "shm/shortage.h"

namespace mpf {
namespace {

// A server counts as busy when it has worked on one request for at least this long.
constexpr std::int64_t kBusyNs = 20'000'000;

constexpr std::int64_t kRetryNs = 1'000'000'000;

// Location 0 is that of this host, unless routers are configured in another way.
std::string absentText(const std::string& server, std::int32_t location) {
  return fmt::format("server \"{}\" at location {} is not running{}", server, location,
                     location == 0 ? "" : " or not reachable");
}

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

void Connector::setServer(const std::string& server, std::int32_t location) {
  SegmentName::checkServer(server);
  auto reason = absentText(server, location);
  const std::lock_guard lock(mutex_);
  if (!server_.empty())
    throw std::logic_error(
        fmt::format("bind: the client is already bound to server \"{}\"", server_));
  server_ = server;
  location_ = location;
  reason_ = std::move(reason);
}

std::string Connector::notConnectedBecause() const {
  const std::lock_guard lock(mutex_);
  return reason_;
}

void Connector::setReason(std::string_view reason, std::string_view remedy) noexcept {
  const std::lock_guard lock(mutex_);
  try {
    reason_ = reason;
    reason_ += remedy;
  } catch (const std::bad_alloc&) {
    reason_ = "no memory";  // short enough to need none
  }
}

void Connector::notifyConnected() {
  const std::lock_guard lock(mutex_);
  std::string().swap(reason_);  // frees its memory
  connected_.get().notify_all();
}

void Connector::retryLater() noexcept { timer_.wakeAt(Clock::nowNs() + kRetryNs); }

std::shared_ptr<PeerWindow> Connector::tryFindServer() {
  auto& endpoint = parts_.endpoint;
  auto server = endpoint.peers().tryOpen(
      SegmentName::serverWindow(endpoint.backplane().name(), location_, server_),
      layout::SegmentKind::serverWindow);
  // A dead server, whose window is still locked and cannot be removed, is not tried again at once.
  if (server && server->header().incarnation == incarnation_ && !server->hasOwner()) {
    server.reset();
    retryLater();
  }
  if (!server) publishPendingBind();
  return server;
}

bool Connector::tryOpenLink(const std::shared_ptr<PeerWindow>& server, RequestSender& sender) {
  auto& endpoint = parts_.endpoint;
  const auto index = endpoint.tryReserve();
  if (!index) {
    setReason(fmt::format("this process has {} clients on the backplane, which is the maximum",
                          layout::kMaxLinks));
    retryLater();
    return false;
  }
  try {
    endpoint.window().admit(Link::rightsAt(*server));  // the server writes hints into this window
    auto link = Link::create(endpoint.backplane().name(), endpoint.window(), *index, server);
    auto channel = MessageLink::make(std::move(link), sender.lock());
    sender.open(std::move(channel));
  } catch (...) {
    endpoint.detach(*index);  // else each failed attempt would use up an index
    throw;
  }
  index_ = *index;
  incarnation_ = server->header().incarnation;
  MPF_STEP(link_created);
  return true;
}

void Connector::askForAcceptance(Link& link, LinkUser& user) {
  cancelPendingBind();
  parts_.endpoint.attach(index_, link, user);
  link.peer()->knock(link.header().incarnation);
  setReason(notAcceptedBecause(*link.peer()));
}

void Connector::askAgain(Link& link) {
  link.peer()->knock(link.header().incarnation);
  setReason(notAcceptedBecause(*link.peer()));
  if (parts_.endpoint.window().isNameless())
    setReason(
        "the files of this process in /dev/shm were removed (by RemoveIPC of systemd-logind?), "
        "so no server can find this client: restart this process");
}

void Connector::closeLink(RequestSender& sender) {
  auto& link = sender.channel()->link();
  auto& endpoint = parts_.endpoint;
  MPF_STEP(requests_ended);
  const bool serverDied = link.peer()->isDead();
  if (serverDied) count(endpoint.control().peersDied);
  link.setState(layout::LinkState::closed);
  // The server may have accepted the link after the last look at its state.
  if (link.peerState() == layout::LinkState::open) link.usePeerIndexOfServer();
  if (!serverDied) link.notifyPeer();
  removeBulk(endpoint.backplane().name(), link.header().incarnation);
  MPF_STEP(bulk_removed);
  segments::remove(link.name());
  endpoint.detach(index_);
  count(endpoint.control().linksClosed);
  auto server = link.peer();
  sender.close();
  endpoint.peers().release(std::move(server));
}

// A server does not accept clients while it handles a request.
std::string Connector::notAcceptedBecause(const PeerWindow& server) const {
  const auto& control = server.control();
  const auto [lack, remedy] = textOf(control.shortage.load(std::memory_order_relaxed));
  if (*lack != '\0')
    return fmt::format("server \"{}\" cannot accept the client: {}; {}", server_, lack, remedy);
  const auto handling = Handling::of(control.handling.load(std::memory_order_relaxed));
  const auto sinceNs =
      static_cast<std::int64_t>(control.progressAtNs.load(std::memory_order_relaxed));
  const auto nowNs = Clock::nowNs();
  const auto busyNs = nowNs - std::clamp<std::int64_t>(sinceNs, 0, nowNs);  // the server's claim
  if (!handling || busyNs < kBusyNs)
    return fmt::format("server \"{}\" has not accepted the client yet", server_);
  return fmt::format(
      "server \"{}\" is busy with a request, {} cmd={}, since {}, and has not accepted the client "
      "yet",
      server_, toString(static_cast<MessageType>(handling->type)), handling->cmd, timeText(busyNs));
}

// Publishes the name of the missing server, for tools, and watches for new servers.
void Connector::publishPendingBind() {
  setReason(absentText(server_, location_));
  parts_.names.start();
  if (pendingBind_) return;
  auto& endpoint = parts_.endpoint;
  auto pendingBind = std::make_unique<Segment>(
      Segment::create(layout::kHeaderBytes, layout::SegmentKind::pendingBind,
                      endpoint.backplane().name(), kReadableByAll));
  auto& header = pendingBind->sharedHeader();
  header.ownerWindow = endpoint.window().header().incarnation;
  header.location = location_;
  server_.copy(header.name.data(), header.name.size() - 1);
  static_cast<void>(pendingBind->tryPublish(
      SegmentName::keyed(endpoint.backplane().name(), NameKind::pendingBind, header.incarnation)));
  MPF_STEP(pending_bind_named);
  pendingBind->closeFile();
  pendingBind_ = std::move(pendingBind);
}

void Connector::cancelPendingBind() {
  if (pendingBind_) segments::remove(pendingBind_->name());
  pendingBind_.reset();
}

}  // namespace mpf
