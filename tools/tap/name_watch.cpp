// SPDX-License-Identifier: MIT
#include "tools/tap/name_watch.h"

#include <poll.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <array>
#include <cstring>

#include "base/timespec.h"
#include "shm/segment.h"

namespace mpf::tools {

NameWatch::NameWatch() : inotify_(::inotify_init1(IN_CLOEXEC | IN_NONBLOCK)) {
  if (inotify_ && ::inotify_add_watch(inotify_.get(), segments::path("").c_str(), IN_CREATE) < 0)
    inotify_.reset();
}

std::optional<std::vector<std::string>> NameWatch::take() {
  if (!inotify_) return std::nullopt;
  std::vector<std::string> names;
  bool lost = false;
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): read() fills it
  alignas(inotify_event) std::array<char, 4096> events;
  for (ssize_t got = 0; (got = ::read(inotify_.get(), events.data(), events.size())) > 0;) {
    for (std::size_t at = 0; at < static_cast<std::size_t>(got);) {
      inotify_event event{};
      std::memcpy(&event, events.data() + at, sizeof event);
      lost = lost || (event.mask & IN_Q_OVERFLOW) != 0;
      if (event.len != 0) names.emplace_back(events.data() + at + sizeof event);
      at += sizeof event + event.len;
    }
  }
  return lost ? std::nullopt : std::optional(std::move(names));
}

void NameWatch::wait(Nanoseconds limit) const noexcept {
  pollfd poll{.fd = inotify_ ? inotify_.get() : -1, .events = POLLIN, .revents = 0};
  const auto timeout = timespecOf(limit);
  ::ppoll(&poll, 1, &timeout, nullptr);
}

}  // namespace mpf::tools
