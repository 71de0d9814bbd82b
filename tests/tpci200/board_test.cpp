// SPDX-License-Identifier: MIT
// The carrier on QEMU's model of the TPCI200, with an Octal 232 at sites IP_a and IP_b. Runs as
// root in the machine of this folder, first without a kernel driver for the board (tests of
// PolledBoard), then with uio_pci_generic.
#include <poll.h>
#include <signal.h>
#include <sys/fsuid.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <gmock/gmock.h>

#include <mpf/drivers/industry_pack/id_prom.h>
#include <mpf/drivers/industry_pack/industry_pack_error.h>

#include "drivers/industry_pack/tpci200.h"
#include "drivers/octal_uart/scc2698b.h"

namespace mpf::test {
namespace {

// NOLINTNEXTLINE(google-build-using-namespace): the names of the data sheet
using namespace scc2698b;
using testing::HasSubstr;

// Causes interrupts with a channel: its transmitter is ready, so the channel requests an interrupt
// while its mask bit is set.
class InterruptSource {
 public:
  InterruptSource(IndustryPackSite& site, int channel)
      : io_(site.io()), line_(site.interrupt(channel / 4)), channel_(channel) {
    io_.write8(at(channel, kCr), kCrResetTx);
    io_.write8(at(channel, kCr), kCrEnableTx);
  }
  ~InterruptSource() { request(false); }
  InterruptSource(const InterruptSource&) = delete;
  InterruptSource& operator=(const InterruptSource&) = delete;

  void request(bool on) {
    io_.write8(atBlock(channel_ / 2, kImr), on ? isrOf(channel_, kIsrTxRdy) : std::uint8_t{0});
  }
  // Causes one interrupt, waits for it and serves it.
  void interruptOnce() {
    line_.enable();
    request(true);
    pollfd readable{.fd = line_.descriptor(), .events = POLLIN, .revents = 0};
    ASSERT_EQ(::poll(&readable, 1, -1), 1);
    EXPECT_EQ(line_.take(), 1U);
    request(false);
  }

 private:
  Registers& io_;
  Interrupt& line_;
  int channel_;
};

TEST(PolledBoard, IsEnabledAndPassesInterrupts) {
  Tpci200 carrier({});
  EXPECT_THAT(carrier.remark(), HasSubstr("modprobe uio_pci_generic"));
  InterruptSource source(carrier.site(0), 0);
  for (int i = 0; i < 10; ++i) source.interruptOnce();
}

TEST(PolledBoard, RequiresThePermissionsOfRoot) {
  ::setfsuid(65534);
  try {
    const Tpci200 carrier({});
    ADD_FAILURE() << "a user without permission can open the board";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("no permission to read and write /sys/bus/pci/devices/"));
  }
  ::setfsuid(0);
}

TEST(Board, HasTheIdPromsOfItsModules) {
  Tpci200 carrier({});
  for (const std::size_t i : {0U, 1U}) {
    const auto prom = readIdProm(carrier.site(i).id(), siteName(i));
    EXPECT_EQ(prom.manufacturer, 0xf0U);
    EXPECT_EQ(prom.model, 0x22);
    EXPECT_EQ(prom.revision, 0xa1);
    EXPECT_TRUE(prom.hasValidCrc);
  }
  EXPECT_THROW(static_cast<void>(readIdProm(carrier.site(2).id(), "IP_c")), IndustryPackError);
}

TEST(Board, HasRegistersOfEachWidthAtTheirAddresses) {
  Tpci200 carrier({});
  auto& io = carrier.site(0).io();
  const auto mode = at(5, kMr);
  const auto rewind = [&] { io.write8(at(5, kCr), kCrResetMr); };
  rewind();
  io.write8(mode, 0x13);
  io.write16(mode - 1, 0x0007);
  rewind();
  EXPECT_EQ(io.read8(mode), 0x13);
  EXPECT_EQ(io.read16(mode - 1), 0x0007);
  EXPECT_EQ(carrier.site(0).id().read32(0), 0x00490050U);
}

TEST(Board, InterruptsThroughTheKernel) {
  Tpci200 carrier({});
  EXPECT_EQ(carrier.remark(), "");
  InterruptSource onLine0(carrier.site(0), 1);
  InterruptSource onLine1(carrier.site(1), 6);
  for (int i = 0; i < 100; ++i) {
    onLine0.interruptOnce();
    onLine1.interruptOnce();
  }
}

TEST(Board, IsSharedByProcesses) {
  const auto child = ::fork();
  if (child == 0) {
    Tpci200 carrier({});
    InterruptSource source(carrier.site(1), 0);
    for (int i = 0; i < 200; ++i) source.interruptOnce();
    ::_exit(testing::Test::HasFailure() ? 1 : 0);
  }
  {
    Tpci200 carrier({});
    InterruptSource source(carrier.site(0), 0);
    for (int i = 0; i < 200; ++i) source.interruptOnce();
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
}

TEST(Board, ReservesASiteForOneProcessUntilThatEnds) {
  std::array<int, 2> ready{};
  ASSERT_EQ(::pipe(ready.data()), 0);
  const auto child = ::fork();
  if (child == 0) {
    Tpci200 carrier({});
    static_cast<void>(carrier.site(0));
    static_cast<void>(::write(ready[1], "x", 1) + ::pause());
    ::_exit(0);
  }
  char byte = 0;
  ASSERT_EQ(::read(ready[0], &byte, 1), 1);
  Tpci200 carrier({});
  try {
    static_cast<void>(carrier.site(0));
    ADD_FAILURE() << "two processes have the site";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("site IP_a is in use by another process"));
  }
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  static_cast<void>(carrier.site(0));
}

// A process is stopped or killed while its module requests an interrupt. Other processes still get
// their interrupts.
TEST(Board, ServesOtherProcessesWhenOneIsStoppedOrKilled) {
  std::array<int, 2> ready{};
  ASSERT_EQ(::pipe(ready.data()), 0);
  const auto child = ::fork();
  if (child == 0) {
    Tpci200 carrier({});
    carrier.site(1).interrupt(0).enable();
    static_cast<void>(::write(ready[1], "x", 1) + ::pause());
    ::_exit(0);
  }
  char byte = 0;
  ASSERT_EQ(::read(ready[0], &byte, 1), 1);
  Tpci200 carrier({});
  InterruptSource source(carrier.site(0), 0);
  source.interruptOnce();
  ::kill(child, SIGSTOP);
  ASSERT_EQ(::waitpid(child, nullptr, WUNTRACED), child);
  const PciDevice board({}, {.name = "TPCI200", .vendor = 0x1498, .device = 0x30c8}, "");
  const auto window = board.map(3, 0x100, 0x80);
  MemoryRegisters registersOfChild(window.data(), window.size());
  registersOfChild.write8(at(0, kCr), kCrEnableTx);
  registersOfChild.write8(atBlock(0, kImr), kIsrTxRdy);
  for (int i = 0; i < 20; ++i) source.interruptOnce();
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  for (int i = 0; i < 100; ++i) source.interruptOnce();
  registersOfChild.write8(atBlock(0, kImr), 0);
}

}  // namespace
}  // namespace mpf::test
