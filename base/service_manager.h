// SPDX-License-Identifier: MIT
// ServiceManager: reports the state of the program to systemd, with one datagram to $NOTIFY_SOCKET
// (sd_notify(3)). Does nothing when the variable is not set.
#pragma once

#include <string>

namespace mpf {

class ServiceManager {
 public:
  static void notifyReady() noexcept { notify("READY=1"); }
  static void notifyReloading() noexcept;
  static void notifyStopping() noexcept { notify("STOPPING=1"); }

 private:
  static void notify(const std::string& state) noexcept;
};

}  // namespace mpf
