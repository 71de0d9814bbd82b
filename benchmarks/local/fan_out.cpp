// SPDX-License-Identifier: MIT
// One image for many readers: the time that it costs the server, and the bytes that arrive. Beside
// messages that are published, copies for each reader.
//
// The server runs on the requester's CPUs. When its time is measured, the readers run on the other
// side's CPUs, so that they do not interrupt it; otherwise on all.
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <functional>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include <mpf/message_client.h>
#include <mpf/message_server.h>

#include "base/print_error.h"
#include "benchmarks/peers/mpf_peer.h"
#include "benchmarks/stage/measurement.h"
#include "benchmarks/stage/stopwatch.h"
#include "benchmarks/stage/touch.h"

namespace mpf::bench {
namespace {

constexpr std::size_t kImageBytes = std::size_t{4} << 20;
constexpr const char* kImageQuestion =
    "The server's time for an image of 4 MiB, written and sent, 250 a second";
// Between two images: the caches and the CPU of the server are as cold for one reader as for many.
constexpr auto kPeriod = std::chrono::milliseconds(4);
constexpr const char* kOneReader = "MPF, published, 1 reader";

// Written by one reader.
struct alignas(kLineBytes) Progress {
  std::atomic<std::uint64_t> images;
};

// A process that reads every byte of each image.
void readImages(const std::string& backplane, Progress& progress) try {
  Dispatcher dispatcher(Backplane::attach(backplane), {WaitMode::block, {}});
  MessageClient client(dispatcher, [&](Message&& message) {
    const auto image = message.valueAs<Char8Array>();
    if (image.empty()) return;
    readAll(image.data(), image.size());
    message.reset();
    progress.images.fetch_add(1, std::memory_order_relaxed);
  });
  client.bind(kServer);
  if (!client.connectWait(kConnectLimit) ||
      client.send(Int32Message({.value = 1})) != SendResult::sent)
    throw std::runtime_error("not connected: " + client.notConnectedBecause());
  dispatcher.run();
} catch (const std::exception& error) {
  printError("reader: {}\n", error.what());
  std::_Exit(1);
}

class Readers {
 public:
  // Starts processes, from a process without threads.
  Readers(const std::string& backplane, const Cpus& cpus, std::span<std::byte> memory, int count)
      : progress_(reinterpret_cast<Progress*>(memory.data()), static_cast<std::size_t>(count)) {
    for (auto& progress : progress_) {
      pids_.push_back(forkProcess([&] {
        pinTo(cpus);
        readImages(backplane, progress);
      }));
    }
  }
  ~Readers() {
    for (const auto pid : pids_) killProcess(pid);
  }
  Readers(const Readers&) = delete;
  Readers& operator=(const Readers&) = delete;

  // The number of images that every reader has read.
  [[nodiscard]] std::uint64_t images() const noexcept {
    std::uint64_t least = UINT64_MAX;
    for (const auto& progress : progress_)
      least = std::min(least, progress.images.load(std::memory_order_relaxed));
    return least;
  }

 private:
  std::span<Progress> progress_;
  std::vector<int> pids_;
};

class ImageServer {
 public:
  ImageServer(const std::string& backplane, std::size_t readers, bool publishes)
      : server_(Backplane::attach(backplane), kServer, serverOptions(Mode::adaptive)),
        publishes_(publishes),
        source_(Char8ArrayMessage::allocValue(kImageBytes)) {
    while (subscribers_.size() < readers) {
      server_.waitForMessage(Deadline::after(std::chrono::milliseconds(100)));
      while (auto request = server_.receive()) subscribers_.push_back(std::move(request));
    }
  }

  // Writes every byte of an image, and sends it to all readers.
  void send() {
    ++images_;
    publishes_ ? publish() : copy();
  }
  // Waits until all readers have read all images but the last `ahead`.
  void await(const Readers& readers, std::uint64_t ahead) const {
    const auto limit = Deadline::after(kConnectLimit);
    while (readers.images() + ahead < images_) {
      if (limit.hasPassed()) throw std::runtime_error("the readers do not read");
      ::usleep(20);  // both CPUs are for the readers
    }
  }
  [[nodiscard]] std::uint64_t images() const noexcept { return images_; }

 private:
  void publish() {
    const auto image = [&] {
      auto made = server_.allocShared<Char8Array>(kImageBytes);
      writeAll(made.value().data(), kImageBytes);
      return made;
    }();
    if (server_.publish(image, subscribers_) != subscribers_.size())
      throw std::runtime_error("an image was dropped");
  }
  void copy() {
    writeAll(source_.value().data(), kImageBytes);
    for (const auto& subscriber : subscribers_) {
      auto reply = server_.allocReplyMessage<Char8Array>(subscriber, kImageBytes);
      std::memcpy(reply.value().data(), source_.value().data(), kImageBytes);
      if (server_.reply(std::move(reply)) != ReplyResult::sent)
        throw std::runtime_error("an image was dropped");
    }
  }

