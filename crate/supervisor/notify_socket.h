// SPDX-License-Identifier: MIT
// NotifySocket: the supervisor's end of sd_notify(3), by which a process that has no servers, such
// as a router or an IOC, reports that it is ready.
//
//   process ─ "READY=1" to $NOTIFY_SOCKET ─► takeReady() = its pid
//
// Threads  one.
// Trust    any process of the host may send to the socket; the kernel adds the sender's pid.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>

#include <mpf/file_descriptor.h>

namespace mpf::crate {

class NotifySocket {
 public:
  //   throws  std::system_error
  NotifySocket();

  // The value for NOTIFY_SOCKET. It is an abstract name, because paths may be too long.
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  // Readable while a report waits.
  [[nodiscard]] int descriptor() const noexcept { return socket_.get(); }
  // The pid of the next process that has reported that it is ready; nullopt: none has.
  [[nodiscard]] std::optional<pid_t> takeReady() const;

 private:
  FileDescriptor socket_;
  std::string name_;
};

}  // namespace mpf::crate
