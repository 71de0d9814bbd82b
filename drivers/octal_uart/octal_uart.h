// SPDX-License-Identifier: MIT
// OctalUart: a GreenSpring (SBS) Octal 232, 422 or 485 with its SCC2698B, and what all its ports
// share (manual, "OctalUART Support").
//
//   OctalUart uart(module, {.ports = 8, .vector = 100});
//   OctalUartPort port(uart, 3, {.baud = 38400});            // a SerialPort
//
//   request lines 0, 1 ──► InterruptThread each ──► chip read until it asks for nothing ──► ports' threads
//   every pollEvery    ──► the same, and: is it there, is it as it was set up?
//
// A module that does not answer (all bits read as ones), that was reset, or in whose place is
// another model, takes its ports' lines away: they are unplugged. They look for it again ever less
// often, and the first to find it sets it up anew. Another model is not written to.
//
// Threads  two of its own; ports have theirs. One lock for the chip, never held longer than some
//          bytes take.
// Crash    interrupts stay masked at the carrier when it is opened again.
// Trust    the far ends of its lines may send anything at any time; see SerialPort.
// Source   SCC2698B data sheet; GreenSpring IP-Octal manuals; drvIpac's tyGSOctal for vector,
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
  int vector = 0;  // initOctalUART's intVec
  std::chrono::milliseconds pollEvery{10};
  int stormLimit = 1000;  // of a request line; see InterruptThreadOptions
  std::chrono::milliseconds stormPause{1000};
};

enum class OctalUartAlarm : std::uint8_t {
  lost,  // it does not answer, or was reset
  storm,  // interrupts for which it has nothing, on one of its request lines
  noInterrupts,  // it has something and does not interrupt, on one of its request lines
};

class OctalUart {
 public:
  // Told what went wrong, once each time it begins; soon of what began when nobody was to be told.
  // Runs on a thread of this; must not block, throw, or destroy ports.
  using AlarmHandler = std::function<void(OctalUartAlarm alarm, const std::string& what)>;

  //   module  outlives this
  //   throws  std::invalid_argument unless there are 4 or 8 ports; IndustryPackError badAddress
  //           when the carrier gives the site no memory, where the vector is; badVector;
  //           std::system_error
  OctalUart(IndustryPackModule& module, const OctalUartOptions& options);
  // After the ports. The chip is silent then, if it is still there.
  ~OctalUart();
  OctalUart(const OctalUart&) = delete;
  OctalUart& operator=(const OctalUart&) = delete;

  void onAlarm(AlarmHandler handler);
  [[nodiscard]] IndustryPackModule& module() noexcept { return module_; }
  [[nodiscard]] int ports() const noexcept { return options_.ports; }
  [[nodiscard]] bool isRs485() const noexcept { return isRs485_; }

  struct Counters {
    std::uint64_t interrupts = 0;
    std::uint64_t spurious = 0;  // for which the chip had nothing
    std::uint64_t alarms = 0;
  };
  [[nodiscard]] Counters counters() const;

  // For lines: who has a port. The name is for the error.
  //   throws  std::invalid_argument when there is no such port, or it is taken
  void takePort(int number);
  void leavePort(int number) noexcept;
  // Sets the chip up if it has to be, then `use`s the channel, with the lock. Returns empty, or why
  // the module is not there.
  [[nodiscard]] std::string tryOpen(int number, const SerialSettings& settings);
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
  void note(int line, InterruptTrouble trouble);
  [[nodiscard]] std::string textOf(int line, InterruptTrouble trouble) const;
  bool serveBlocks(int first, int count);
  std::uint8_t pendingOf(int block);
  void serveBlock(int block, std::uint8_t pending);
  void checkPresence();
  void lookAt(bool mayBeGone);
  void lose(const std::string& because);
  void raise(OctalUartAlarm alarm, std::string what);
  void tellAlarms();

  IndustryPackModule& module_;
  Registers& io_;
  const OctalUartOptions options_;
  const bool isRs485_;

  // Of the chip, and of all below but the last. A port's thread that holds it must not be slower
  // than the interrupt.
  mutable InheritingMutex mutex_;
  bool isReady_ = false;  // set up, and there
  std::array<std::uint8_t, scc2698b::kBlocks> imr_{};
  std::vector<OctalUartChannel> channels_;
  std::vector<bool> isTaken_;
  std::uint64_t alarmCount_ = 0;
  std::vector<std::pair<OctalUartAlarm, std::string>> alarms_;  // to be told

  std::mutex alarmMutex_;  // held while the handler runs
  AlarmHandler alarmHandler_;
  // of the request lines; last: they end before what they use
  std::array<std::unique_ptr<InterruptThread>, 2> threads_;
};

}  // namespace mpf