  MessageServer server_;
  bool publishes_;
  Char8ArrayMessage source_;
  std::vector<Message> subscribers_;
  std::uint64_t images_ = 0;
};

// Calls `step` until the budget is used up; only the steps after the warm-up count.
template <class Step>
void repeat(const RunContext& context, Step&& step) {
  const auto warm = Deadline::after(context.budget().warmUp);
  do step(false);
  while (!warm.hasPassed());
  const auto end = Deadline::after(context.budget().measure);
  do step(true);
  while (!end.hasPassed());
}

Outcome run(const Stage& stage, const std::string& backplane, int readers, const Cpus& cpus,
            const std::function<void(const RunContext&, const Readers&)>& measure) {
  Workload workload;
  workload.scratchBytes = static_cast<std::size_t>(readers) * sizeof(Progress);
  workload.requester = [=](const RunContext& context) {
    const Readers processes(backplane, cpus, context.scratch(), readers);
    measure(context, processes);
  };
  auto outcome = stage.run(workload);
  removeBackplanes(backplane);
  return outcome;
}

Outcome serverTime(const Stage& stage, const std::string& backplane, int readers, bool publishes) {
  const auto& cpus = stage.placement().server;
  return run(stage, backplane, readers, cpus, [=](const auto& context, const auto& processes) {
    ImageServer server(backplane, static_cast<std::size_t>(readers), publishes);
    const Stopwatch watch;
    LatencyRecorder recorder;
    repeat(context, [&](bool counts) {
      const auto next = Deadline::after(kPeriod);
      const auto from = Stopwatch::start();
      server.send();
      const auto to = Stopwatch::stop();
      if (counts) recorder.add(watch.elapsedNs(from, to));
      server.await(processes, 0);
      if (!next.hasPassed()) sleepFor(next.left());
    });
    context.figures().latency = recorder;
  });
}

Outcome throughput(const Stage& stage, const std::string& backplane, int readers, bool publishes) {
  auto cpus = stage.placement().server;
  cpus.insert(cpus.end(), stage.placement().requester.begin(), stage.placement().requester.end());
  return run(stage, backplane, readers, cpus, [=](const auto& context, const auto& processes) {
    ImageServer server(backplane, static_cast<std::size_t>(readers), publishes);
    std::int64_t fromNs = 0;
    std::uint64_t fromImages = 0;
    repeat(context, [&](bool counts) {
      if (counts && fromNs == 0) {
        fromNs = Clock::nowNs();
        fromImages = processes.images();
      }
      server.send();
      server.await(processes, 2);
    });
    const auto bytes = static_cast<double>(processes.images() - fromImages) * readers *
                       static_cast<double>(kImageBytes);
    context.figures().value = bytes / static_cast<double>(Clock::nowNs() - fromNs);
  });
}

std::string nameOf(bool publishes, int readers) {
  return std::string(kMpf) + (publishes ? ", published, " : ", copied, ") +
         std::to_string(readers) + (readers == 1 ? " reader" : " readers");
}

}  // namespace

std::vector<Measurement> fanOutMeasurements(const std::string& runName) {
  std::vector<Measurement> rows;
  for (const bool publishes : {true, false}) {
    for (const int readers : {1, 4, 16}) {
      Measurement row;
      row.question = kImageQuestion;
      row.name = nameOf(publishes, readers);
      row.mode = Mode::adaptive;
      row.bytes = kImageBytes;
      row.touched = true;
      if (row.name != kOneReader) {
        row.floorName = kOneReader;
        row.floorBytes = kImageBytes;
      }
      const auto backplane = runName + "-image" + std::to_string(readers) + (publishes ? "p" : "c");
      row.run = [=](const Stage& stage) {
        return serverTime(stage, backplane, readers, publishes);
      };
      rows.push_back(std::move(row));
    }
  }
  for (const bool publishes : {true, false}) {
    constexpr int kReaders = 4;
    Measurement row;
    row.question = "Images of 4 MiB to four processes, written and read";
    row.name = nameOf(publishes, kReaders);
    row.mode = Mode::adaptive;
    row.bytes = kImageBytes;
    row.touched = true;
    row.unit = "GB/s";
    const auto backplane = runName + "-images" + (publishes ? "p" : "c");
    row.run = [=](const Stage& stage) { return throughput(stage, backplane, kReaders, publishes); };
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace mpf::bench
