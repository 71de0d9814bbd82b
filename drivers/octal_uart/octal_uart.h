// SPDX-License-Identifier: MIT
// OctalUart: driver of a GreenSpring (SBS) Octal 232, 422 or 485 module with its SCC2698B chip: the
// part that all ports of the module share (manual, "OctalUART Support").
//
//   OctalUart uart(module, {.ports = 8, .vector = 100});
//   const auto port = openOctalUartPort(uart, 3, {.settings = {.baud = 38400}});
//
//   request lines 0, 1 ──► an InterruptThread each ──► serves the chip until it has no request
//                          every pollEvery         ──► the same, and checks that the chip is
//                                                      present and still set up
//
// When the module does not answer (all bits read as ones), was reset, or was replaced by another
// model, all of its ports become unplugged. Each port tries to open again; the first one that finds
// the module sets it up. A module of another model is not written to.
//
// Threads  two threads of its own, and one for each port. One mutex guards the chip; it is held
//          only for as long as some bytes need.
// Crash    the carrier masks the interrupts when it is opened again.
// Trust    the far ends of the lines may send anything at any time; see SerialPort.
// Source   SCC2698B data sheet; GreenSpring IP-Octal manuals; tyGSOctal of drvIpac for the vector,
//          RS-485 and the order of commands.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <mpf/drivers/industry_pack/interrupt_thread.h>
#include <mpf/drivers/industry_pack/module.h>

#include "base/inheriting_mutex.h"
#include "drivers/octal_uart/octal_uart_channel.h"

namespace mpf {

inline const ModuleKind kOctalUart{
    "GreenSpring Octal 232, 422 or 485", kGreenSpring, {0x22, 0x2a, 0x48}};

struct OctalUartOptions {
  int ports = 8;  // 4 on a Quad module
  int vector = 0;  // 0 to 255; intVec of initOctalUART
  // For each request line; see InterruptThreadOptions.
  std::chrono::milliseconds pollEvery{10};
  int stormLimit = 1000;
  std::chrono::milliseconds stormPause{1000};
};

enum class OctalUartAlarm : std::uint8_t {
  lost,  // the module does not answer, or was reset
  storm,  // a request line is stuck active
  noInterrupts,  // the chip has requests, and a request line stays inactive or is polled
};

class OctalUart {
 public:
  // Called once each time a problem begins.
  //   what  a sentence that names the module and the problem
  // Runs on a thread of this object; must not block, throw or destroy ports.
  using AlarmHandler = std::function<void(OctalUartAlarm alarm, const std::string& what)>;

  // Sets up the chip and enables its interrupts.
  //   module  outlives this object
  //   throws  std::invalid_argument unless there are 4 or 8 ports; IndustryPackError badVector, or
  //           badAddress when the site has no memory space, which contains the vector register;
  //           std::system_error when no thread or descriptor can be created
  OctalUart(IndustryPackModule& module, const OctalUartOptions& options);
  // To be destroyed after its ports. Disables the chip, if it is present.
  ~OctalUart();
  OctalUart(const OctalUart&) = delete;
  OctalUart& operator=(const OctalUart&) = delete;

  // Sets the function for alarms. It also receives, soon, up to 100 alarms from before the call.
  void onAlarm(AlarmHandler handler);
  [[nodiscard]] IndustryPackModule& module() noexcept { return module_; }
  [[nodiscard]] int ports() const noexcept { return options_.ports; }
  [[nodiscard]] bool isRs485() const noexcept { return isRs485_; }

  struct Counters {
    std::uint64_t interrupts = 0;
    std::uint64_t spurious = 0;  // interrupts without a request of the chip
    std::uint64_t alarms = 0;
  };
  [[nodiscard]] Counters counters() const;

  // --- for OctalUartLine
  // Reserves a port, so that no other line can use it.
  //   throws  std::invalid_argument when the module has no such port, or the port is in use
  void reservePort(int number);
  void releasePort(int number) noexcept;
  // Opens a channel, and sets up the chip first if that is necessary.
  //   returns  empty; or a sentence that says why the module cannot be used
  [[nodiscard]] std::string tryOpen(int number, const SerialSettings& settings);
  // Calls `use` with a channel, under the lock, and returns its result.
  template <class Use>
  decltype(auto) with(int number, Use use) {
    const std::lock_guard lock(mutex_);
    return use(channels_.at(static_cast<std::size_t>(number)));
  }

 private:
  void setUp();
  void startThread(int line);
  bool serve(int line, InterruptThread::Cause cause);
  bool serveInterrupt(int line);
  bool servePoll(int line);
  void note(int line, InterruptFault fault);
  [[nodiscard]] std::string textOf(int line, InterruptFault fault) const;
  bool serveBlocks(int first, int count);
  std::uint8_t pendingOf(int block);
  void serveBlock(int block, std::uint8_t pending);
  void checkPresence();
  void loseIfAbsent(bool isSuspected);
  void lose(const std::string& because);
  void raise(OctalUartAlarm alarm, std::string what);
  void reportAlarms();

  IndustryPackModule& module_;
  Registers& io_;
  const OctalUartOptions options_;
  const bool isRs485_;

  // Guards the chip and the members up to pendingAlarms_. Priority inheritance, so that a port's
  // thread that has locked it does not delay a real-time interrupt thread.
  mutable InheritingMutex mutex_;
  bool isReady_ = false;  // the chip is present and set up
  std::array<std::uint8_t, scc2698b::kBlocks> imr_{};
  std::vector<OctalUartChannel> channels_;
  std::vector<bool> isReserved_;
  std::uint64_t alarmCount_ = 0;
  std::vector<std::pair<OctalUartAlarm, std::string>> pendingAlarms_;  // not reported yet

  std::mutex alarmMutex_;  // locked while the handler runs
  AlarmHandler alarmHandler_;
  // one for each request line; last: they end before the members that they use
  std::array<std::unique_ptr<InterruptThread>, 2> threads_;
};

}  // namespace mpf
