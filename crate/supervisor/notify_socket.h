// SPDX-License-Identifier: MIT
// NotifySocket: the supervisor's end of sd_notify(3), by which a process that has no servers, such
// as a router or an IOC, reports that it is ready.
//
//   process ─ "READY=1" to $NOTIFY_SOCKET ─► takeReady() = {its pid}
//
// Threads  one.
// Trust    any process of the host may send to the socket, as much as it likes; the kernel adds the
//          sender's pid.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <string>
#include <vector>

#include <mpf/file_descriptor.h>

namespace mpf::crate {

class NotifySocket {
 public:
  // Datagrams that takeReady() reads at most, so that a sender that never pauses cannot keep its
  // caller from its other work.
  static constexpr std::size_t kMaxReports = 8;

  //   throws  std::system_error
  NotifySocket();

  // The value for NOTIFY_SOCKET. It is an abstract name, because paths may be too long.
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  // Readable while a report waits.
  [[nodiscard]] int descriptor() const noexcept { return socket_.get(); }
  // The pids of processes that have reported that they are ready. Further reports may wait; then
  // the descriptor is still readable.
  [[nodiscard]] std::vector<pid_t> takeReady() const;

 private:
  FileDescriptor socket_;
  std::string name_;
};

}  // namespace mpf::crate
