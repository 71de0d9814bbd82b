// SPDX-License-Identifier: MIT
// The rows of `mpf bench remote` about many clients, and about idle routers.
#include <deque>
#include <fmt/format.h>
#include <memory>
#include <optional>
#include <stdexcept>

#include <mpf/message_client.h>

#include "benchmarks/peers/mpf_peer.h"
#include "benchmarks/remote/remote.h"
#include "benchmarks/remote/routers.h"
#include "benchmarks/stage/timing.h"

namespace mpf::bench {
namespace {

constexpr auto kAllConnected = std::chrono::seconds(120);
constexpr auto kReply = std::chrono::seconds(60);
constexpr auto kGrace = std::chrono::seconds(180);

// Results besides the round trips, in Figures::more. The last three are bytes per client.
enum Found : std::size_t { connectSeconds, clientsRouter, serversRouter, sharedMemory };
constexpr std::size_t kRoundTrips = 4;

// Resident memory of both routers and shared memory of both backplanes.
std::array<double, 4> memoryOf(const RouterPair& routers, const Backplane& clients,
                               const Backplane& servers) {
  return {0, residentBytesOf(routers.clientPid()), residentBytesOf(routers.serverPid()),
          occupiedBytes(clients) + occupiedBytes(servers)};
}

void answerForEver(const RunContext& context, const std::string& backplane, Mode mode) {
  raiseDescriptorLimit();
  ServerOptions options;
  options.location = kRemoteLocation;
  options.waitMode = waitMode(mode);
  MessageServer server(Backplane::attach(backplane), kServer, options);
  server.on<Int32>([](Int32&) {});
  context.ready();
  server.run();
}

// Clients of one process, bound to the server behind the routers.
class Clients {
 public:
  Clients(const std::string& backplane, Mode mode)
      : dispatcher_(Backplane::attach(backplane), {waitMode(mode), {}}) {}

  // Binds all clients before it waits for the first one.
  void growTo(int count) {
    const auto had = clients_.size();
    while (clients_.size() < static_cast<std::size_t>(count)) {
      clients_.emplace_back(dispatcher_, [this](Message&& message) {
        received_ += message.getType() == MessageType::int32 ? 1u : 0u;
        if (const auto* fate = message.tryAs<RequestFate>()) fate_ = toString(fate->fate);
      });
      clients_.back().bind(kServer, kRemoteLocation);
    }
    const auto limit = Deadline::after(kAllConnected);
    for (auto i = had; i < clients_.size(); ++i) {
      if (!clients_[i].connectWait(limit.left()))
        throw std::runtime_error(fmt::format("client {} of {} is not connected after {} s: {}", i,
                                             count, kAllConnected.count(),
                                             clients_[i].notConnectedBecause()));
    }
  }
  void roundTrip(std::size_t client) {
    const auto wanted = received_ + 1;
    const auto limit = Deadline::after(kReply);
    if (const auto result = clients_[client].send(Int32Message({.value = 1}));
        result != SendResult::sent) {
      throw std::runtime_error(fmt::format("the request of client {} of {} was not sent: {}",
                                           client, size(), toString(result)));
    }
    while (received_ < wanted) {
      if (!fate_.empty() || limit.hasPassed())
        throw std::runtime_error(
            fmt::format("the request of client {} of {} got no reply: {}", client, size(),
                        fate_.empty() ? fmt::format("none within {} s", kReply.count()) : fate_));
      dispatcher_.runOnce(limit);
    }
  }
  [[nodiscard]] std::size_t size() const noexcept { return clients_.size(); }
  [[nodiscard]] const Backplane& backplane() const noexcept { return dispatcher_.backplane(); }

