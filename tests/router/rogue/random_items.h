// SPDX-License-Identifier: MIT
// RandomItems: items of all kinds, with numbers that are sometimes valid, in frames of which some
// are damaged.
//
// Threads  one.
#pragma once

#include <algorithm>
#include <string>

#include "tests/router/frames.h"
#include "tests/support/random.h"

namespace mpf::test {

enum class Side { client, server };

// `Choices` has the interface of Random. Most items are those that `side` sends.
template <class Choices = Random>
class RandomItems {
 public:
  RandomItems(Choices& random, Side side) : random_(random), side_(side) {}

  // Remembers numbers from an item of the peer, so that later items use valid numbers.
  void learn(wire::Item::Reader item) {
    if (item.isServer() && item.getServer().getIncarnation() != 0)
      incarnation_ = item.getServer().getIncarnation();
    if (item.isRequest()) requestId_ = item.getRequest().getRequestId();
    if (item.isOpen()) client_ = item.getOpen().getClient();
    if (item.isBind()) binding_ = item.getBind().getBinding();
  }

  [[nodiscard]] Bytes frame() {
    std::vector<Fill> items(random_.below(8) + 1, [this](wire::Item::Builder item) { fill(item); });
    auto bytes = frameOf(items);
    if (random_.oneIn(16)) damage(bytes);
    return bytes;
  }

 private:
  [[nodiscard]] std::uint32_t number() {
    return static_cast<std::uint32_t>(random_.oneIn(8) ? random_.nasty() : random_.below(6));
  }
  // Usually a number from 1 to `last`.
  [[nodiscard]] std::uint32_t oneOf(std::uint32_t last) {
    return random_.oneIn(256) ? number() : static_cast<std::uint32_t>(random_.below(last) + 1);
  }
  [[nodiscard]] std::uint32_t client() { return oneOf(std::max(client_, 1u)); }
  [[nodiscard]] std::uint32_t binding() { return oneOf(std::max(binding_, 1u)); }
  [[nodiscard]] std::uint32_t nextBinding() { return random_.oneIn(256) ? number() : ++binding_; }
  [[nodiscard]] std::uint32_t id() { return random_.oneIn(2) ? requestId_ : number(); }
  [[nodiscard]] std::uint32_t nextClient() { return random_.oneIn(256) ? number() : ++client_; }
  [[nodiscard]] std::uint64_t incarnation() {
    return random_.oneIn(8) ? random_.nasty() : incarnation_;
  }
  [[nodiscard]] std::string text() {
    return std::string(random_.oneIn(8) ? random_.below(5000) : 0,
                       static_cast<char>(random_.below(255) + 1));
  }
  [[nodiscard]] std::string server() { return random_.oneIn(8) ? text() : "echo"; }

  void fill(wire::Item::Builder item) {
    constexpr std::uint64_t kPing = 0;
    constexpr std::uint64_t kOfServer = 1;  // to 7
    constexpr std::uint64_t kOfClient = 8;  // to 15
    const bool isServer = (side_ == Side::server) != random_.oneIn(256);
    switch (random_.oneIn(16) ? kPing
            : isServer        ? kOfServer + random_.below(7)
                              : kOfClient + random_.below(8)) {
      case kOfServer: {
        auto server = item.initServer();
        server.setBinding(binding());
        server.setState(static_cast<wire::Server::State>(random_.oneIn(16) ? random_.below(9)
                                                                           : random_.below(2)));
        server.setIncarnation(incarnation());
        server.setQueueSize(number());
        server.setMaxMessageBytes(random_.nasty());
        server.setReason(text());
        return;
      }
      case kOfClient: {
        auto bind = item.initBind();
        bind.setBinding(nextBinding());
        bind.setLocation(static_cast<std::int32_t>(random_.below(3)));
        bind.setServer(server());
        return;
      }
      case 9:
        return item.setUnbind(binding());
      case 10:
      case 11: {
        auto open = item.initOpen();
        open.setClient(nextClient());
        open.setBinding(binding());
        open.setIncarnation(incarnation());
        open.setWindow(static_cast<std::uint32_t>(random_.nasty()));
        return;
      }
      case 12:
        return item.setClose(client());
      case 13:
      case 14: {
        auto request = item.initRequest();
        request.setClient(client());
        request.setRequestId(++sent_);
        if (random_.oneIn(3)) request.setTakeWithinNs(random_.nasty());
        return fill(request.initMessage());
      }
      case 2:
      case 3:
      case 4: {
        auto reply = item.initReply();
        reply.setClient(client());
        reply.setRequestId(id());
        reply.setIsFirst(random_.oneIn(2));
        return fill(reply.initMessage());
      }
      case 5: {
        auto fate = item.initFate();
        fate.setClient(client());
        fate.setRequestId(id());
        fate.setFate(static_cast<wire::Fate>(random_.below(7)));
        return fate.setReason(text());
      }
      case 6:
        return item.setQueueFull(client());
      case 7: {
        auto refusal = item.initRefuse();
        refusal.setClient(client());
        return refusal.setReason(text());
      }
      case 15: {
        auto credit = item.initCredit();
        credit.setClient(client());
        return credit.setBytes(static_cast<std::uint32_t>(random_.nasty()));
      }
      default:
        item.initPing().setStamp(random_.bits());
    }
  }

  void fill(wire::Envelope::Builder message) {
    message.setClientType(static_cast<std::int32_t>(number()));
    const auto elements =
        static_cast<capnp::uint>(random_.oneIn(8) ? random_.below(100'000) : random_.below(20));
    switch (random_.below(10)) {
      case 0:
        return static_cast<void>(message.initConnect());
      case 1:
        return static_cast<void>(message.initInt32Array().initValue(elements));
      case 2:
        return static_cast<void>(message.initFloat64Array().initValue(elements));
      case 3:
        message.initChar8Array().initValue(elements);
        return static_cast<void>(
            message.getChar8Array().initEomString(static_cast<capnp::uint>(random_.below(5))));
      case 4:
        return static_cast<void>(message.initSerialConfig());
      case 5:
        return static_cast<void>(message.initOutOfBand());
      case 6:
        return static_cast<void>(message.initUser().initValue(elements));
      default:
        message.initInt32().setValue(static_cast<std::int32_t>(random_.bits()));
    }
  }

  void damage(Bytes& bytes) {
    for (auto times = random_.below(4) + 1; times > 0; --times) {
      const auto at = random_.below(bytes.size());
      bytes[at] = static_cast<std::uint8_t>(random_.oneIn(2) ? random_.bits()
                                                             : bytes[at] ^ 1u << random_.below(8));
    }
    if (random_.oneIn(8)) bytes.resize(random_.below(bytes.size()) + 1);
  }

  Choices& random_;
  Side side_;
  std::uint64_t incarnation_ = 77;
  std::uint32_t requestId_ = 1;
  std::uint32_t client_ = 0;   // the last number
  std::uint32_t binding_ = 0;  // the last number
  std::uint32_t sent_ = 0;
};

}  // namespace mpf::test
