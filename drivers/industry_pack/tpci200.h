// SPDX-License-Identifier: MIT
// Tpci200: the TEWS TPCI200, a PCI board with four sites, as a carrier.
//
//   Tpci200 carrier({.board = "0000:03:00.0"});
//   auto& site = carrier.site(0);
//
//   request of a chip ──► status bit ──► PCI interrupt ──► /dev/uioN, masked by the kernel
//     ──► thread: acknowledge, mask the line, announce, unmask the PCI interrupt
//
// Without uio_pci_generic the thread reads the status every `pollEvery` instead, and remark() says
// so. If the board is unbound from uio_pci_generic later, Interrupt::isPolled() becomes true. A bus
// cycle that no module answers reads ones.
//
// Threads  any number of callers at a time; accesses of one process to one board are serialised.
//          The thread begins its work with the first enable() of an interrupt. It has the
//          real-time priority of that interrupt where the process may set it.
// Crash    site() locks the site for this process, until the process ends, and masks its
//          interrupts. The other processes on the board mask the lines of a site that has no
//          process.
// Trust    processes with access to the board can disturb each other's sites; the board does not
//          protect them.
// Source   Linux drivers/ipack/carriers/tpci200. Tested on QEMU's model, not on a real board. The
//          model reads zeroes without a module, sets no time-out bits, and loses a request that
//          comes while its line is masked (pollEvery of InterruptThread finds it). The bridge of
//          the board follows PCI 2.2, uio_pci_generic requires 2.3; where it refuses the board,
//          interrupts are polled.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include <mpf/drivers/industry_pack/carrier.h>
#include <mpf/file_descriptor.h>

#include "drivers/industry_pack/file_locks.h"
#include "drivers/industry_pack/pci_interrupt.h"
#include "drivers/industry_pack/tpci200_board.h"

namespace mpf {

struct Tpci200Options {
  std::string board;  // `which` of PciDevice
  std::chrono::microseconds pollEvery{1000};  // used without PCI interrupts
  PciPlaces places;

  // Reads "[ADDRESS|NUMBER][,poll=MICROSECONDS]".
  //   throws  IndustryPackError badAddress, which names the invalid part
  [[nodiscard]] static Tpci200Options parse(const std::string& parameters);
};

class Tpci200Site;

class Tpci200 final : public IndustryPackCarrier {
 public:
  static constexpr std::size_t kSites = 4;

  // Opens the board.
  //   throws  std::runtime_error when the board is absent, not accessible, or bound to another
  //           driver; the message says what to do
  explicit Tpci200(const Tpci200Options& options);
  ~Tpci200() override;

  [[nodiscard]] std::string description() const override { return pci_.description(); }
  [[nodiscard]] std::string remark() const override { return remark_; }
  [[nodiscard]] std::size_t siteCount() const noexcept override { return kSites; }
  //   throws  std::runtime_error when another process has the site, or no thread can be started
  [[nodiscard]] IndustryPackSite& site(std::size_t number) override;

 private:
  friend class Tpci200Site;
  void openInterrupt();
  void claim(std::size_t number);
  void startThread();
  // Called when a line with that priority was enabled: wakes the thread if it must look.
  void watch(int priority) noexcept;
  void run(const std::stop_token& stop);
  // Waits for the first enable(). Returns the priority of that interrupt.
  int awaitLine(const std::stop_token& stop);
  void wait();
  void takeInterrupt();
  // Announces the active lines of this process's sites. Returns whether lines of other sites are
  // active.
  bool serve();
  void maskIfUnowned(std::size_t number);
  void pollFromNowOn() noexcept { isPolled_.store(true, std::memory_order_relaxed); }
  [[nodiscard]] bool hasSomethingToPoll();

  PciDevice pci_;
  std::chrono::microseconds pollEvery_;
  Tpci200Board board_;
  FileLocks locks_;  // one lock for each site
  std::unique_ptr<PciInterrupt> interrupt_;  // used by the thread only, once it runs
  std::atomic<bool> isPolled_{false};
  std::string remark_;
  FileDescriptor wakeUp_;
  static constexpr int kNoLine = -1;
  std::atomic<int> priority_{kNoLine};  // of the line that was enabled first
  std::mutex sitesMutex_;
  std::array<std::unique_ptr<Tpci200Site>, kSites> sites_;
  std::jthread thread_;  // last: ends before the members that it uses
};

}  // namespace mpf
