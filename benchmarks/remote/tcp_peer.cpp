// SPDX-License-Identifier: MIT
#include "benchmarks/remote/tcp_peer.h"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <stdexcept>
#include <vector>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"
#include "benchmarks/remote/tcp_ends.h"

namespace mpf::bench {
namespace {

class TcpPeer final : public Peer {
 public:
  explicit TcpPeer(TcpOptions options) : options_(std::move(options)) {}

  void serve(const RunContext& context) override {
    options_.between.enterServer();
    const TcpListener listener(options_.between.serverAddress());
    context.ready(listener.port());
    fd_ = listener.accept();
    // Only the client reads while it waits to write. That suffices to prevent a deadlock.
    options_.reads = false;
    prepare();
    for (bool last = false; !last;) {
      takeUnit();
      last = context.stopping();
      put(in_);
    }
  }

  void connect(const RunContext& context) override {
    options_.between.enterRequester();
    fd_ = connectTcp(options_.between.serverAddress(), context.port());
    if (options_.reads) checkCall(::fcntl(fd_.get(), F_SETFL, O_NONBLOCK), "fcntl");
    prepare();
  }
  void send() override {
    out_.back() = static_cast<std::byte>(++sent_);
    put(out_);
  }
  void receive() override { takeUnit(); }

 private:
  void prepare() {
    out_.assign(options_.unitBytes, std::byte{1});
    in_.assign(options_.unitBytes, std::byte{0});
  }

  // Uses write() and read() instead of send() and recv(), because the kernel counts only those.
  void put(const std::vector<std::byte>& unit) {
    for (std::size_t done = 0; done < unit.size();) {
      const auto wrote = ::write(fd_.get(), unit.data() + done, unit.size() - done);
      if (wrote > 0) done += static_cast<std::size_t>(wrote);
      if (wrote < 0) awaitAfter("write", POLLIN | POLLOUT);
    }
  }
  void takeUnit() {
    while (units_ == 0) {
      if (!take()) awaitAfter("read", POLLIN);
    }
    --units_;
  }
  // Reads into the one buffer for all units, at the position of the next byte in its unit. False
  // when nothing can be read.
  bool take() {
    const auto got = ::read(fd_.get(), in_.data() + at_, in_.size() - at_);
    if (got == 0) throwSystemError(ECONNRESET, "read", "a TCP connection");
    if (got < 0) return false;
    at_ = (at_ + static_cast<std::size_t>(got)) % in_.size();
    if (at_ != 0) return true;
    ++units_;
    if (sent_ != 0 && in_.back() != static_cast<std::byte>(++echoed_))
      throw std::runtime_error("the echo differs from what was sent");
    return true;
  }
  // Handles a failed call. For a blocking socket that is always an error.
  void awaitAfter(const char* call, short events) {
    if (errno == EINTR) return;
    if (errno != EAGAIN) throwSystemError(errno, call, "a TCP connection");
    pollfd found{fd_.get(), events, 0};
    ::poll(&found, 1, -1);
    if ((found.revents & POLLIN) != 0 && (events & POLLOUT) != 0) static_cast<void>(take());
  }

  TcpOptions options_;
  FileDescriptor fd_;
  std::vector<std::byte> out_, in_;
  std::size_t at_ = 0;  // position of the next byte in in_
  std::size_t units_ = 0;  // units that have been read, but not taken by receive()
  unsigned sent_ = 0;  // units sent by the client; the last byte of each unit is its number
  unsigned echoed_ = 0;
};

}  // namespace

std::unique_ptr<Peer> makeTcpPeer(const TcpOptions& options) {
  return std::make_unique<TcpPeer>(options);
}

}  // namespace mpf::bench
