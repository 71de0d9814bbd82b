// SPDX-License-Identifier: MIT
#include "crate/supervisor/control_protocol.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fmt/format.h>
#include <stdexcept>
#include <thread>

#include <mpf/clock.h>

#include "base/process_stat.h"
#include "base/system_call.h"
#include "base/time_text.h"
#include "base/toml/config_errors.h"

namespace mpf::crate {
namespace {

constexpr std::chrono::milliseconds kLookAtSupervisorEvery{500}, kConnectEvery{20};

// The address of the socket. The path goes through a descriptor of the folder, because the path of
// a socket has at most 107 bytes, and that of the folder may be longer.
struct SocketAddress {
  explicit SocketAddress(const CrateFolder& folder)
      : opened(checkCall(::open(folder.path().c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC), "open",
                         folder.path().string())) {
    address.sun_family = AF_UNIX;
    fmt::format_to_n(address.sun_path, sizeof address.sun_path - 1, "/proc/self/fd/{}/control",
                     opened.get());
  }
  [[nodiscard]] const sockaddr* get() const { return reinterpret_cast<const sockaddr*>(&address); }
  FileDescriptor opened;
  sockaddr_un address{};
};

FileDescriptor makeSocket() {
  return FileDescriptor(
      checkCall(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0), "socket"));
}

// The process at the other end; 0 if it is in a pid namespace that this one does not see.
pid_t peerOf(int socket) {
  ucred peer{};
  socklen_t length = sizeof peer;
  checkCall(::getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &peer, &length), "getsockopt");
  return peer.pid;
}

// A stopped supervisor replies only after somebody has continued it.
void checkNotStopped(pid_t pid, const std::string& crate) {
  const auto stat = ProcessStat::tryRead(pid);
  if (!stat || !isStopped(stat->state())) return;
  throw std::runtime_error(fmt::format(
      "the supervisor of the crate \"{}\", process {}, is stopped; `kill -CONT {}` continues it",
      crate, pid, pid));
}

// The wait for the reply of the supervisor of a crate.
struct Wait {
  std::string crate;
  std::chrono::milliseconds patience;
  Deadline deadline = Deadline::after(patience);

  void checkDeadline() const {
    if (deadline.hasPassed())
      throw std::runtime_error(
          fmt::format("the supervisor of the crate \"{}\" does not reply within {}; try again, or "
                      "see its log",
                      crate, timeText(patience)));
  }
};

// Waits while the queue of the socket is full: the supervisor is busy or stopped.
void connectTo(int socket, const CrateFolder& folder, const Wait& wait) {
  const SocketAddress address(folder);
  while (::connect(socket, address.get(), sizeof address.address) != 0) {
    if (errno != EAGAIN) throwSystemError(errno, "connect", folder.file("control"));
    checkNotStopped(folder.lockHolder().value_or(0), folder.name());
    wait.checkDeadline();
    std::this_thread::sleep_for(kConnectEvery);
  }
}

void waitForReply(int socket, const Wait& wait) {
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(wait.deadline.left());
    pollfd poll{socket, POLLIN, 0};
    const auto next = std::min(left, kLookAtSupervisorEvery);
    if (retryInterrupted([&] { return ::poll(&poll, 1, static_cast<int>(next.count())); }) > 0)
      return;
    checkNotStopped(peerOf(socket), wait.crate);
    wait.checkDeadline();
  }
}

std::string readLine(int socket, const Wait& wait) {
  std::string text;
  std::array<char, 4096> bytes{};
  for (;;) {
    waitForReply(socket, wait);
    const auto length =
        retryInterrupted([&] { return ::read(socket, bytes.data(), bytes.size()); });
    if (length <= 0) return text;
    text.append(bytes.data(), static_cast<std::size_t>(length));
    if (text.ends_with('\n')) return text;
  }
}

}  // namespace

FileDescriptor listenForControl(const CrateFolder& folder) {
  auto listening = makeSocket();
  const SocketAddress address(folder);
  ::unlink(folder.file("control").c_str());  // of a supervisor that was killed
  checkCall(::bind(listening.get(), address.get(), sizeof address.address), "bind",
            folder.file("control"));
  checkCall(::listen(listening.get(), 16), "listen", folder.file("control"));
  return listening;
}

nlohmann::json askSupervisor(const CrateFolder& folder, const nlohmann::json& request,
                             std::chrono::milliseconds patience) try {
  const auto socket = makeSocket();
  const Wait wait{folder.name(), patience};
  connectTo(socket.get(), folder, wait);
  const auto text = request.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
  // EPIPE: the supervisor has refused us already; its reply says why.
  if (::send(socket.get(), text.data(), text.size(), MSG_NOSIGNAL) < 0 && errno != EPIPE)
    throwSystemError(errno, "send", folder.file("control"));
  auto reply = nlohmann::json::parse(readLine(socket.get(), wait));
  if (reply.contains("fileErrors")) throw ConfigError(reply.at("fileErrors").get<std::string>());
  if (reply.contains("error")) throw std::runtime_error(reply.at("error").get<std::string>());
  return reply;
} catch (const std::system_error& error) {
  if (error.code().value() != ENOENT && error.code().value() != ECONNREFUSED) throw;
  throw std::runtime_error(
      fmt::format("the crate \"{}\" is not running; start it with `mpf run FILE`", folder.name()));
} catch (const nlohmann::json::exception&) {
  throw std::runtime_error(
      fmt::format("the supervisor of the crate \"{}\" sent no valid reply; "
                  "it may have been killed just now",
                  folder.name()));
}

}  // namespace mpf::crate
