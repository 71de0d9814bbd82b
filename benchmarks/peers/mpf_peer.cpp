// SPDX-License-Identifier: MIT
// MPF through its public API: MessageServer, and MessageClient with its callback, on a dispatcher
// that the requester runs itself.
#include "benchmarks/peers/mpf_peer.h"

#include <sys/resource.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <stdexcept>

#include <mpf/message_client.h>
#include <mpf/message_server.h>

#include "benchmarks/peers/peer.h"
#include "benchmarks/stage/touch.h"
#include "shm/cpu_relax.h"

namespace mpf::bench {
namespace {

template <ArrayBody Array>
class MpfPeer final : public Peer {
 public:
  MpfPeer(PeerOptions options, MpfPlaces places)
      : options_(std::move(options)), places_(std::move(places)) {}

  void serve(const RunContext& context) override {
    MessageServer server(Backplane::attach(places_.serverBackplane), kServer, optionsOfServer());
    context.ready();
    if (places_.inRuns) return serveInRuns(server, context);
    for (bool last = false; !last && server.waitForMessage();) {
      while (auto request = server.receive()) {
        last = context.stopping();
        if (options_.touch) {
          const auto value = request.template valueAs<Array>();
          readAll(value.data(), value.size_bytes());
          writeAll(value.data(), value.size_bytes());
        }
        if (server.reply(std::move(request)) != ReplyResult::sent)
          throw std::runtime_error("a reply could not be sent");
      }
    }
  }

  void connect(const RunContext&) override {
    dispatcher_.emplace(Backplane::attach(places_.clientBackplane),
                        DispatcherOptions{waitMode(options_.mode), {}});
    client_.emplace(*dispatcher_, [this](Message&& message) { take(message); });
    if (places_.inRuns)
      client_->template onValues<Int32>(
          [this](std::span<const Int32> values, const Message&) { received_ += values.size(); });
    client_->bind(kServer, places_.location);
    if (!client_->connectWait(kConnectLimit))
      throw std::runtime_error("not connected: " + client_->notConnectedBecause());
  }
  void send() override {
    if (places_.inRuns) {
      ++unsent_;
      return;
    }
    SendResult result{};
    if (options_.bytes == 4) {
      result = client_->send(Int32Message({.address = 3, .value = 100}));
    } else {
      auto request =
          client_->template alloc<Array>(options_.bytes / sizeof(typename Array::Element));
      if (options_.touch) writeAll(request.value().data(), options_.bytes);
      result = client_->send(std::move(request));
    }
    if (result != SendResult::sent)
      throw std::runtime_error(std::string("send: ") + toString(result));
  }
  void receive() override {
    ++awaited_;
    while (received_ < awaited_) {
      if (unsent_ != 0) sendRun();
      dispatcher_->runOnce();
    }
  }
  void roundTrip() override {
    send();
    MpfPeer::receive();
  }

  // One way: the server sends any number of replies to one request, and the client receives them in
  // its callback.
  void sink(const RunContext& context) override {
    context.ready();
    connect(context);
    send();
    sendRun();
    for (std::uint64_t runs = 0;; ++runs) {
      dispatcher_->runOnce();
      if (runs % 4 == 0) context.consumed(received_);  // runs of up to 16 messages
    }
  }
  void flood(const RunContext&, const std::function<bool()>& resume) override {
    MessageServer server(Backplane::attach(places_.serverBackplane), kServer, optionsOfServer());
    Message request;
    while (!request) {
      if (!server.waitForMessage(Deadline::after(kConnectLimit)))
        throw std::runtime_error("no request from the client");
      request = server.receive();
    }
    while (resume()) {
      if (places_.inBatches) sendBatch(server, request);
      else sendOneByOne(server, request);
    }
  }

  void removeTraces() noexcept override {
    removeBackplanes(places_.serverBackplane);
    if (places_.clientBackplane != places_.serverBackplane)
      removeBackplanes(places_.clientBackplane);
  }

 private:
  static constexpr std::size_t kBatch = 64;

