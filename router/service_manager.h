// SPDX-License-Identifier: MIT
// ServiceManager: tells systemd how the program is doing (sd_notify(3), whose protocol is one
// datagram to $NOTIFY_SOCKET). Without a service manager it tells nobody.
#pragma once

#include <string>

namespace mpf::router {

class ServiceManager {
 public:
  static void tellReady() noexcept { tell("READY=1"); }
  static void tellReloading() noexcept;
  static void tellStopping() noexcept { tell("STOPPING=1"); }

 private:
  static void tell(const std::string& state) noexcept;
};

}  // namespace mpf::router
