// SPDX-License-Identifier: MIT
// Acceptor: accepts the clients of a server: those that knock, and those whose knock was lost.
//
//   knock ───────────┐
//   rescan ─ names ──┴─► map the link, check it ─► open          the client is connected
//                                               ├► refused       the endpoint has no free index
//                                               └► no memory...  a shortage; the client knocks again
//
// Threads  the server's thread.
// Crash    removes the link of a client that died before it was accepted.
// Trust    a link with invalid data is counted and ignored. Any user may fill /dev/shm with names
//          and request rescans: they use at most a tenth of the server's time.
#pragma once

#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <string>

#include "server/connections.h"
#include "shm/endpoint.h"

namespace mpf {

class Acceptor {
 public:
  Acceptor(Endpoint& endpoint, Connections& connections) noexcept
      : endpoint_(endpoint), connections_(connections) {}

  // MessageServer::onShortage().
  void onShortage(std::function<void(const std::string&)> callback) {
    onShortage_ = std::move(callback);
  }
  // Accepts the clients that have knocked, and searches for others if a rescan is due.
  void acceptAll();

 private:
  void rescan();
  void acceptFound();
  void accept(std::uint64_t incarnation);
  void tryAccept(std::uint64_t incarnation);
  void open(std::unique_ptr<Link> link);
  void noteFailure(const std::exception& error);
  void noteShortage(layout::Shortage shortage, const std::string& why);

  Endpoint& endpoint_;
  Connections& connections_;
  std::function<void(const std::string&)> onShortage_;
  std::int64_t rescanFromNs_ = 0;  // no rescan before this time
  bool isRescanDue_ = false;
};

}  // namespace mpf
