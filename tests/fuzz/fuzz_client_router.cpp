// SPDX-License-Identifier: MIT
// A client router, two clients that use servers through it, and a peer that sends random items.
#include <memory>
#include <set>
#include <vector>

#include <mpf/message_client.h>

#include "client/relay_client.h"
#include "router/outgoing/client_router.h"
#include "tests/fuzz/fuzzers.h"
#include "tests/fuzz/router_scene.h"

#pragma GCC diagnostic ignored "-Wnon-virtual-dtor"  // kj::Own destroys the dynamic type

namespace mpf::test {
namespace {

constexpr std::int32_t kLocation = 1;

// A network in which a connection to any address calls `connect`.
class SimulatedNetwork final : public kj::Network {
 public:
  using Connect = std::function<kj::Promise<kj::Own<kj::AsyncIoStream>>()>;
  explicit SimulatedNetwork(Connect connect) : connect_(std::move(connect)) {}
  kj::Promise<kj::Own<kj::NetworkAddress>> parseAddress(kj::StringPtr, kj::uint) override {
    return kj::Own<kj::NetworkAddress>(kj::heap<Address>(connect_));
  }
  kj::Own<kj::NetworkAddress> getSockaddr(const void*, kj::uint) override {
    return kj::heap<Address>(connect_);
  }
  kj::Own<kj::Network> restrictPeers(kj::ArrayPtr<const kj::StringPtr>,
                                     kj::ArrayPtr<const kj::StringPtr>) override {
    return kj::heap<SimulatedNetwork>(connect_);
  }

 private:
  class Address final : public kj::NetworkAddress {
   public:
    explicit Address(Connect connect) : connect_(std::move(connect)) {}
    kj::Promise<kj::Own<kj::AsyncIoStream>> connect() override { return connect_(); }
    kj::Own<kj::ConnectionReceiver> listen() override {
      // NOLINTNEXTLINE(bugprone-suspicious-semicolon): within the macro
      KJ_UNIMPLEMENTED("a client router does not listen");
    }
    kj::Own<kj::NetworkAddress> clone() override { return kj::heap<Address>(connect_); }
    kj::String toString() override { return kj::str("127.0.0.1:1"); }

   private:
    Connect connect_;
  };
  Connect connect_;
};

// A client that checks that each of its requests ends once.
class Local {
 public:
  explicit Local(Dispatcher& dispatcher)
      : client_(dispatcher, [this](Message&& message) { note(std::move(message)); }) {
    client_.bind("echo", kLocation);
  }
  void send(Choices& choices) {
    std::uint32_t id = 0;
    const auto takeBefore =
        choices.oneIn(8) ? Deadline::after(Nanoseconds(choices.nasty() >> 1)) : Deadline::never();
    const auto elements = choices.oneIn(8) ? choices.below(10'000) : 0;
    auto message = elements == 0 ? Message(Int32Message({.value = 1}))
                                 : Message(client_.alloc<Int32Array>(elements));
    if (client_.send(std::move(message), takeBefore, &id) == SendResult::sent) open_.insert(id);
    if (choices.oneIn(16)) client_.cancel(id);
  }

 private:
  void note(Message&& message) {
    if (RelayClient::endsRequest(message) && open_.erase(message.route().requestId) == 0)
      std::abort();
    kept_ = std::move(message);
  }
  std::set<std::uint32_t> open_;
  Message kept_;
  MessageClient client_;
};

class ClientRouterPlay {
 public:
  ClientRouterPlay(RouterScene& scene, std::span<const std::uint8_t> input)
      : scene_(scene),
        choices_(input),
        context_{scene.io.unixEventPort,
                 network_,
                 scene.context.timer,
                 scene.backplane,
                 scene.context.log,
                 scene.statistics,
                 scene.monitors,
                 scene.context.config,
                 nullptr,
                 1},
        dispatcher_(scene.backplane),
        first_(std::make_unique<Local>(dispatcher_)),
        second_(std::make_unique<Local>(dispatcher_)),
        router_(std::make_unique<router::ClientRouter>(
            context_, router::Remote{.locations = {kLocation},
                                     .address = {"127.0.0.1", 1},
                                     .security = router::Security::plain,
                                     .tlsName = {}})) {
    router_->setPendingBinds({{kLocation, "echo"}});
    scene_.settle();
  }
  ~ClientRouterPlay() {
    router_ = nullptr;
    scene_.settle();
  }
  ClientRouterPlay(const ClientRouterPlay&) = delete;
  ClientRouterPlay& operator=(const ClientRouterPlay&) = delete;

  void run() {
    while (!choices_.isOver()) {
      step();
      scene_.settle();
    }
  }

 private:
  kj::Promise<kj::Own<kj::AsyncIoStream>> connect() {
    constexpr std::size_t kMost = 4;  // connections for one input
    if (ends_.size() == kMost) return kj::NEVER_DONE;
    auto pipe = makeConnection();
    ends_.push_back(std::make_unique<FarEnd>(kj::mv(pipe.ends[1]), items_));
    if (!choices_.oneIn(64)) ends_.back()->send(frameOf({greeting()}));
    return kj::mv(pipe.ends[0]);
  }
  void step() {
    switch (choices_.below(8)) {
      case 0:
        static_cast<void>(dispatcher_.runPending());
        return first_->send(choices_);
      case 1:
        static_cast<void>(dispatcher_.runPending());
        if (second_) second_->send(choices_);
        return;
      case 2:
        if (choices_.oneIn(4)) second_ = second_ ? nullptr : std::make_unique<Local>(dispatcher_);
        return static_cast<void>(dispatcher_.runPending());
      case 3:
        if (!ends_.empty()) ends_.back()->setReading(choices_.below(2) == 0);
        return;
      default:
        if (!ends_.empty()) ends_.back()->send();
    }
  }

  RouterScene& scene_;
  Choices choices_;
  RandomItems<Choices> items_{choices_, Side::server};
  SimulatedNetwork network_{[this] { return connect(); }};
  router::RouterContext context_;
  Dispatcher dispatcher_;
  std::unique_ptr<Local> first_;
  std::unique_ptr<Local> second_;
  std::vector<std::unique_ptr<FarEnd>> ends_;
  std::unique_ptr<router::ClientRouter> router_;
};

}  // namespace

void playClientRouter(std::span<const std::uint8_t> input) {
  static RouterScene scene;
  ClientRouterPlay(scene, input).run();
}

}  // namespace mpf::test
