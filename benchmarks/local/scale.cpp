// SPDX-License-Identifier: MIT
// The cost of many clients and of connecting, for MPF only: of the peers, only the socket has a
// connect to compare with.
#include <fcntl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdio>
#include <deque>
#include <optional>
#include <stdexcept>

#include <mpf/file_descriptor.h>
#include <mpf/message_client.h>

#include "base/print_error.h"
#include "base/system_call.h"
#include "benchmarks/local/background.h"
#include "benchmarks/peers/mpf_peer.h"
#include "benchmarks/stage/measurement.h"
#include "benchmarks/stage/meter.h"
#include "benchmarks/stage/timing.h"

namespace mpf::bench {
namespace {

void ignore(Message&&) {}

void connectOrThrow(MessageClient& client) {
  client.bind(kServer);
  if (!client.connectWait(kConnectLimit))
    throw std::runtime_error("not connected: " + client.notConnectedBecause());
}

// Answers all requests until the process is killed.
void serveForEver(const RunContext& context, const std::string& backplane, Mode mode) {
  raiseDescriptorLimit();
  MessageServer server(Backplane::attach(backplane), kServer, serverOptions(mode));
  server.on<Int32>([](Int32&) {});
  context.ready();
  server.run();
}

// A process that holds `count` connected clients and sleeps.
class Crowd {
 public:
  Crowd(const std::string& backplane, int count) {
    int ends[2];
    checkCall(::pipe2(ends, O_CLOEXEC), "pipe2");
    const FileDescriptor read(ends[0]);
    FileDescriptor write(ends[1]);
    pid_ = forkProcess([&] {
      raiseDescriptorLimit();
      hold(backplane, count, write);
    });
    write.reset();
    char connected = 0;
    if (retryInterrupted([&] { return ::read(read.get(), &connected, 1); }) != 1)
      throw std::runtime_error("the idle clients did not connect");
  }
  ~Crowd() { killProcess(pid_); }
  Crowd(const Crowd&) = delete;
  Crowd& operator=(const Crowd&) = delete;

 private:
  static void hold(const std::string& backplane, int count, FileDescriptor& write) try {
    Dispatcher dispatcher(Backplane::attach(backplane));
    std::deque<MessageClient> clients;
    for (int i = 0; i < count; ++i) connectOrThrow(clients.emplace_back(dispatcher, ignore));
    static_cast<void>(::write(write.get(), "+", 1) == 1);
    dispatcher.run();
  } catch (const std::exception& exception) {
    printError("idle clients: {}\n", exception.what());
    std::_Exit(1);
  }
  int pid_ = 0;
};

Outcome runAndClean(const Stage& stage, const std::string& backplane, const Workload& workload) {
  auto outcome = stage.run(workload);
  removeBackplanes(backplane);
  return outcome;
}

// Times a client from its construction until it is connected, in a process that already has a
// dispatcher. The destructor is not timed.
Outcome connectTime(const Stage& stage, const std::string& backplane, Mode mode) {
  Workload workload;
  workload.server = [=](const RunContext& context) { serveForEver(context, backplane, mode); };
  workload.requester = [=](const RunContext& context) {
    Dispatcher dispatcher(Backplane::attach(backplane), {waitMode(mode), {}});
    const Stopwatch watch;
    LatencyRecorder recorder;
    const auto end = Deadline::after(context.budget().measure);
    while (!end.hasPassed()) {
      const auto from = Stopwatch::start();
      MessageClient client(dispatcher, ignore);
      connectOrThrow(client);
      recorder.add(watch.elapsedNs(from, Stopwatch::stop()));
    }
    context.figures().latency = recorder;
  };
  return runAndClean(stage, backplane, workload);
}

Outcome socketConnectTime(const Stage& stage, const std::string& name) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  name.copy(address.sun_path + 1, sizeof address.sun_path - 2);
  Workload workload;
  workload.server = [=](const RunContext& context) {
    const FileDescriptor listener(
        checkCall(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0), "socket"));
    checkCall(::bind(listener.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address),
              "bind", name);
    checkCall(::listen(listener.get(), 1), "listen");
    context.ready();
    for (;;) {
      const FileDescriptor client(::accept(listener.get(), nullptr, nullptr));
      static_cast<void>(::send(client.get(), "+", 1, MSG_NOSIGNAL));
    }
  };
  workload.requester = [=](const RunContext& context) {
    timeEach(context, [&] {
      const FileDescriptor fd(
          checkCall(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0), "socket"));
      checkCall(::connect(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address),
                "connect", name);
      char answer{};  // accepted
      checkCall(::recv(fd.get(), &answer, 1, 0), "recv", name);
    });
  };
  return stage.run(workload);
}

