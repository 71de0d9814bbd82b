// SPDX-License-Identifier: MIT
#include "tests/support/wire.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/if_tun.h>
#include <netinet/in.h>
#include <poll.h>
#include <sched.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <exception>
#include <net/if.h>

#include "base/system_call.h"

namespace mpf::test {
namespace {

constexpr std::size_t kPacketBytes = 65'536;
constexpr std::int64_t kNsPerMs = 1'000'000;

void setAddress(int socket, unsigned long request, const char* what, ifreq& interface,
                const char* address) {
  sockaddr_in in{};
  in.sin_family = AF_INET;
  ::inet_pton(AF_INET, address, &in.sin_addr);
  std::memcpy(&interface.ifr_addr, &in, sizeof in);
  checkCall(::ioctl(socket, request, &interface), what, address);
}

void bringUp(int socket, const char* name) {
  ifreq interface{};
  std::strncpy(interface.ifr_name, name, IFNAMSIZ - 1);
  checkCall(::ioctl(socket, SIOCGIFFLAGS, &interface), "SIOCGIFFLAGS", name);
  interface.ifr_flags |= IFF_UP | IFF_RUNNING;
  checkCall(::ioctl(socket, SIOCSIFFLAGS, &interface), "SIOCSIFFLAGS", name);
}

}  // namespace

Wire::Wire()
    : near_(makeHost(kNear)),
      far_(makeHost(kFar)),
      bell_(checkCall(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK), "eventfd")) {
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

Wire::~Wire() {
  thread_.request_stop();
  static_cast<void>(::eventfd_write(bell_.get(), 1));
}

// In a thread of its own, because a network namespace belongs to a thread and the test's own thread
// must stay in its namespace.
Wire::Host Wire::makeHost(const char* address) {
  Host host;
  std::exception_ptr failure;
  std::thread([&] {
    try {
      checkCall(::unshare(CLONE_NEWNET), "unshare", "network namespace");
      host.network.reset(checkCall(::open("/proc/thread-self/ns/net", O_RDONLY | O_CLOEXEC), "open",
                                   "/proc/thread-self/ns/net"));
      host.tun.reset(checkCall(::open("/dev/net/tun", O_RDWR | O_CLOEXEC | O_NONBLOCK), "open",
                               "/dev/net/tun"));
      ifreq interface{};
      std::strncpy(interface.ifr_name, "mpf0", IFNAMSIZ - 1);
      interface.ifr_flags = IFF_TUN | IFF_NO_PI;
      checkCall(::ioctl(host.tun.get(), TUNSETIFF, &interface), "TUNSETIFF", "/dev/net/tun");
      const FileDescriptor socket(
          checkCall(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0), "socket"));
      setAddress(socket.get(), SIOCSIFADDR, "SIOCSIFADDR", interface, address);
      setAddress(socket.get(), SIOCSIFNETMASK, "SIOCSIFNETMASK", interface, "255.255.255.0");
      bringUp(socket.get(), "mpf0");
      bringUp(socket.get(), "lo");
    } catch (...) {
      failure = std::current_exception();
    }
  }).join();
  if (failure) std::rethrow_exception(failure);
  return host;
}

void Wire::enter(const Host& host) {
  if (::setns(host.network.get(), CLONE_NEWNET) != 0) ::_exit(126);
}

void Wire::behave(const Weather& weather) {
  const std::lock_guard lock(mutex_);
  weather_ = weather;
}

void Wire::cut() {
  const std::lock_guard lock(mutex_);
  cutToFar_ = cutToNear_ = true;
  onTheirWay_.clear();
}

void Wire::cut(Direction direction) {
  const std::lock_guard lock(mutex_);
  isCut(direction) = true;
  std::erase_if(onTheirWay_, [&](const auto& each) { return each.second.direction == direction; });
}

void Wire::mend() {
  const std::lock_guard lock(mutex_);
  cutToFar_ = cutToNear_ = false;
}

std::uint64_t Wire::passed() const {
  const std::lock_guard lock(mutex_);
  return passed_;
}

void Wire::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    std::array<pollfd, 3> ready{
        {{near_.tun.get(), POLLIN, 0}, {far_.tun.get(), POLLIN, 0}, {bell_.get(), POLLIN, 0}}};
    checkCall(retryInterrupted([&] { return ::poll(ready.data(), ready.size(), msToNext()); }),
              "poll");
    take(Direction::toFar, near_);
    take(Direction::toNear, far_);
    passDue();
  }
}

void Wire::take(Direction direction, const Host& from) {
  std::array<char, kPacketBytes> bytes{};
  for (;;) {
    const auto got = ::read(from.tun.get(), bytes.data(), bytes.size());
    if (got <= 0) return;
    const std::lock_guard lock(mutex_);
    if (isCut(direction) ||
        random_.below(1000) < static_cast<std::uint64_t>(weather_.lostPerThousand))
      continue;
    const bool overtakes =
        random_.below(1000) < static_cast<std::uint64_t>(weather_.overtakingPerThousand);
    const auto due =
        Clock::nowNs() + (overtakes ? 0 : std::chrono::nanoseconds(weather_.delay).count());
    onTheirWay_.emplace(due, Packet{direction, {bytes.begin(), bytes.begin() + got}});
  }
}

void Wire::passDue() {
  const std::lock_guard lock(mutex_);
  const auto nowNs = Clock::nowNs();
  while (!onTheirWay_.empty() && onTheirWay_.begin()->first <= nowNs) {
    const auto& packet = onTheirWay_.begin()->second;
    const auto& to = packet.direction == Direction::toFar ? far_ : near_;
    static_cast<void>(::write(to.tun.get(), packet.bytes.data(), packet.bytes.size()));
    onTheirWay_.erase(onTheirWay_.begin());
    ++passed_;
  }
}

int Wire::msToNext() const {
  const std::lock_guard lock(mutex_);
  if (onTheirWay_.empty()) return -1;
  const auto leftNs = onTheirWay_.begin()->first - Clock::nowNs();
  return leftNs <= 0 ? 0 : static_cast<int>(leftNs / kNsPerMs + 1);
}

}  // namespace mpf::test
