// SPDX-License-Identifier: MIT
#include "crate/supervisor/control_server.h"

#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>

#include "base/toml/config_errors.h"

namespace mpf::crate {
namespace {

FileDescriptor acceptCaller(const FileDescriptor& listening) {
  return FileDescriptor(::accept4(listening.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
}

std::string lineOf(const nlohmann::json& reply) {
  return reply.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

ssize_t trySend(const FileDescriptor& caller, const std::string& text) noexcept {
  return ::send(caller.get(), text.data(), text.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
}

FileDescriptor openSpare() { return FileDescriptor(::open("/dev/null", O_RDONLY | O_CLOEXEC)); }

}  // namespace

void ControlServer::listen(const CrateFolder& folder) {
  listening_ = listenForControl(folder);
  spare_ = openSpare();
}

void ControlServer::addTo(std::vector<pollfd>& polled) const {
  polled.push_back({listening_.get(), POLLIN, 0});
  for (const auto& caller : callers_) {
    const short awaited = caller.reply.empty() ? POLLIN : POLLOUT;
    polled.push_back({caller.socket.get(), awaited, 0});
  }
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
  auto socket = acceptCaller(listening_);
  if (!socket) {
    if (errno == EMFILE || errno == ENFILE) refuseCaller();
    return;
  }
  if (!spare_) spare_ = openSpare();  // it could not be opened again after refuseCaller()
  if (callers_.size() >= kMaxCallers) callers_.erase(callers_.begin());  // the oldest
  callers_.push_back({std::move(socket), {}, {}});
}

// A caller that is not accepted stays in the queue, so that each poll() returns at once.
void ControlServer::refuseCaller() {
  spare_.reset();
  if (const auto caller = acceptCaller(listening_))
    static_cast<void>(trySend(
        caller, lineOf({{"error", "the supervisor has no file descriptor left; try again"}})));
  spare_ = openSpare();
}

// Returns false when the connection is over.
bool ControlServer::serve(Caller& caller) {
  return caller.reply.empty() ? receive(caller) : sendSome(caller);
}

bool ControlServer::receive(Caller& caller) {
  std::array<char, 4096> bytes{};
  const auto length = ::read(caller.socket.get(), bytes.data(), bytes.size());
  if (length < 0) return errno == EAGAIN || errno == EINTR;
  caller.request.append(bytes.data(), static_cast<std::size_t>(length));
  if (!caller.request.ends_with('\n'))
    return length != 0 && caller.request.size() < kMaxRequestBytes;
  caller.reply = lineOf(replyTo(caller.request));
  return sendSome(caller);
}

nlohmann::json ControlServer::replyTo(const std::string& request) try {
  return answer_(nlohmann::json::parse(request));
} catch (const ConfigError& errors) {
  return {{"fileErrors", errors.what()}};
} catch (const std::exception& error) {
  return {{"error", error.what()}};
}

// A reply may be longer than the buffer of the socket.
bool ControlServer::sendSome(Caller& caller) {
  const auto sent = trySend(caller.socket, caller.reply);
  if (sent < 0) return errno == EAGAIN || errno == EINTR;
  caller.reply.erase(0, static_cast<std::size_t>(sent));
  return !caller.reply.empty();
}

}  // namespace mpf::crate
