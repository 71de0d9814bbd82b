// SPDX-License-Identifier: MIT
#include "drivers/serial/tcp_line.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <fmt/format.h>

#include "base/system_call.h"

namespace mpf {
namespace {

constexpr int kKeepAliveIdleSeconds = 10;
constexpr int kKeepAliveEverySeconds = 5;
constexpr int kKeepAliveProbes = 3;
constexpr int kUnacknowledgedMs = 25'000;

// Errors are ignored: a socket without one of these options still works.
void setOptions(int socket) noexcept {
  const auto set = [&](int level, int option, int value) {
    ::setsockopt(socket, level, option, &value, sizeof value);
  };
  set(IPPROTO_TCP, TCP_NODELAY, 1);
  set(SOL_SOCKET, SO_KEEPALIVE, 1);
  set(IPPROTO_TCP, TCP_KEEPIDLE, kKeepAliveIdleSeconds);
  set(IPPROTO_TCP, TCP_KEEPINTVL, kKeepAliveEverySeconds);
  set(IPPROTO_TCP, TCP_KEEPCNT, kKeepAliveProbes);
  set(IPPROTO_TCP, TCP_USER_TIMEOUT, kUnacknowledgedMs);
}

}  // namespace

SerialLine::OpenState TcpLine::tryOpen() {
  if (socket_) return finishConnect();
  if (lookup_) return finishLookup(lookup_->tryTake());
  return untried_.empty() ? beginLookup() : connectNext();
}

SerialLine::OpenState TcpLine::beginLookup() try {
  lookup_.emplace(address_);
  return OpenState::opening;
} catch (const std::system_error& error) {
  // There is no descriptor or no thread; the next attempt may get one.
  problem_ = fmt::format("resolve {}: {}", address_.toString(), error.what());
  return OpenState::failed;
}

SerialLine::OpenState TcpLine::finishLookup(std::optional<NameLookup::Result> result) {
  if (!result) return OpenState::opening;
  lookup_.reset();
  problem_ = result->problem;
  untried_ = std::move(result->addresses);
  std::reverse(untried_.begin(), untried_.end());
  return connectNext();
}

SerialLine::OpenState TcpLine::connectNext() {
  while (!untried_.empty()) {
    const auto address = untried_.back();
    untried_.pop_back();
    socket_.reset(
        ::socket(address.storage.ss_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    if (!socket_) {
      note("socket for", errno);
      continue;
    }
    setOptions(socket_.get());
    const auto* to = reinterpret_cast<const sockaddr*>(&address.storage);
    if (::connect(socket_.get(), to, address.length) == 0 || errno == EINPROGRESS || errno == EINTR)
      return OpenState::opening;
    note("connect to", errno);
    socket_.reset();
  }
  return OpenState::failed;
}

SerialLine::OpenState TcpLine::finishConnect() {
  int error = 0;
  socklen_t length = sizeof error;
  ::getsockopt(socket_.get(), SOL_SOCKET, SO_ERROR, &error, &length);
  if (error == 0) {
    isConnected_ = true;
    untried_.clear();
    return OpenState::open;
  }
  note("connect to", error);
  socket_.reset();
  return connectNext();
}

void TcpLine::close() noexcept {
  socket_.reset();
  lookup_.reset();
  isConnected_ = false;
}

pollfd TcpLine::waitsFor() const noexcept {
  if (lookup_) return {lookup_->descriptor(), POLLIN, 0};
  return {socket_.get(), static_cast<short>(isConnected_ ? POLLIN : POLLOUT), 0};
}

void TcpLine::note(const char* call, int error) {
  problem_ = fmt::format(
      "{} {}: {}", call, address_.toString(),
      error == 0 ? "the far end closed the connection" : std::generic_category().message(error));
}

bool TcpLine::tryRead(std::vector<LineByte>& bytes) {
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): recv() fills it
  std::array<std::uint8_t, kReadBytes> raw;
  const auto length =
      retryInterrupted([&] { return ::recv(socket_.get(), raw.data(), raw.size(), 0); });
  for (const auto value :
       std::span(raw).first(static_cast<std::size_t>(std::max<ssize_t>(length, 0))))
    bytes.push_back({value});
  if (length > 0 || (length < 0 && errno == EAGAIN)) return true;
  note("read from", length == 0 ? 0 : errno);
  return false;
}

std::optional<std::size_t> TcpLine::tryWrite(std::span<const std::uint8_t> bytes) {
  const auto length = retryInterrupted(
      [&] { return ::send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL); });
  if (length >= 0) return static_cast<std::size_t>(length);
  if (errno == EAGAIN) return 0;
  note("write to", errno);
  return std::nullopt;
}

std::string TcpLine::tryConfigure(const SerialSettings& settings) {
  if (settings == SerialSettings{}) return {};
  return fmt::format("not supported over TCP: set it on the terminal server {}",
                     address_.toString());
}

}  // namespace mpf
