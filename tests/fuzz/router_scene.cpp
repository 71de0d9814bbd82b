// SPDX-License-Identifier: MIT
#include "tests/fuzz/router_scene.h"

#include <algorithm>
#include <cstdlib>
#include <iostream>

#include "tests/fuzz/hostile_files.h"

#pragma GCC diagnostic ignored "-Wnon-virtual-dtor"  // kj::Own destroys the dynamic type

namespace mpf::test {
namespace {

constexpr std::uint64_t kLongestFrame = std::uint64_t{64} << 20;

router::RouterConfig configOf(const Backplane& backplane) {
  router::RouterConfig config;
  config.name = "fuzz";
  config.backplane = backplane.name();
  config.serve = {{.location = 1, .local = 0}};
  config.limits.deadTime = std::chrono::minutes(10);  // no test waits for it
  config.limits.maxClients = 8;
  config.limits.windowBytes = 4096;
  config.limits.maxMessageBytes = 1u << 16;
  config.limits.firstRetry = config.limits.lastRetry = std::chrono::milliseconds(1);
  return config;
}

// One end of a pipe that accepts socket options.
class SimulatedSocket final : public kj::AsyncIoStream {
 public:
  explicit SimulatedSocket(kj::Own<kj::AsyncIoStream> pipe) : pipe_(kj::mv(pipe)) {}
  kj::Promise<std::size_t> tryRead(void* buffer, std::size_t least, std::size_t most) override {
    return pipe_->tryRead(buffer, least, most);
  }
  kj::Promise<void> write(const void* buffer, std::size_t size) override {
    return pipe_->write(buffer, size);
  }
  kj::Promise<void> write(kj::ArrayPtr<const kj::ArrayPtr<const kj::byte>> pieces) override {
    return pipe_->write(pieces);
  }
  kj::Promise<void> whenWriteDisconnected() override { return pipe_->whenWriteDisconnected(); }
  void shutdownWrite() override { pipe_->shutdownWrite(); }
  void setsockopt(int, int, const void*, kj::uint) override {}

 private:
  kj::Own<kj::AsyncIoStream> pipe_;
};

void check(bool isRight, const char* what) {
  if (isRight) return;
  std::cerr << "the router " << what << '\n';
  std::abort();
}

}  // namespace

RouterScene::RouterScene()
    : backplane(fuzzBackplane()),
      statistics(backplane, "fuzz"),
      context{.port = io.unixEventPort,
              .network = io.provider->getNetwork(),
              .timer = io.provider->getTimer(),
              .backplane = backplane,
              .log = Log([](Log::Level, const std::string&) {}),
              .statistics = statistics,
              .monitors = monitors,
              .config = configOf(backplane),
              .tls = nullptr,
              .incarnation = 1} {}

kj::TwoWayPipe makeConnection() {
  auto pipe = kj::newTwoWayPipe();
  pipe.ends[0] = kj::heap<SimulatedSocket>(kj::mv(pipe.ends[0]));
  return pipe;
}

FarEnd::FarEnd(kj::Own<kj::AsyncIoStream> stream, RandomItems<Choices>& items)
    : stream_(kj::mv(stream)), items_(items), reader_(kLongestFrame), sent_(kLongestFrame) {
  reads_ = readLoop().eagerlyEvaluate([this](kj::Exception&&) { over_ = true; });
}

void FarEnd::send() { send(items_.frame()); }

void FarEnd::send(Bytes bytes) {
  noteSent(bytes);
  auto kept = kj::heap(std::move(bytes));
  writes_ = writes_
                .then([this, kept = kj::mv(kept)]() mutable {
                  auto written = stream_->write(kept->data(), kept->size());
                  return written.attach(kj::mv(kept));
                })
                .eagerlyEvaluate([this](kj::Exception&&) { over_ = true; });
}

void FarEnd::setReading(bool reads) {
  reading_ = reads;
  if (reading_ && resumeReading_) std::exchange(resumeReading_, nullptr)->fulfill();
}

kj::Promise<void> FarEnd::readLoop() {
  if (!reading_) {
    auto paf = kj::newPromiseAndFulfiller<void>();
    resumeReading_ = kj::mv(paf.fulfiller);
    return paf.promise.then([this] { return readLoop(); });
  }
  auto room = reader_.room();
  return stream_->tryRead(room.begin(), 1, room.size())
      .then([this](std::size_t bytes) -> kj::Promise<void> {
        reader_.filled(bytes);
        over_ = over_ || bytes == 0;
        try {
          while (auto* frame = reader_.tryNext()) {
            for (const auto item : frame->getRoot<wire::Frame>().getItems()) note(item);
          }
        } catch (...) {
          check(false, "sent an invalid frame");
        }
        if (over_) return kj::READY_NOW;
        return readLoop();
      });
}

void FarEnd::note(wire::Item::Reader item) {
  items_.learn(item);
  const auto ended = [&](std::uint32_t client, std::uint32_t id) {
    if (sentIsValid_) check(asked_[{client, id}]-- > 0, "ended a request that was not pending");
  };
  if (item.isReply() && item.getReply().getIsFirst())
    ended(item.getReply().getClient(), item.getReply().getRequestId());
  if (item.isFate()) ended(item.getFate().getClient(), item.getFate().getRequestId());
}

// Reads the sent bytes as the router does, and counts the requests in them.
void FarEnd::noteSent(const Bytes& bytes) try {
  for (std::span<const std::uint8_t> rest = bytes; sentIsValid_ && !rest.empty();) {
    auto room = sent_.room();
    const auto part = rest.first(std::min(room.size(), rest.size()));
    std::ranges::copy(part, room.begin());
    sent_.filled(part.size());
    rest = rest.subspan(part.size());
    while (auto* frame = sent_.tryNext()) {
      for (const auto item : frame->getRoot<wire::Frame>().getItems()) {
        if (item.isRequest())
          ++asked_[{item.getRequest().getClient(), item.getRequest().getRequestId()}];
      }
    }
  }
} catch (...) {  // the rest is no longer a sequence of frames
  sentIsValid_ = false;
}

}  // namespace mpf::test
