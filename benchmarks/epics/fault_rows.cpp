// SPDX-License-Identifier: MIT
// The rows of `mpf bench epics` about servers that are killed, stopped or absent: 1000 records with
// SCAN ".1 second" on 50 servers.
//
//   server of the farm:  up ── kill ──► dying ── 20 records INVALID ──► starting ── valid ──► up
#include <signal.h>

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <random>
#include <stdexcept>
#include <vector>

#include "benchmarks/epics/bench_ioc.h"
#include "benchmarks/epics/epics.h"
#include "benchmarks/epics/server_farm.h"
#include "benchmarks/peers/mpf_peer.h"
#include "benchmarks/stage/stopwatch.h"

namespace mpf::bench {
namespace {

constexpr int kRecordsOfServer = 20;
constexpr auto kFaultLimit = std::chrono::seconds(60);  // far above any goal

std::string recordOf(int server, int number) { return fmt::format("r{}:{}", server, number); }

std::string farmDatabase() {
  std::string database;
  for (int server = 0; server < ServerFarm::kServers; ++server)
    for (int number = 0; number < kRecordsOfServer; ++number)
      database += fmt::format(
          "record(longin, \"{}\") {{ field(DTYP, \"MPF\") field(SCAN, \".1 second\")"
          " field(INP, \"@{} type=int32 value={}\") }}\n",
          recordOf(server, number), ServerFarm::nameOf(server), number);
  return database;
}

class Campaign {
 public:
  Campaign(const RunContext& context, BenchIoc& ioc)
      : context_(context), ioc_(ioc), farm_(context) {
    for (int server = 0; server < ServerFarm::kServers; ++server)
      for (int number = 0; number < kRecordsOfServer; ++number)
        records_.at(server).push_back(ioc_.find(recordOf(server, number)));
  }

  // Waits until all records have values.
  void waitUntilUp() {
    for (int server = 0; server < ServerFarm::kServers; ++server)
      if (!waitUntil([&] { return haveAll(server, false); }, kFaultLimit))
        throw std::runtime_error(ServerFarm::nameOf(server) + ": its records have no values");
  }

  // Kills servers at random, one after the other: the kernel would take longer to end several of
  // them beside the starts of others, on the one CPU of all servers.
  void kill(int kills) {
    const auto end = Deadline::after(kFaultLimit + kills * std::chrono::milliseconds(100));
    for (int killed = 0; killed < kills || inWork_ != 0;) {
      if (end.hasPassed()) throw std::runtime_error("records did not follow their servers in time");
      if (killed < kills && inWork_ == 0 && tryKill()) ++killed;
      for (int server = 0; server < ServerFarm::kServers; ++server) follow(server);
      sleepFor(std::chrono::microseconds(100));
    }
  }

  [[nodiscard]] const LatencyRecorder& deaths() const noexcept { return deaths_; }
  [[nodiscard]] const LatencyRecorder& returns() const noexcept { return returns_; }

 private:
  enum class State { up, dying, starting };
  struct Server {
    State state = State::up;
    std::uint64_t since = 0;
  };

  bool tryKill() {
    const int server = std::uniform_int_distribution(0, ServerFarm::kServers - 1)(random_);
    if (servers_.at(server).state != State::up) return false;
    farm_.signal(server, SIGKILL);
    servers_.at(server) = {State::dying, Stopwatch::start()};
    ++inWork_;
    return true;
  }
  void follow(int server) {
    auto& [state, since] = servers_.at(server);
    if (state == State::dying && haveAll(server, true)) {
      deaths_.add(watch_.elapsedNs(since, Stopwatch::stop()));
      farm_.restart(server);
      servers_.at(server) = {State::starting, Stopwatch::start()};
    } else if (state == State::starting && haveAll(server, false)) {
      returns_.add(watch_.elapsedNs(since, Stopwatch::stop()));
      state = State::up;
      --inWork_;
    }
  }
  [[nodiscard]] bool haveAll(int server, bool isInvalid) {
    return std::ranges::all_of(records_.at(server), [&](std::size_t record) {
      return ioc_.isInvalid(record) == isInvalid;
    });
  }

