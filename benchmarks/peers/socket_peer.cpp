// SPDX-License-Identifier: MIT
// Unix domain stream socket: what a program uses without a message library. In spin mode it polls
// with MSG_DONTWAIT.
#include <sys/socket.h>
#include <sys/un.h>

#include <cstring>
#include <stdexcept>
#include <vector>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"
#include "benchmarks/peers/peer.h"
#include "benchmarks/stage/measurement.h"
#include "benchmarks/stage/touch.h"
#include "shm/cpu_relax.h"

namespace mpf::bench {
namespace {

class SocketPeer final : public Peer {
 public:
  explicit SocketPeer(PeerOptions options) : options_(std::move(options)) {}

  void serve(const RunContext& context) override {
    accept(context);
    for (bool last = false; !last;) {
      take();
      last = context.stopping();
      if (options_.touch) {
        readAll(buffer_.data(), buffer_.size());
        writeAll(buffer_.data(), buffer_.size());
      }
      put();
    }
  }
  void connect(const RunContext&) override {
    const auto address = addressOf();
    fd_ = FileDescriptor(checkCall(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0), "socket"));
    checkCall(::connect(fd_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address),
              "connect", options_.name);
    buffer_.assign(options_.bytes, std::byte{1});
  }
  void send() override {
    if (options_.touch) writeAll(buffer_.data(), buffer_.size());
    put();
  }
  void receive() override {
    take();
    if (options_.touch) readAll(buffer_.data(), buffer_.size());
  }

  void sink(const RunContext& context) override {
    accept(context);
    for (std::uint64_t taken = 0;;) {
      take();
      if (++taken % 64 == 0) context.consumed(taken);
    }
  }
  void flood(const RunContext& context, const std::function<bool()>& resume) override {
    connect(context);
    while (resume()) {
      for (int i = 0; i < 64; ++i) put();
    }
  }

 private:
  // In the abstract namespace, so that no file has to be removed.
  [[nodiscard]] sockaddr_un addressOf() const {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    options_.name.copy(address.sun_path + 1, sizeof address.sun_path - 2);
    return address;
  }
  void accept(const RunContext& context) {
    const auto address = addressOf();
    const FileDescriptor listener(
        checkCall(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0), "socket"));
    checkCall(::bind(listener.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address),
              "bind", options_.name);
    checkCall(::listen(listener.get(), 1), "listen");
    buffer_.assign(options_.bytes, std::byte{1});
    context.ready();
    fd_ = FileDescriptor(checkCall(::accept(listener.get(), nullptr, nullptr), "accept"));
  }

  void put() {
    all([this](std::byte* at, std::size_t bytes, int flags) {
      return ::send(fd_.get(), at, bytes, flags | MSG_NOSIGNAL);
    });
  }
  void take() {
    all([this](std::byte* at, std::size_t bytes, int flags) {
      return ::recv(fd_.get(), at, bytes, flags);
    });
  }
  template <class Call>
  void all(Call&& call) {
    const int flags = options_.mode == Mode::spin ? MSG_DONTWAIT : 0;
    for (std::size_t done = 0; done < buffer_.size();) {
      const auto moved = call(buffer_.data() + done, buffer_.size() - done, flags);
      if (moved > 0) {
        done += static_cast<std::size_t>(moved);
      } else if (moved == 0 || (errno != EAGAIN && errno != EINTR)) {
        throwSystemError(moved == 0 ? ECONNRESET : errno, "send or recv", options_.name);
      } else {
        cpuRelax();
      }
    }
  }

  PeerOptions options_;
  FileDescriptor fd_;
  std::vector<std::byte> buffer_;
};

}  // namespace

PeerFamily socketPeer() {
  PeerFamily family;
  family.name = kUnixSocket;
  family.modes = {Mode::spin, Mode::block};
  family.make = [](const PeerOptions& options) { return std::make_unique<SocketPeer>(options); };
  family.oneWay = true;
  return family;
}

}  // namespace mpf::bench
