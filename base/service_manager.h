// SPDX-License-Identifier: MIT
// ServiceManager: reports the state of the program to systemd, with one datagram to $NOTIFY_SOCKET
// (sd_notify(3)). Does nothing when the variable is not set. If systemd does not read, a report is
// lost after 100 ms.
#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace mpf {

class ServiceManager {
 public:
  static void notifyReady() noexcept { notify("READY=1"); }
  static void notifyReloading() noexcept;
  static void notifyStopping() noexcept { notify("STOPPING=1"); }
  // The program is still stopping. After TimeoutStopSec=, systemd kills it unless this came within
  // the last 30 s.
  static void notifyStillStopping() noexcept { notify("EXTEND_TIMEOUT_USEC=30000000"); }
  // One line that `systemctl status` shows.
  static void notifyStatus(const std::string& status) noexcept { notify("STATUS=" + status); }
  // Tells systemd that the program makes progress; due twice within watchdogTime().
  static void notifyAlive() noexcept { notify("WATCHDOG=1"); }
  // WatchdogSec= of the unit, at most a day; nullopt: systemd does not watch this process.
  [[nodiscard]] static std::optional<std::chrono::microseconds> watchdogTime() noexcept;

 private:
  static void notify(const std::string& state) noexcept;
};

}  // namespace mpf
