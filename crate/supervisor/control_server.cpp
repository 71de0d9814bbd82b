// SPDX-License-Identifier: MIT
#include "crate/supervisor/control_server.h"

#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>

namespace mpf::crate {

void ControlServer::addTo(std::vector<pollfd>& polled) const {
  polled.push_back({listening_.get(), POLLIN, 0});
  for (const auto& caller : callers_) polled.push_back({caller.socket.get(), POLLIN, 0});
}

void ControlServer::handle(const std::vector<pollfd>& polled) {
  std::vector<Caller> kept;
  for (std::size_t i = 0; i < callers_.size(); ++i) {
    if (polled[i + 1].revents == 0 || serve(callers_[i])) kept.push_back(std::move(callers_[i]));
  }
  callers_ = std::move(kept);
  if (polled[0].revents != 0) accept();
}

void ControlServer::accept() {
  constexpr std::size_t kMaxCallers = 64;
  FileDescriptor socket(
      ::accept4(listening_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
  if (socket.get() < 0) return;
  if (callers_.size() >= kMaxCallers) callers_.erase(callers_.begin());  // the oldest
  callers_.push_back({std::move(socket), {}});
}

// Returns false when the connection is over.
bool ControlServer::serve(Caller& caller) {
  std::array<char, 4096> bytes{};
  const auto length = ::read(caller.socket.get(), bytes.data(), bytes.size());
  if (length < 0) return errno == EAGAIN || errno == EINTR;
  caller.request.append(bytes.data(), static_cast<std::size_t>(length));
  if (!caller.request.ends_with('\n'))
    return length != 0 && caller.request.size() < kMaxRequestBytes;
  nlohmann::json reply;
  try {
    reply = answer_(nlohmann::json::parse(caller.request));
  } catch (const std::exception& error) {
    reply = {{"error", error.what()}};
  }
  const auto text = reply.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
  static_cast<void>(
      ::send(caller.socket.get(), text.data(), text.size(), MSG_NOSIGNAL | MSG_DONTWAIT));
  return false;
}

}  // namespace mpf::crate
