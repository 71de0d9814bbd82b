// SPDX-License-Identifier: MIT
#include "crate/supervisor/notify_socket.h"

#include <sys/socket.h>
#include <sys/un.h>

#include <array>
#include <cstddef>
#include <cstring>
#include <string_view>

#include "base/system_call.h"

namespace mpf::crate {

NotifySocket::NotifySocket()
    : socket_(
          checkCall(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0), "socket")) {
  const int on = 1;
  checkCall(::setsockopt(socket_.get(), SOL_SOCKET, SO_PASSCRED, &on, sizeof on), "SO_PASSCRED");
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  auto* const raw = reinterpret_cast<sockaddr*>(&address);
  // The kernel chooses an abstract name for an address without one.
  checkCall(::bind(socket_.get(), raw, sizeof(sa_family_t)), "bind", "a socket for reports");
  socklen_t length = sizeof address;
  checkCall(::getsockname(socket_.get(), raw, &length), "getsockname");
  name_ = "@" + std::string(address.sun_path + 1, length - offsetof(sockaddr_un, sun_path) - 1);
}

std::vector<pid_t> NotifySocket::takeReady() const {
  std::vector<pid_t> ready;
  for (std::size_t i = 0; i < kMaxReports; ++i) {
    std::array<char, 4096> text{};
    alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(ucred))> control{};
    iovec part{text.data(), text.size()};
    msghdr message{};
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    const auto length = ::recvmsg(socket_.get(), &message, MSG_CMSG_CLOEXEC);
    if (length < 0) break;
    const std::string report = "\n" + std::string(text.data(), static_cast<std::size_t>(length));
    const auto* const header = CMSG_FIRSTHDR(&message);
    if (header == nullptr || header->cmsg_type != SCM_CREDENTIALS) continue;
    ucred sender{};
    std::memcpy(&sender, CMSG_DATA(header), sizeof sender);
    if (report.find("\nREADY=1") != std::string::npos) ready.push_back(sender.pid);
  }
  return ready;
}

}  // namespace mpf::crate