  static void serveInRuns(MessageServer& server, const RunContext& context) {
    server.on<Int32>([](std::span<Int32>) {});
    for (bool last = false; !last && server.waitForMessage();) {
      while (server.handleOne()) last = context.stopping();
    }
  }
  // Sends what send() has counted.
  void sendRun() {
    while (unsent_ != 0) {
      const auto count = std::min(unsent_, batch_.size());
      const auto sent = client_->template sendMany<Int32>(std::span(batch_).first(count));
      if (sent.result != SendResult::sent)
        throw std::runtime_error(std::string("sendMany: ") + toString(sent.result));
      unsent_ -= sent.count;
    }
  }
  void sendOneByOne(MessageServer& server, const Message& request) {
    for (std::size_t i = 0; i < kBatch; ++i) {
      auto reply = server.allocReplyMessage<Int32>(request);
      reply->value = ++value_;
      for (auto result = ReplyResult::queueFull; result != ReplyResult::sent;) {
        result = server.reply(std::move(reply));
        if (result == ReplyResult::queueFull) cpuRelax();
        if (result == ReplyResult::clientGone) throw std::runtime_error("the client is gone");
      }
    }
  }
  void sendBatch(MessageServer& server, const Message& request) {
    for (auto& value : batch_) value.value = ++value_;
    for (std::span<const Int32> rest = batch_; !rest.empty();) {
      const auto sent = server.replyMany(request, rest);
      if (sent.result == ReplyResult::clientGone) throw std::runtime_error("the client is gone");
      rest = rest.subspan(sent.count);
      if (!rest.empty()) cpuRelax();
    }
  }
  [[nodiscard]] ServerOptions optionsOfServer() const {
    auto options = serverOptions(options_.mode);
    options.location = places_.location;
    options.queueSize = places_.queueSize;
    return options;
  }
  void take(Message& message) {
    if (message.getType() == MessageType::connect) return;
    if (options_.bytes == 4) {
      if (message.tryAs<Int32>() == nullptr)
        throw std::runtime_error("the reply is not an Int32 message");
    } else {
      const auto value = message.template valueAs<Array>();
      if (value.size_bytes() != options_.bytes)
        throw std::runtime_error("the size of the reply differs from that of the request");
      if (options_.touch) readAll(value.data(), value.size_bytes());
    }
    ++received_;
  }

  PeerOptions options_;
  MpfPlaces places_;
  std::optional<Dispatcher> dispatcher_;
  std::optional<MessageClient> client_;
  std::uint64_t received_ = 0;
  std::uint64_t awaited_ = 0;
  std::int32_t value_ = 0;
  std::array<Int32, kBatch> batch_{};
  std::size_t unsent_ = 0;  // with inRuns
};

}  // namespace

template <ArrayBody Array>
std::unique_ptr<Peer> makeMpfPeer(const PeerOptions& options, const MpfPlaces& places) {
  return std::make_unique<MpfPeer<Array>>(options, places);
}
template std::unique_ptr<Peer> makeMpfPeer<Char8Array>(const PeerOptions&, const MpfPlaces&);
template std::unique_ptr<Peer> makeMpfPeer<Int32Array>(const PeerOptions&, const MpfPlaces&);
template std::unique_ptr<Peer> makeMpfPeer<Float64Array>(const PeerOptions&, const MpfPlaces&);

WaitMode waitMode(Mode mode) noexcept {
  return mode == Mode::spin    ? WaitMode::spin
         : mode == Mode::block ? WaitMode::block
                               : WaitMode::adaptive;
}

ServerOptions serverOptions(Mode mode) {
  ServerOptions options;
  options.queueSize = 256;
  options.waitMode = waitMode(mode);
  return options;
}

void raiseDescriptorLimit() noexcept {
  rlimit limit{};
  ::getrlimit(RLIMIT_NOFILE, &limit);
  limit.rlim_cur = limit.rlim_max;
  ::setrlimit(RLIMIT_NOFILE, &limit);
}

double occupiedBytes(const Backplane& backplane) {
  double bytes = 0;
  for (const auto& name : backplane.segmentNames()) {
    struct stat file{};
    if (::stat(("/dev/shm/" + name).c_str(), &file) == 0)
      bytes += static_cast<double>(file.st_blocks) * 512;
  }
  return bytes;
}

// In a process of its own, because attaching starts a thread, and the runner must not have one.
void removeBackplanes(const std::string& prefix) noexcept try {
  const auto pid = forkProcess([&] {
    for (const auto& name : Backplane::names()) {
      if (name.starts_with(prefix)) Backplane::attach(name).removeDead();
    }
  });
  if (!waitUntil([pid] { return hasEnded(pid); }, std::chrono::seconds(10))) killProcess(pid);
} catch (const std::exception&) {
  return;  // the next run tries again
}

PeerFamily mpfPeer() {
  PeerFamily family;
  family.name = kMpf;
  family.modes = {Mode::spin, Mode::adaptive, Mode::block};
  family.make = [](const PeerOptions& options) {
    return makeMpfPeer<Char8Array>(
        options, {.serverBackplane = options.name, .clientBackplane = options.name});
  };
  family.oneWay = true;
  return family;
}

PeerFamily mpfBatchPeer(bool inRuns) {
  auto family = mpfPeer();
  family.name =
      std::string(kMpf) + (inRuns ? ", 64 at a time, taken in batches" : ", 64 at a time");
  family.make = [inRuns](const PeerOptions& options) {
    return makeMpfPeer<Char8Array>(options, {.serverBackplane = options.name,
                                             .clientBackplane = options.name,
                                             .inBatches = true,
                                             .inRuns = inRuns});
  };
  return family;
}

PeerFamily mpfRunPeer() {
  auto family = mpfPeer();
  family.name = std::string(kMpf) + ", in batches";
  family.make = [](const PeerOptions& options) {
    return makeMpfPeer<Char8Array>(
        options,
        {.serverBackplane = options.name, .clientBackplane = options.name, .inRuns = true});
  };
  return family;
}

}  // namespace mpf::bench
