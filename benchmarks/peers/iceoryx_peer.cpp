// SPDX-License-Identifier: MIT
// iceoryx 2.0: request-response with untyped payloads that are built and read in place, and
// publish-subscribe for one-way traffic. In spin mode it polls with take(); in block mode both
// sides wait at a WaitSet.
#include <iceoryx_hoofs/log/logmanager.hpp>
#include <iceoryx_posh/popo/untyped_client.hpp>
#include <iceoryx_posh/popo/untyped_publisher.hpp>
#include <iceoryx_posh/popo/untyped_server.hpp>
#include <iceoryx_posh/popo/untyped_subscriber.hpp>
#include <iceoryx_posh/popo/wait_set.hpp>
#include <iceoryx_posh/runtime/posh_runtime.hpp>
#include <optional>
#include <stdexcept>

#include "benchmarks/peers/iceoryx_daemon.h"
#include "benchmarks/stage/touch.h"
#include "shm/cpu_relax.h"

namespace mpf::bench {
namespace {

namespace popo = iox::popo;
using Text = iox::capro::IdString_t;

class IceoryxPeer final : public Peer {
 public:
  explicit IceoryxPeer(PeerOptions options) : options_(std::move(options)) {}

  void serve(const RunContext& context) override {
    start("server");
    popo::ServerOptions options;
    options.requestQueueFullPolicy = popo::QueueFullPolicy::BLOCK_PRODUCER;
    options.clientTooSlowPolicy = popo::ConsumerTooSlowPolicy::WAIT_FOR_CONSUMER;
    popo::UntypedServer server(service(), options);
    popo::WaitSet<1> waitSet;
    waitSet.attachEvent(server, popo::ServerEvent::REQUEST_RECEIVED).or_else([](auto) {
      throw std::runtime_error("attachEvent");
    });
    context.ready();
    for (bool last = false; !last;) {
      const void* const request = take(server, waitSet);
      last = context.stopping();
      if (options_.touch) readAll(request, options_.bytes);
      answer(server, request);
    }
  }
  void connect(const RunContext&) override {
    start("client");
    popo::ClientOptions options;
    options.responseQueueFullPolicy = popo::QueueFullPolicy::BLOCK_PRODUCER;
    options.serverTooSlowPolicy = popo::ConsumerTooSlowPolicy::WAIT_FOR_CONSUMER;
    client_.emplace(service(), options);
    waitSet_.emplace();
    waitSet_->attachEvent(*client_, popo::ClientEvent::RESPONSE_RECEIVED).or_else([](auto) {
      throw std::runtime_error("attachEvent");
    });
    const auto connected = [this] {
      return client_->getConnectionState() == iox::ConnectionState::CONNECTED;
    };
    if (!waitUntil(connected, std::chrono::seconds(5)))
      throw std::runtime_error("not connected after 5 s");
  }
  void send() override {
    auto loaned = client_->loan(bytes(), alignof(std::uint64_t));
    if (loaned.has_error()) throw std::runtime_error("loan of a request failed");
    if (options_.touch) writeAll(loaned.value(), options_.bytes);
    client_->send(loaned.value()).or_else([](auto&) {
      throw std::runtime_error("send of a request failed");
    });
  }
  void receive() override {
    const void* const response = take(*client_, *waitSet_);
    if (options_.touch) readAll(response, options_.bytes);
    client_->releaseResponse(response);
  }

  void sink(const RunContext& context) override {
    start("subscriber");
    popo::SubscriberOptions options;
    options.queueFullPolicy = popo::QueueFullPolicy::BLOCK_PRODUCER;
    popo::UntypedSubscriber subscriber(service(), options);
    popo::WaitSet<1> waitSet;
    waitSet.attachEvent(subscriber, popo::SubscriberEvent::DATA_RECEIVED).or_else([](auto) {
      throw std::runtime_error("attachEvent");
    });
    context.ready();
    for (std::uint64_t taken = 0;;) {
      subscriber.release(take(subscriber, waitSet));
      if (++taken % 64 == 0) context.consumed(taken);
    }
  }
  void flood(const RunContext&, const std::function<bool()>& resume) override {
    start("publisher");
    popo::PublisherOptions options;
    options.subscriberTooSlowPolicy = popo::ConsumerTooSlowPolicy::WAIT_FOR_CONSUMER;
    popo::UntypedPublisher publisher(service(), options);
    if (!waitUntil([&] { return publisher.hasSubscribers(); }, std::chrono::seconds(5)))
      throw std::runtime_error("no subscriber after 5 s");
    while (resume()) {
      for (int i = 0; i < 64; ++i) {
        auto loaned = publisher.loan(bytes());
        if (loaned.has_error()) throw std::runtime_error("loan of a sample failed");
        publisher.publish(loaned.value());
      }
    }
  }

 private:
  [[nodiscard]] std::uint32_t bytes() const { return static_cast<std::uint32_t>(options_.bytes); }
  void start(const char* role) {
    iox::log::LogManager::GetLogManager().SetDefaultLogLevel(
        iox::log::LogLevel::kOff, iox::log::LogLevelOutput::kHideLogLevel);
    const std::string name = options_.name + "-" + role;
    iox::runtime::PoshRuntime::initRuntime(
        iox::RuntimeName_t(iox::cxx::TruncateToCapacity, name.c_str()));
  }
  [[nodiscard]] iox::capro::ServiceDescription service() const {
    return {"mpf", Text(iox::cxx::TruncateToCapacity, options_.name.c_str()), "bench"};
  }

  template <class From, class Wait>
  const void* take(From& from, Wait& waitSet) {
    for (;;) {
      auto taken = from.take();
      if (!taken.has_error()) return taken.value();
      if (options_.mode == Mode::block) {
        static_cast<void>(waitSet.wait());
      } else {
        cpuRelax();
      }
    }
  }
  void answer(popo::UntypedServer& server, const void* request) {
    auto loaned =
        server.loan(popo::RequestHeader::fromPayload(request), bytes(), alignof(std::uint64_t));
    if (loaned.has_error()) throw std::runtime_error("loan of a response failed");
    if (options_.touch) writeAll(loaned.value(), options_.bytes);
    server.send(loaned.value()).or_else([](auto&) {
      throw std::runtime_error("send of a response failed");
    });
    server.releaseRequest(request);
  }

  PeerOptions options_;
  std::optional<popo::UntypedClient> client_;
  std::optional<popo::WaitSet<1>> waitSet_;  // created in connect(), because it needs the daemon
};

}  // namespace

PeerFamily iceoryxPeer() {
  PeerFamily family;
  family.name = "iceoryx 2.0";
  family.modes = {Mode::spin, Mode::block};
  family.make = [](const PeerOptions& options) { return std::make_unique<IceoryxPeer>(options); };
  family.oneWay = true;
  family.start = [] { return std::make_unique<IceoryxDaemon>(); };
  return family;
}

}  // namespace mpf::bench
