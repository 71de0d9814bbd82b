// SPDX-License-Identifier: MIT
// The time from the kill of a process until its peer is notified: a client gets the fate of its
// request, a server is told that the client is gone. The floor is the time until waitpid() returns
// in the parent: before that the kernel has not finished with the process.
#include <signal.h>
#include <sys/wait.h>
#include <time.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <fmt/format.h>
#include <optional>
#include <random>
#include <stdexcept>
#include <utility>

#include <mpf/message_client.h>

#include "base/print_error.h"
#include "base/system_call.h"
#include "base/timespec.h"
#include "benchmarks/peers/mpf_peer.h"
#include "benchmarks/stage/measurement.h"
#include "benchmarks/stage/meter.h"
#include "benchmarks/stage/shared_object.h"
#include "server/relay_server.h"

namespace mpf::bench {
namespace {

constexpr Nanoseconds kNotifyLimit = std::chrono::seconds(10);
constexpr const char* kQuestion = "Death to fate: from kill -9 until the peer is notified";

enum class Victim { server, client };

// How long a client and a server have been connected when one of them is killed.
struct Age {
  const char* name;
  Nanoseconds least, most;
};
constexpr std::array kAges{
    Age{"0-5 ms", Nanoseconds(0), std::chrono::milliseconds(5)},
    Age{"20 ms", std::chrono::milliseconds(20), std::chrono::milliseconds(20)}};

// Times that the killer and its victims share, in ns of CLOCK_MONOTONIC; 0: not yet.
struct Board {
  std::atomic<std::int64_t> connectedNs{0};
  std::atomic<std::int64_t> notifiedNs{0};
};

// Receives requests and keeps them, so that a client's request is open when its server dies.
void serve(const std::string& backplane, Board& board) {
  RelayServer server(Backplane::attach(backplane), kServer);
  server.onClient([&](std::uint64_t, bool isThere) {
    if (!isThere) board.notifiedNs.store(Clock::nowNs(), std::memory_order_relaxed);
  });
  std::vector<Message> kept;
  while (server.waitForMessage()) {
    while (auto request = server.receive()) kept.push_back(std::move(request));
  }
}

void ask(const std::string& backplane, Board& board) {
  MessageClient client(Backplane::attach(backplane), [&](Message&& message) {
    if (message.getType() == MessageType::requestFate)
      board.notifiedNs.store(Clock::nowNs(), std::memory_order_relaxed);
  });
  client.bind(kServer);
  if (!client.connectWait(kConnectLimit))
    throw std::runtime_error("not connected: " + client.notConnectedBecause());
  if (client.send(Int32Message({.value = 1})) != SendResult::sent)
    throw std::runtime_error("the request could not be sent");
  board.connectedNs.store(Clock::nowNs(), std::memory_order_relaxed);
  for (;;) ::pause();
}

// A process of a measurement, which prints the reason on stderr when it fails.
class Process {
 public:
  template <class Body>
  explicit Process(const Body& body)
      : pid_(forkProcess([&] {
          try {
            body();
          } catch (const std::exception& error) {
            printError("death to fate: {}\n", error.what());
          }
        })) {}
  ~Process() { killProcess(pid_); }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  // Kills the process. Returns the time from the kill until waitpid() has returned.
  std::int64_t reapNs(std::int64_t& killedNs) {
    killedNs = Clock::nowNs();
    ::kill(pid_, SIGKILL);
    retryInterrupted([&] { return ::waitpid(std::exchange(pid_, 0), nullptr, 0); });
    return Clock::nowNs() - killedNs;
  }

 private:
  int pid_;
};

struct Durations {
  std::int64_t notifyNs, reapNs;
};

void sleepUntil(std::int64_t ns) {
  const auto until = timespecOf(ns);
  while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
}

// Where the server is killed, the client waits for it before it starts, as after a restart.
Durations killOnce(const std::string& backplane, Victim victim, Nanoseconds age) {
  const SharedObject<Board> shared;
  auto& board = *shared;
  std::optional<Process> client;
  std::optional<Process> server;
  if (victim == Victim::server) client.emplace([&] { ask(backplane, board); });
  if (victim == Victim::server) sleepFor(std::chrono::milliseconds(5));
  server.emplace([&] { serve(backplane, board); });
  if (victim == Victim::client) sleepFor(std::chrono::milliseconds(5));
  if (victim == Victim::client) client.emplace([&] { ask(backplane, board); });
  const auto isSet = [](const std::atomic<std::int64_t>& word) {
    return word.load(std::memory_order_relaxed) != 0;
  };
  if (!waitUntil([&] { return isSet(board.connectedNs); }, kConnectLimit))
    throw std::runtime_error("the client did not connect in time");
  sleepUntil(board.connectedNs.load(std::memory_order_relaxed) + age.count());
  std::int64_t killedNs = 0;
  const auto reapNs = (victim == Victim::server ? *server : *client).reapNs(killedNs);
  if (!waitUntil([&] { return isSet(board.notifiedNs); }, kNotifyLimit))
    throw std::runtime_error("the peer was not notified of the death in time");
  return {board.notifiedNs.load(std::memory_order_relaxed) - killedNs, reapNs};
}

Outcome deaths(const Stage& stage, const std::string& backplane, Victim victim, const Age& age,
               bool isFloor) {
  auto cpus = stage.placement().server;
  cpus.insert(cpus.end(), stage.placement().requester.begin(), stage.placement().requester.end());
  Workload workload;
  workload.requester = [=](const RunContext& context) {
    pinTo(cpus);
    std::minstd_rand random(std::random_device{}());
    std::uniform_int_distribution<std::int64_t> ageNs(age.least.count(), age.most.count());
    LatencyRecorder recorder;
    const auto end = Deadline::after(context.budget().measure);
    do {
      const auto took = killOnce(backplane, victim, Nanoseconds(ageNs(random)));
      recorder.add(static_cast<std::uint64_t>(isFloor ? took.reapNs : took.notifyNs));
    } while (!end.hasPassed());
    context.figures().latency = recorder;
  };
  workload.grace = std::chrono::seconds(30);
  auto outcome = stage.run(workload);
  removeBackplanes(backplane);
  return outcome;
}

}  // namespace

std::vector<Measurement> deathMeasurements(const std::string& runName) {
  std::vector<Measurement> rows;
  for (const auto victim : {Victim::server, Victim::client}) {
    for (const auto& age : kAges) {
      const auto* const who = victim == Victim::server ? "server" : "client";
      const auto* const notified = victim == Victim::server ? "client" : "server";
      Measurement floor;
      floor.question = kQuestion;
      floor.name = fmt::format("waitpid, {} of {}", who, age.name);
      floor.mode = Mode::adaptive;
      floor.share = 8;
      floor.isSlow = true;
      floor.detail = fmt::format("{} killed {} after the client connected", who, age.name);
      auto ours = floor;
      ours.name = fmt::format("{}, {} notified, {}", kMpf, notified, age.name);
      ours.floorName = floor.name;
      const auto backplane = fmt::format("{}-death-{}{}", runName, who[0], age.least.count());
      floor.run = [=](const Stage& stage) { return deaths(stage, backplane, victim, age, true); };
      ours.run = [=](const Stage& stage) { return deaths(stage, backplane, victim, age, false); };
      rows.push_back(std::move(floor));
      rows.push_back(std::move(ours));
    }
  }
  return rows;
}

}  // namespace mpf::bench