// Of links over which each client has sent this number of requests at once.
Outcome memoryPerLink(const Stage& stage, const std::string& backplane, int requests) {
  Workload workload;
  workload.server = [=](const RunContext& context) {
    raiseDescriptorLimit();
    MessageServer server(Backplane::attach(backplane), kServer);  // with the default options
    context.ready();
    while (server.waitForMessage()) {
      while (auto request = server.receive()) server.reply(std::move(request));
    }
  };
  workload.requester = [=](const RunContext& context) {
    constexpr int kLinks = 100;
    Dispatcher dispatcher(Backplane::attach(backplane));
    std::deque<MessageClient> clients;
    int replies = 0;
    const auto count = [&](Message&& message) { replies += message.tryAs<Int32>() != nullptr; };
    connectOrThrow(clients.emplace_back(dispatcher, count));
    const auto one = occupiedBytes(dispatcher.backplane());
    for (int i = 0; i < kLinks; ++i) {
      auto& client = clients.emplace_back(dispatcher, count);
      connectOrThrow(client);
      replies = 0;
      for (int sent = 0; sent < requests;) {
        if (client.send(Int32Message({.value = 1})) == SendResult::sent) ++sent;
      }
      while (replies != requests) dispatcher.runOnce();
    }
    context.figures().value = (occupiedBytes(dispatcher.backplane()) - one) / kLinks;
  };
  return runAndClean(stage, backplane, workload);
}

// 50 servers and 50 clients with one link each, which do nothing until they are killed. Each client
// reports when it is connected.
class IdlePairs {
 public:
  explicit IdlePairs(const std::string& backplane) {
    int ends[2];
    checkCall(::pipe2(ends, O_CLOEXEC), "pipe2");
    const FileDescriptor read(ends[0]);
    FileDescriptor write(ends[1]);
    for (int i = 0; i < kPairs; ++i) {
      const auto name = "idle" + std::to_string(i);
      pids_.push_back(
          forkProcess([&] { MessageServer(Backplane::attach(backplane), name).run(); }));
      pids_.push_back(forkProcess([&] { beClient(backplane, name, write); }));
    }
    write.reset();
    for (int i = 0; i < kPairs; ++i) {
      char connected{};
      if (retryInterrupted([&] { return ::read(read.get(), &connected, 1); }) != 1)
        throw std::runtime_error("a client did not connect");
    }
  }
  ~IdlePairs() {
    for (const auto pid : pids_) killProcess(pid);
  }
  IdlePairs(const IdlePairs&) = delete;
  IdlePairs& operator=(const IdlePairs&) = delete;

  // CPU time so far of all threads of all processes [ns].
  [[nodiscard]] double cpuNs() const {
    double sum = 0;
    for (const auto pid : pids_) sum += cpuNsOf(pid);
    return sum;
  }

 private:
  static constexpr int kPairs = 50;
  static void beClient(const std::string& backplane, const std::string& server,
                       const FileDescriptor& write) {
    MessageClient client(Backplane::attach(backplane), ignore);
    client.bind(server);
    if (client.connectWait(kConnectLimit)) static_cast<void>(::write(write.get(), "+", 1) == 1);
    for (;;) ::pause();
  }
  std::vector<int> pids_;
};

