// SPDX-License-Identifier: MIT
// Boost.Interprocess message_queue: one queue for each direction; each message is copied in and out
// under a shared mutex. In spin mode it polls with try_send() and try_receive().
#include <boost/interprocess/ipc/message_queue.hpp>
#include <optional>
#include <vector>

#include "benchmarks/peers/peer.h"
#include "benchmarks/stage/touch.h"
#include "shm/cpu_relax.h"

namespace mpf::bench {
namespace {

namespace ipc = boost::interprocess;

class BoostPeer final : public Peer {
 public:
  explicit BoostPeer(PeerOptions options) : options_(std::move(options)) {}

  void serve(const RunContext& context) override {
    create(context);
    for (bool last = false; !last;) {
      take(*requests_);
      last = context.stopping();
      if (options_.touch) {
        readAll(buffer_.data(), buffer_.size());
        writeAll(buffer_.data(), buffer_.size());
      }
      put(*replies_);
    }
  }
  void connect(const RunContext&) override {
    requests_.emplace(ipc::open_only, requestName().c_str());
    replies_.emplace(ipc::open_only, replyName().c_str());
    buffer_.assign(options_.bytes, std::byte{1});
  }
  void send() override {
    if (options_.touch) writeAll(buffer_.data(), buffer_.size());
    put(*requests_);
  }
  void receive() override {
    take(*replies_);
    if (options_.touch) readAll(buffer_.data(), buffer_.size());
  }

  void sink(const RunContext& context) override {
    create(context);
    for (std::uint64_t taken = 0;;) {
      take(*requests_);
      if (++taken % 64 == 0) context.consumed(taken);
    }
  }
  void flood(const RunContext& context, const std::function<bool()>& resume) override {
    connect(context);
    while (resume()) {
      for (int i = 0; i < 64; ++i) put(*requests_);
    }
  }
  void removeTraces() noexcept override {
    ipc::message_queue::remove(requestName().c_str());
    ipc::message_queue::remove(replyName().c_str());
  }

 private:
  [[nodiscard]] std::string requestName() const { return options_.name + "-requests"; }
  [[nodiscard]] std::string replyName() const { return options_.name + "-replies"; }
  void create(const RunContext& context) {
    const std::size_t room = options_.bytes <= 4096 ? 128 : 4;
    requests_.emplace(ipc::create_only, requestName().c_str(), room, options_.bytes);
    replies_.emplace(ipc::create_only, replyName().c_str(), room, options_.bytes);
    buffer_.assign(options_.bytes, std::byte{1});
    context.ready();
  }

  void put(ipc::message_queue& queue) {
    if (options_.mode == Mode::block) return queue.send(buffer_.data(), buffer_.size(), 0);
    while (!queue.try_send(buffer_.data(), buffer_.size(), 0)) cpuRelax();
  }
  void take(ipc::message_queue& queue) {
    ipc::message_queue::size_type got{};
    unsigned priority{};
    if (options_.mode == Mode::block)
      return queue.receive(buffer_.data(), buffer_.size(), got, priority);
    while (!queue.try_receive(buffer_.data(), buffer_.size(), got, priority)) cpuRelax();
  }

  PeerOptions options_;
  std::optional<ipc::message_queue> requests_;
  std::optional<ipc::message_queue> replies_;
  std::vector<std::byte> buffer_;
};

}  // namespace

PeerFamily boostPeer() {
  PeerFamily family;
  family.name = "Boost message_queue";
  family.modes = {Mode::spin, Mode::block};
  family.make = [](const PeerOptions& options) { return std::make_unique<BoostPeer>(options); };
  family.oneWay = true;
  return family;
}

}  // namespace mpf::bench
