// SPDX-License-Identifier: MIT
#include "base/service_manager.h"

#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <cstring>

#include <mpf/clock.h>
#include <mpf/file_descriptor.h>

namespace mpf {
namespace {

constexpr timeval kLongestWait{.tv_sec = 0, .tv_usec = 100'000};
constexpr std::chrono::microseconds kLongestWatchdog = std::chrono::hours(24);

}  // namespace

void ServiceManager::notifyReloading() noexcept {
  notify("RELOADING=1\nMONOTONIC_USEC=" + std::to_string(Clock::nowNs() / 1000));
}

std::optional<std::chrono::microseconds> ServiceManager::watchdogTime() noexcept {
  // NOLINTBEGIN(concurrency-mt-unsafe): no thread changes the environment
  const char* const time = std::getenv("WATCHDOG_USEC");
  const char* const pid = std::getenv("WATCHDOG_PID");
  // NOLINTEND(concurrency-mt-unsafe)
  if (time == nullptr || (pid != nullptr && std::atoi(pid) != ::getpid())) return std::nullopt;
  const auto microseconds = std::atoll(time);
  if (microseconds <= 0) return std::nullopt;
  return std::min(std::chrono::microseconds(microseconds), kLongestWatchdog);
}

void ServiceManager::notify(const std::string& state) noexcept {
  // NOLINTNEXTLINE(concurrency-mt-unsafe): no thread changes the environment
  const char* const path = std::getenv("NOTIFY_SOCKET");
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path == nullptr || *path == '\0' || std::strlen(path) >= sizeof address.sun_path) return;
  const auto length = std::strlen(path);
  std::memcpy(address.sun_path, path, length);
  if (address.sun_path[0] == '@') address.sun_path[0] = '\0';  // an abstract socket name
  const FileDescriptor socket(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  // A service manager that does not read must not stop the program.
  ::setsockopt(socket.get(), SOL_SOCKET, SO_SNDTIMEO, &kLongestWait, sizeof kLongestWait);
  // A failure is ignored: the program works without a service manager.
  static_cast<void>(::sendto(socket.get(), state.data(), state.size(), MSG_NOSIGNAL,
                             reinterpret_cast<const sockaddr*>(&address),
                             static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + length)));
}

}  // namespace mpf
