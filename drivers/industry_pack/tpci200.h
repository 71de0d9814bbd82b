// SPDX-License-Identifier: MIT
// Tpci200: the TEWS TPCI200, a PCI board with four sites.
//
//   Tpci200 carrier({.board = "0000:03:00.0"});
//   auto& site = carrier.site(0);
//
//   chip asks ──► status bit ──► PCI interrupt ──► /dev/uioN, masked by the kernel ──► thread: acknowledge, mask the line, announce, unmask PCI
//
// Without uio_pci_generic the thread looks at the status every `pollEvery` instead; remark() says so. When it is taken away later, Interrupt does.
// A cycle that no module ends reads ones.
//
// Threads  any; accesses of one process to one board take turns. The thread starts with the first enable() of an interrupt,
//          and has the real-time priority of that interrupt, where the process may have it.
// Crash    site() takes a site for this process, by a lock that ends with it, and masks its interrupts. Lines of a site that nobody has are
//          masked by whoever else uses the board.
// Trust    processes that may use one board can spoil each other's sites: it protects none.
// Source   Linux drivers/ipack/carriers/tpci200; QEMU's model, on which this is tested, not a real board. That model reads zeroes where no
//          module is, sets no time-out, and forgets a request that comes while its line is masked: pollEvery of InterruptThread finds it.
//          The board's bridge is of PCI 2.2, uio_pci_generic wants 2.3: where it refuses the board, interrupts are polled.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include <mpf/base/file_descriptor.h>
#include <mpf/drivers/industry_pack/carrier.h>
#include <mpf/drivers/industry_pack/file_locks.h>
#include <mpf/drivers/industry_pack/pci_interrupt.h>
#include <mpf/drivers/industry_pack/tpci200_board.h>

namespace mpf {

struct Tpci200Options {
  std::string board;  // as PciDevice has it
  std::chrono::microseconds pollEvery{1000};  // where there are no interrupts
  PciPlaces places;

  // "[ADDRESS|NUMBER][,poll=MICROSECONDS]"
  //   throws  IndustryPackError badAddress that names what is wrong
  [[nodiscard]] static Tpci200Options parse(const std::string& parameters);
};

class Tpci200Site;

class Tpci200 final : public IndustryPackCarrier {
 public:
  static constexpr std::size_t kSites = 4;

  //   throws  std::runtime_error in plain words: no board, no right, another driver has it
  explicit Tpci200(const Tpci200Options& options);
  ~Tpci200() override;

  [[nodiscard]] std::string description() const override { return pci_.description(); }
  [[nodiscard]] std::string remark() const override { return remark_; }
  [[nodiscard]] std::size_t siteCount() const noexcept override { return kSites; }
  //   throws  std::runtime_error when another process has it
  [[nodiscard]] IndustryPackSite& site(std::size_t number) override;

 private:
  friend class Tpci200Site;
  void openInterrupt();
  void claim(std::size_t number);
  // A line with that priority was enabled: the thread has something to do.
  void watch(int priority);
  void run(const std::stop_token& stop, int priority);
  void wait();
  void takeInterrupt();
  // Announces what asks. Returns whether something else asks as well.
  bool serve();
  void silenceIfNobodys(std::size_t number);
  void pollFromNowOn() noexcept { isPolled_.store(true, std::memory_order_relaxed); }
  [[nodiscard]] bool hasSomethingToPoll();

  PciDevice pci_;
  std::chrono::microseconds pollEvery_;
  Tpci200Board board_;
  FileLocks locks_;  // of sites
  std::unique_ptr<PciInterrupt> interrupt_;  // after start: the thread's
  std::atomic<bool> isPolled_{false};
  std::string remark_;
  FileDescriptor wakeUp_;
  std::mutex sitesMutex_;
  std::array<std::unique_ptr<Tpci200Site>, kSites> sites_;
  std::jthread thread_;  // last: ends before what it uses
};

}  // namespace mpf