  const RunContext& context_;
  BenchIoc& ioc_;
  ServerFarm farm_;
  const Stopwatch watch_;
  std::array<std::vector<std::size_t>, ServerFarm::kServers> records_;
  std::array<Server, ServerFarm::kServers> servers_;
  int inWork_ = 0;
  std::mt19937 random_{1};
  LatencyRecorder deaths_, returns_;
};

Outcome onFarm(const Stage& stage, const EpicsBench& bench, bool isStarted,
               const std::function<void(const RunContext&)>& requester) {
  Workload workload;
  workload.scratchBytes = ServerFarm::kScratchBytes;
  workload.grace = kFaultLimit + bench.kills * std::chrono::milliseconds(100);
  if (isStarted)
    workload.server = [&](const RunContext& context) { ServerFarm(context).keep(context, bench); };
  workload.requester = requester;
  auto outcome = stage.run(workload);
  // The servers die after the farm.
  const auto isEmpty = [&] {
    removeBackplanes(bench.backplane);
    return std::ranges::none_of(Backplane::names(), [&](const std::string& name) {
      return name.starts_with(bench.backplane);
    });
  };
  if (!waitUntil(isEmpty, kFaultLimit)) outcome.error = "the servers left shared memory";
  return outcome;
}

void killServers(const RunContext& context, const EpicsBench& bench, bool isOfReturn) {
  auto& ioc = loadBenchIoc();
  ioc.start(bench.backplane, farmDatabase());
  Campaign campaign(context, ioc);
  campaign.waitUntilUp();
  campaign.kill(bench.kills);
  context.figures().latency = isOfReturn ? campaign.returns() : campaign.deaths();
  context.figures().count = context.figures().latency.count();
}

// The largest change of the scan rate of a server's records while another server is stopped [%].
void stopOne(const RunContext& context, const EpicsBench& bench) {
  auto& ioc = loadBenchIoc();
  ioc.start(bench.backplane, farmDatabase());
  Campaign(context, ioc).waitUntilUp();
  ServerFarm farm(context);
  const auto ratesNow = [&] {
    constexpr auto kLength = std::chrono::seconds(10);
    std::array<double, ServerFarm::kServers> rates{};
    for (int server = 0; server < ServerFarm::kServers; ++server)
      rates.at(server) = -static_cast<double>(farm.answered(server));
    const auto fromNs = Clock::nowNs();
    sleepFor(kLength);
    const auto seconds = static_cast<double>(Clock::nowNs() - fromNs) / 1e9;
    for (int server = 0; server < ServerFarm::kServers; ++server)
      rates.at(server) = (rates.at(server) + static_cast<double>(farm.answered(server))) / seconds;
    return rates;
  };
  const auto before = ratesNow();
  farm.signal(0, SIGSTOP);
  const auto during = ratesNow();
  for (int server = 1; server < ServerFarm::kServers; ++server)
    context.figures().value = std::max(context.figures().value,
                                       100 * std::abs(during.at(server) / before.at(server) - 1));
}

void boot(const RunContext& context, const EpicsBench& bench) {
  auto& ioc = loadBenchIoc();
  const auto fromNs = Clock::nowNs();
  ioc.start(bench.backplane, farmDatabase());
  context.figures().value = static_cast<double>(Clock::nowNs() - fromNs) / 1e6;
}

}  // namespace

std::vector<Measurement> faultRows(const EpicsBench& bench) {
  const auto row = [&](const std::string& name, const std::string& unit, bool isStarted,
                       std::function<void(const RunContext&)> requester) {
    Measurement made;
    made.question = kFaults;
    made.name = name;
    made.mode = bench.wait;
    made.unit = unit;
    made.isSlow = true;
    made.run = [=](const Stage& stage) { return onFarm(stage, bench, isStarted, requester); };
    return made;
  };
  const auto kills = fmt::format(", {} kills", bench.kills);
  return {row(kDeath + kills, "", true,
              [=](const RunContext& context) { killServers(context, bench, false); }),
          row(kReturn + kills, "", true,
              [=](const RunContext& context) { killServers(context, bench, true); }),
          row(kStopped, "%", true, [=](const RunContext& context) { stopOne(context, bench); }),
          row("boot, all servers there", "ms", true,
              [=](const RunContext& context) { boot(context, bench); }),
          row("boot, all servers absent", "ms", false,
              [=](const RunContext& context) { boot(context, bench); })};
}

}  // namespace mpf::bench
