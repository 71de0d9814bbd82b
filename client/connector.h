// SPDX-License-Identifier: MIT
// Connector: finds the server of a binding, creates the link to it, and states why the client is
// not connected.
//
// Threads  the dispatcher's thread, unless a comment says: any thread.
// Crash    a failed attempt leaves no segment and no index in use; the timer starts the next one.
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include <mpf/clock.h>

#include "client/binding_timer.h"
#include "client/dispatcher_parts.h"
#include "client/request_sender.h"
#include "shm/process_condition.h"

namespace mpf {

class Connector {
 public:
  Connector(DispatcherParts& parts, BindingTimer& timer) noexcept : parts_(parts), timer_(timer) {}

  // --- any thread ---
  //   throws  std::invalid_argument for an invalid name; std::logic_error when a server is set
  void setServer(const std::string& server, std::int32_t location);
  [[nodiscard]] std::string notConnectedBecause() const;
  // Waits until `isConnected` returns true, which is checked after each notifyConnected().
  template <class IsConnected>
  bool wait(Deadline deadline, const IsConnected& isConnected) {
    std::unique_lock lock(mutex_);
    if (!deadline.isNever()) return connected_.get().wait_for(lock, deadline.left(), isConnected);
    connected_.get().wait(lock, isConnected);
    return true;
  }

  // --- dispatcher's thread, after setServer() ---
  [[nodiscard]] const std::string& server() const noexcept { return server_; }
  [[nodiscard]] std::int32_t location() const noexcept { return location_; }
  // The server's window. Returns nullptr when there is no such server, and then watches for its
  // name and publishes a pending bind.
  std::shared_ptr<PeerWindow> tryFindServer();
  // Opens a new link to `server`. Returns false when the process has no index left; then a retry is
  // due later.
  [[nodiscard]] bool tryOpenLink(const std::shared_ptr<PeerWindow>& server, RequestSender& sender);
  // Asks the server to accept the new link, whose messages `user` handles.
  void askForAcceptance(Link& link, LinkUser& user);
  // As askForAcceptance(), again: the server may have missed it.
  void askAgain(Link& link);
  // Ends the link and removes its segments.
  void closeLink(RequestSender& sender);
  void cancelPendingBind();
  void retryLater() noexcept;

  //   remedy   appended: what to do about it
  void setReason(std::string_view reason, std::string_view remedy = {}) noexcept;
  void notifyConnected();
  // Of the present or the last link.
  [[nodiscard]] std::uint32_t index() const noexcept { return index_; }
  // Of the server of that link.
  [[nodiscard]] std::uint64_t incarnation() const noexcept { return incarnation_; }

 private:
  void publishPendingBind();
  [[nodiscard]] std::string notAcceptedBecause(const PeerWindow& server) const;

  DispatcherParts& parts_;
  BindingTimer& timer_;
  std::string server_;  // written once, by setServer()
  std::int32_t location_ = 0;  // likewise
  std::uint32_t index_ = 0;
  std::uint64_t incarnation_ = 0;
  std::unique_ptr<Segment> pendingBind_;  // while the client waits for a server
  mutable std::mutex mutex_;
  ProcessCondition connected_;
  std::string reason_ = "not bound to a server yet";  // under mutex_; empty while connected
};
// A router has one for each remote client.
static_assert(sizeof(Connector) <= 160 + sizeof(std::mutex));

}  // namespace mpf