 private:
  Dispatcher dispatcher_;
  std::deque<MessageClient> clients_;
  std::uint64_t received_ = 0;
  std::string fate_;  // of a request that got no reply
};

void measureCrowd(const RunContext& context, const RouterPair& routers, Mode mode, int clients) {
  raiseDescriptorLimit();
  Clients crowd(routers.clientBackplane(), mode);
  crowd.growTo(1);
  crowd.roundTrip(0);
  const auto servers = Backplane::attach(routers.serverBackplane());
  const auto before = memoryOf(routers, crowd.backplane(), servers);

  auto& figures = context.figures();
  const auto fromNs = Clock::nowNs();
  context.waitsFor(fmt::format("{} clients to connect", clients));
  crowd.growTo(clients);
  figures.more[connectSeconds] = static_cast<double>(Clock::nowNs() - fromNs) / 1e9;
  // One round trip of each client, because some memory is allocated at the first one.
  context.waitsFor(fmt::format("a reply to each of {} clients, for the first time", clients));
  for (std::size_t i = 0; i < crowd.size(); ++i) {
    crowd.roundTrip(i);
    context.got(i + 1);
  }
  const auto after = memoryOf(routers, crowd.backplane(), servers);
  for (const auto what : {clientsRouter, serversRouter, sharedMemory})
    figures.more[what] = (after[what] - before[what]) / (clients - 1);

  context.waitsFor(fmt::format("a reply to each of {} clients, for the second time", clients));
  const Stopwatch watch;
  const auto begin = Stopwatch::start();
  for (std::size_t i = 0; i < crowd.size(); ++i) {
    const auto from = Stopwatch::start();
    crowd.roundTrip(i);
    figures.latency.add(watch.elapsedNs(from, Stopwatch::stop()));
    context.got(i + 1);
  }
  figures.count = crowd.size();
  figures.perSecond =
      static_cast<double>(figures.count) * 1e9 / watch.elapsed(begin, Stopwatch::stop());
}

Outcome runCrowd(const Stage& stage, RouterPair& routers, Mode mode, int clients) {
  Workload workload;
  workload.grace = kGrace;
  workload.server = [&](const RunContext& context) {
    answerForEver(context, routers.serverBackplane(), mode);
  };
  workload.requester = [&](const RunContext& context) {
    measureCrowd(context, routers, mode, clients);
  };
  return routers.run([&] { return stage.run(workload); });
}

// The CPU time of both routers while one client is connected and does nothing.
Outcome runIdle(const Stage& stage, RouterPair& routers, Mode mode) {
  Workload workload;
  workload.server = [&](const RunContext& context) {
    answerForEver(context, routers.serverBackplane(), mode);
  };
  workload.requester = [&](const RunContext& context) {
    Clients one(routers.clientBackplane(), mode);
    one.growTo(1);
    sleepFor(std::chrono::seconds(1));  // until the work that follows connecting is done
    const auto used = [&] { return cpuNsOf(routers.serverPid()) + cpuNsOf(routers.clientPid()); };
    const auto before = used();
    const auto fromNs = Clock::nowNs();
    sleepFor(std::max<Nanoseconds>(context.budget().measure, std::chrono::seconds(3)));
    context.figures().value =
        100.0 * (used() - before) / static_cast<double>(Clock::nowNs() - fromNs);
  };
  return routers.run([&] { return stage.run(workload); });
}

}  // namespace

std::vector<Measurement> crowdRows(const Place& place) {
  // All rows show results of the same measurement.
  const auto seen = std::make_shared<std::optional<Outcome>>();
  const auto row = [&](const std::string& name, const std::string& unit, std::size_t what) {
    auto made =
        rowAt(place, kClients, "MPF remote, " + std::to_string(place.clients) + ", " + name, true);
    made.bytes = 4;
    made.unit = unit;
    made.isSlow = true;
    made.run = [=, routers = place.routers, mode = place.wait,
                clients = place.clients](const Stage& stage) {
      if (!*seen) *seen = runCrowd(stage, *routers, mode, clients);
      auto outcome = **seen;
      if (what != kRoundTrips) outcome.figures.value = outcome.figures.more[what];
      return outcome;
    };
    return made;
  };
  return {row("each in turn", "", kRoundTrips), row("connecting all", "s", connectSeconds),
          row("client's router", "bytes of memory a client", clientsRouter),
          row("server's router", "bytes of memory a client", serversRouter),
          row("shared memory", "bytes a client, of both backplanes", sharedMemory)};
}

std::vector<Measurement> idleRows(const Place& place) {
  auto row = rowAt(place, kIdle, "MPF remote, CPU of both routers", true);
  row.unit = "% of one CPU";
  row.share = 4;
  row.isSlow = true;
  row.run = [routers = place.routers, mode = place.wait](const Stage& stage) {
    return runIdle(stage, *routers, mode);
  };
  return {row};
}

}  // namespace mpf::bench
