// SPDX-License-Identifier: MIT
// RoguePeer: one end of a TCP connection to a router, with items that the test makes by hand.
// RogueHost: a listening address to which a router connects.
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
  // Connects to a router at "127.0.0.1:PORT".
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

  // Returns false when the router has closed the connection.
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

  // Returns the next item, valid until the next call; nullopt at the end of the connection.
  std::optional<wire::Item::Reader> next() {
    while (!frame_ || at_ == itemsOf(*frame_).size()) {
      if (!readFrame()) return std::nullopt;
    }
    return itemsOf(*frame_)[at_++];
  }
  // Returns the next item of this kind. Skips others, and answers pings. Throws std::runtime_error
  // at the end of the connection.
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
  // Whether data for next() has arrived, or arrives within `waitMs` milliseconds.
  [[nodiscard]] bool hasData(int waitMs = 0) const {
    pollfd readable{socket_.get(), POLLIN, 0};
    return (frame_ && at_ != itemsOf(*frame_).size()) || ::poll(&readable, 1, waitMs) > 0;
  }
  // Reads until the end of the connection; returns the farewell as text, or "none".
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
      while (hasData(kPauseMs)) {
        const auto item = next();
        if (!item) return last;
        if (item->isFarewell()) last = router::toStd(kj::str(*item));
      }
    }
    return last;
  }
  // Ends the data to the router; it may still send.
  void sendNoMore() { checkCall(::shutdown(socket_.get(), SHUT_WR), "shutdown"); }
  // Ends the data in both directions; may be called by any thread.
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
  } catch (const kj::Exception&) {  // the connection was closed or reset
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
  // Accepts the next connection of the router.
  [[nodiscard]] RoguePeer accept() {
    return RoguePeer(FileDescriptor(
        checkCall(::accept4(socket_.get(), nullptr, nullptr, SOCK_CLOEXEC), "accept")));
  }

 private:
  FileDescriptor socket_;
  std::string address_;
};

}  // namespace mpf::test
