// SPDX-License-Identifier: MIT
// RoguePeer: one end of a TCP connection to a router, and what it sends there made by hand.
// RogueHost: where routers call one.
//
//   RoguePeer peer(routers.address());      // as a client router
//   peer.sendItems({greeting()});
//   peer.sendItems({...});
//   EXPECT_THAT(peer.farewell(), HasSubstr("code = protocol"));
//
// Threads  one.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <capnp/serialize.h>
#include <kj/io.h>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"
#include "router/transport/kj_text.h"
#include "tests/router/frames.h"

namespace mpf::test {

class RoguePeer {
 public:
  // Calls a router at "127.0.0.1:PORT".
  explicit RoguePeer(const std::string& address)
      : RoguePeer(FileDescriptor(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0))) {
    const auto colon = address.find(':');
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(colon + 1))));
    ::inet_pton(AF_INET, address.substr(0, colon).c_str(), &to.sin_addr);
    checkCall(::connect(socket_.get(), reinterpret_cast<sockaddr*>(&to), sizeof to), "connect");
  }
  explicit RoguePeer(FileDescriptor socket) : socket_(std::move(socket)) {}

  // False: the other side has closed.
  bool send(std::span<const std::uint8_t> bytes) {
    while (!bytes.empty()) {
      const auto sent = retryInterrupted(
          [&] { return ::send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL); });
      if (sent <= 0) return false;
      bytes = bytes.subspan(static_cast<std::size_t>(sent));
    }
    return true;
  }
  bool sendItems(const std::vector<Fill>& items) { return send(frameOf(items)); }

  // The next item, until the one after it is asked for; nullopt at the end.
  std::optional<wire::Item::Reader> next() {
    while (!frame_ || at_ == itemsOf(*frame_).size()) {
      if (!readFrame()) return std::nullopt;
    }
    return itemsOf(*frame_)[at_++];
  }
  // The next item of this kind; others are skipped, and pings answered. Throws std::runtime_error
  // at the end.
  wire::Item::Reader next(wire::Item::Which kind) {
    while (auto item = next()) {
      if (item->which() == kind) return *item;
      if (item->isPing())
        sendItems({[stamp = item->getPing().getStamp()](wire::Item::Builder pong) {
          pong.initPong().setStamp(stamp);
        }});
      if (item->isFarewell()) throw std::runtime_error(router::toStd(kj::str(*item)));
    }
    throw std::runtime_error("the router has closed");
  }
  // Whether next() has something to return, or to wait for a little; or will have, so many
  // milliseconds later.
  [[nodiscard]] bool hasNews(int waitMs = 0) const {
    pollfd readable{socket_.get(), POLLIN, 0};
    return (frame_ && at_ != itemsOf(*frame_).size()) || ::poll(&readable, 1, waitMs) > 0;
  }
  // Everything until the end; returns the farewell as text, or "none".
  std::string farewell() {
    std::string last = "none";
    while (auto item = next()) {
      if (item->isFarewell()) last = router::toStd(kj::str(*item));
    }
    return last;
  }
  // Sends a byte at a time, slowly, until the router closes; returns its farewell as text, or
  // "none".
  std::string drip(std::span<const std::uint8_t> bytes) {
    constexpr int kPauseMs = 2;
    std::string last = "none";
    for (; !bytes.empty() && send(bytes.first(1)); bytes = bytes.subspan(1)) {
      while (hasNews(kPauseMs)) {
        const auto item = next();
        if (!item) return last;
        if (item->isFarewell()) last = router::toStd(kj::str(*item));
      }
    }
    return last;
  }
  // The router finds the end of what has come, and may still speak.
  void sendNoMore() { checkCall(::shutdown(socket_.get(), SHUT_WR), "shutdown"); }
  // From any thread: no more either way.
  void hangUp() noexcept { ::shutdown(socket_.get(), SHUT_RDWR); }
  void close() { socket_.reset(); }

 private:
  static capnp::List<wire::Item>::Reader itemsOf(capnp::MessageReader& frame) {
    return frame.getRoot<wire::Frame>().getItems();
  }
  bool readFrame() try {
    at_ = 0;
    frame_.reset();
    frame_ = std::make_unique<capnp::StreamFdMessageReader>(
        socket_.get(), capnp::ReaderOptions{.traversalLimitInWords = UINT64_MAX});
    return true;
  } catch (const kj::Exception&) {  // the end, by close or reset
    return false;
  }

  FileDescriptor socket_;
  std::unique_ptr<capnp::StreamFdMessageReader> frame_;
  capnp::uint at_ = 0;
};

class RogueHost {
 public:
  RogueHost() : socket_(checkCall(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0), "socket")) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t length = sizeof address;
    checkCall(::bind(socket_.get(), reinterpret_cast<sockaddr*>(&address), length), "bind");
    checkCall(::listen(socket_.get(), 16), "listen");
    checkCall(::getsockname(socket_.get(), reinterpret_cast<sockaddr*>(&address), &length),
              "getsockname");
    address_ = "127.0.0.1:" + std::to_string(ntohs(address.sin_port));
  }
  [[nodiscard]] const std::string& address() const noexcept { return address_; }
  // The router's next call.
  [[nodiscard]] RoguePeer accept() {
    return RoguePeer(FileDescriptor(
        checkCall(::accept4(socket_.get(), nullptr, nullptr, SOCK_CLOEXEC), "accept")));
  }

 private:
  FileDescriptor socket_;
  std::string address_;
};

}  // namespace mpf::test