Outcome idleCpu(const Stage& stage, const std::string& backplane) {
  Workload workload;
  workload.requester = [=](const RunContext& context) {
    const IdlePairs pairs(backplane);
    sleepFor(std::chrono::seconds(1));  // until the work that follows connecting is done
    const auto before = pairs.cpuNs();
    const auto fromNs = Clock::nowNs();
    sleepFor(std::max<Nanoseconds>(context.budget().measure, std::chrono::seconds(1)));
    context.figures().value =
        100.0 * (pairs.cpuNs() - before) / static_cast<double>(Clock::nowNs() - fromNs);
  };
  return runAndClean(stage, backplane, workload);
}

Measurement scaleRow(const std::string& question, const std::string& name, Mode mode,
                     std::size_t bytes) {
  Measurement row;
  row.question = question;
  row.name = name;
  row.mode = mode;
  row.bytes = bytes;
  return row;
}

}  // namespace

Outcome roundTripBeside(const Stage& stage, const std::string& backplane, Mode mode,
                        const Background& background) {
  Workload workload;
  workload.server = [=](const RunContext& context) { serveForEver(context, backplane, mode); };
  workload.requester = [=](const RunContext& context) {
    const auto beside = background ? background() : nullptr;
    Dispatcher dispatcher(Backplane::attach(backplane), {waitMode(mode), {}});
    std::uint64_t received = 0;
    MessageClient client(dispatcher, [&](Message&& message) {
      received += message.getType() == MessageType::int32 ? 1u : 0u;
    });
    connectOrThrow(client);
    timeEach(context, [&] {
      const auto wanted = received + 1;
      if (client.send(Int32Message({.value = 1})) != SendResult::sent)
        throw std::runtime_error("a request could not be sent");
      while (received < wanted) dispatcher.runOnce();
    });
  };
  return runAndClean(stage, backplane, workload);
}

std::vector<Measurement> scaleMeasurements(const std::string& runName) {
  std::vector<Measurement> rows;
  for (const auto mode : {Mode::spin, Mode::block}) {
    for (const int idle : {1, 100, 1000, 10000}) {
      auto row = scaleRow("Round trip of 4 B beside idle clients",
                          std::string(kMpf) + ", " + std::to_string(idle) + " idle", mode, 4);
      row.detail = std::to_string(idle) + " idle clients";
      row.floorName = mode == Mode::block ? kFutexBounce : kBounce;
      row.floorBytes = 4;
      const auto backplane = runName + "-idle" + std::to_string(idle) + toString(mode)[0];
      row.run = [=](const Stage& stage) {
        return roundTripBeside(stage, backplane, mode,
                               [=] { return std::make_shared<Crowd>(backplane, idle); });
      };
      row.isSlow = idle >= 1000;
      rows.push_back(std::move(row));
    }
  }
  const std::string connect = "Connect: from nothing to connected";
  for (const auto mode : {Mode::spin, Mode::adaptive, Mode::block}) {
    auto row = scaleRow(connect, kMpf, mode, 0);
    row.floorName = "one segment made";
    row.floorBytes = 4096;
    const auto backplane = runName + "-connect" + toString(mode)[0];
    row.run = [=](const Stage& stage) { return connectTime(stage, backplane, mode); };
    rows.push_back(std::move(row));
  }
  auto socket = scaleRow(connect, "Unix socket", Mode::block, 0);
  socket.floorName = "one segment made";
  socket.floorBytes = 4096;
  socket.run = [name = runName + "-connect"](const Stage& stage) {
    return socketConnectTime(stage, name);
  };
  rows.push_back(std::move(socket));

  for (const int requests : {1, 100}) {
    auto memory = scaleRow("Shared memory of one link",
                           "MPF, " + std::to_string(requests) + " at a time", Mode::adaptive, 0);
    memory.unit = "bytes";
    memory.run = [name = runName + "-memory", requests](const Stage& stage) {
      return memoryPerLink(stage, name, requests);
    };
    rows.push_back(std::move(memory));
  }

  auto cpu = scaleRow("CPU of 100 idle processes", kMpf, Mode::adaptive, 0);
  cpu.unit = "% of one CPU";
  cpu.share = 3;
  cpu.run = [name = runName + "-cpu"](const Stage& stage) { return idleCpu(stage, name); };
  rows.push_back(std::move(cpu));
  return rows;
}

}  // namespace mpf::bench
