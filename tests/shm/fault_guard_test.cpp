// SPDX-License-Identifier: MIT
// A peer truncates a file that other processes have mapped. They continue to run, with zeroes or
// with a file that is grown again.
#include "shm/fault_guard.h"

#include <pthread.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <thread>

#include "base/signals_blocked.h"
#include "base/system_call.h"
#include "shm/window.h"
#include "tests/shm/child.h"
#include "tests/shm/endpoint_pair.h"
#include "tests/shm/shm_fixture.h"

namespace mpf::test {
namespace {

using layout::SegmentKind;
using testing::HasSubstr;

// The SIGBUS handler that the program installed before it used MPF: it maps pages of its own.
std::atomic<int> faultsOfTheProgram{0};
void* const kWholePage = reinterpret_cast<void*>(~std::uintptr_t{layout::kPageBytes - 1});

void onFaultOfTheProgram(int, siginfo_t* fault, void*) {
  ++faultsOfTheProgram;
  if (fault->si_code != BUS_ADRERR) return;
  const auto page = reinterpret_cast<std::uintptr_t>(fault->si_addr) &
                    reinterpret_cast<std::uintptr_t>(kWholePage);
  constexpr int kReplacing = MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED;
  if (::mmap(reinterpret_cast<void*>(page), layout::kPageBytes, PROT_READ | PROT_WRITE, kReplacing,
             -1, 0) == MAP_FAILED)
    ::_exit(1);
}

const bool kIsInstalled = [] {
  struct sigaction action{};
  action.sa_sigaction = onFaultOfTheProgram;
  action.sa_flags = SA_SIGINFO;
  return ::sigaction(SIGBUS, &action, nullptr) == 0;
}();

class FaultGuard : public ShmTest {
 protected:
  void SetUp() override { ASSERT_TRUE(kIsInstalled); }
  void TearDown() override {
    segments::remove(file_);
    EXPECT_EQ(faultsOfTheProgram.exchange(0), expectedFaultsOfTheProgram_);
    ShmTest::TearDown();
  }
  // Creates a segment of four pages with the name file_, with data on each page.
  Segment publish() const {
    auto segment = Segment::create(4 * layout::kPageBytes, SegmentKind::bulk, name(), {});
    for (std::size_t page = 0; page < 4; ++page)
      segment.at<std::uint64_t>(page * layout::kPageBytes + 1000) = 7;
    EXPECT_TRUE(segment.tryPublish(file_));
    return segment;
  }
  static void cut(const std::string& file, std::size_t bytes = 0) {
    ASSERT_EQ(::truncate(segments::path(file).c_str(), static_cast<off_t>(bytes)), 0);
  }
  static std::size_t fileBytes(const std::string& file) {
    struct stat status{};
    return ::stat(segments::path(file).c_str(), &status) == 0
               ? static_cast<std::size_t>(status.st_size)
               : 0;
  }
  std::unique_ptr<OwnWindow> makeServer() const {
    return std::make_unique<OwnWindow>(name(), SegmentKind::serverWindow, serverName(), Rights{},
                                       [](layout::SegmentHeader&) {});
  }
  std::string hintsOf(const OwnWindow& window) const {
    return SegmentName::keyed(name(), NameKind::hints, window.header().incarnation);
  }

  std::string file_ = SegmentName::keyed(name(), NameKind::pendingBind, 1);
  int expectedFaultsOfTheProgram_ = 0;
};

TEST_F(FaultGuard, ATruncatedSegmentReadsAsZeroesAndIsLost) {
  const auto segment = publish();
  const auto peers = Segment::tryOpen(file_, SegmentKind::bulk, Segment::Access::readOnly);

  cut(file_, 2 * layout::kPageBytes);
  EXPECT_EQ(segment.at<std::uint64_t>(1000), 7u);
  EXPECT_FALSE(segment.isLost()) << "no access has faulted yet";

  EXPECT_EQ(segment.at<std::uint64_t>(2 * layout::kPageBytes + 1000), 0u);
  EXPECT_TRUE(segment.isLost());
  EXPECT_EQ(segment.at<std::uint64_t>(1000), 0u) << "all pages, at once";
  EXPECT_EQ(peers->at<std::uint64_t>(3 * layout::kPageBytes + 1000), 0u) << "mapped for reading";
  EXPECT_TRUE(peers->isLost());
}

TEST_F(FaultGuard, WritesToALostSegmentStayInThisProcess) {
  const auto segment = publish();
  cut(file_);

  segment.at<std::uint64_t>(3 * layout::kPageBytes) = 5;

  EXPECT_EQ(segment.at<std::uint64_t>(3 * layout::kPageBytes), 5u);
  EXPECT_EQ(fileBytes(file_), 0u);
}

TEST_F(FaultGuard, LeavesOtherSegmentsUnchanged) {
  const auto segment = publish();
  segments::remove(file_);
  const auto other = publish();
  cut(file_);

  EXPECT_EQ(other.at<std::uint64_t>(1000), 0u);

  EXPECT_EQ(segment.at<std::uint64_t>(1000), 7u);
  EXPECT_FALSE(segment.isLost());
}

TEST_F(FaultGuard, TheOwnerGrowsTruncatedHintsAgain) {
  const auto server = makeServer();
  const auto peer = PeerWindow::tryOpen(serverName(), SegmentKind::serverWindow);
  cut(hintsOf(*server));

  server->ring();
  peer->notify(5);

  EXPECT_EQ(server->hints().readyBits[0].load(std::memory_order_relaxed), 1u << 5);
  EXPECT_EQ(fileBytes(hintsOf(*server)), sizeof(layout::WindowHints));
  EXPECT_FALSE(peer->isLost());
}

TEST_F(FaultGuard, APeerGrowsTruncatedHintsAgain) {
  const auto server = makeServer();
  const auto peer = PeerWindow::tryOpen(serverName(), SegmentKind::serverWindow);
  const auto other = PeerWindow::tryOpen(serverName(), SegmentKind::serverWindow);
  cut(hintsOf(*server));

  peer->notify(5);
  other->notify(6);

  EXPECT_EQ(server->hints().readyBits[0].load(std::memory_order_relaxed), 3u << 5);
  EXPECT_FALSE(peer->isLost());
}

TEST_F(FaultGuard, NewPeersCanOpenTruncatedOrOverwrittenHints) {
  const auto server = makeServer();
  const auto hints = hintsOf(*server);
  cut(hints);
  server->ring();
  EXPECT_TRUE(PeerWindow::tryOpen(serverName(), SegmentKind::serverWindow));
  cut(hints, 600);  // within a page: no access faults
  EXPECT_TRUE(PeerWindow::tryOpen(serverName(), SegmentKind::serverWindow));
  EXPECT_EQ(fileBytes(hints), sizeof(layout::WindowHints));

  auto& header = server->hints().header;
  std::fill_n(reinterpret_cast<std::byte*>(&header), sizeof header, std::byte{0xa5});

  const auto peer = PeerWindow::tryOpen(serverName(), SegmentKind::serverWindow);
  ASSERT_TRUE(peer);
  peer->notify(5);
  EXPECT_EQ(server->hints().readyBits[0].load(std::memory_order_relaxed), 1u << 5);
}

TEST_F(FaultGuard, ATruncatedWindowIsLostToItsPeers) {
  const auto server = makeServer();
  const auto peer = PeerWindow::tryOpen(serverName(), SegmentKind::serverWindow);
  cut(serverName());

  EXPECT_FALSE(peer->isClosed());

  EXPECT_TRUE(peer->isLost());
  EXPECT_TRUE(peer->hasOwner());
}

TEST_F(FaultGuard, ATruncatedLinkAndTruncatedChunksAreLost) {
  End server(backplane_, "server", WaitMode::block);
  End client(backplane_, "", WaitMode::block);
  const auto link = connect(client, server);
  ASSERT_EQ(send(link.client, 1, 5000), LinkSend::sent);
  ASSERT_TRUE(link.server.incoming().hasMessage());
  const auto envelope = link.server.incoming().begin();
  const auto chunk = link.server.tryChunk(envelope.bodyBytes);
  ASSERT_TRUE(chunk);
  cut(SegmentName::bulk(name(), link.client.header().incarnation, 0, 0));

  EXPECT_EQ(chunk->data[0], std::byte{0});
  EXPECT_FALSE(link.server.tryChunk(envelope.bodyBytes)) << "its chunks can no longer be read";
  link.server.release(chunk->data);
  link.server.incoming().end();

  cut(link.client.name());
  EXPECT_FALSE(link.server.incoming().hasMessage());
  EXPECT_EQ(link.server.peerState(), layout::LinkState::none);
  EXPECT_TRUE(link.server.isLost());
}

TEST_F(FaultGuard, RepairsAFaultInAnInternalThread) {
  const auto segment = publish();
  cut(file_);
  const SignalsBlocked blocked;

  std::thread([&] { EXPECT_EQ(segment.at<std::uint64_t>(1000), 0u); }).join();

  EXPECT_TRUE(segment.isLost());
}

TEST_F(FaultGuard, RepairsFaultsOfManyThreadsAtOnce) {
  for (int round = 0; round < 50; ++round) {
    const auto segment = publish();
    cut(file_);
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; ++i) {
      threads.emplace_back(
          [&] { EXPECT_EQ(segment.at<std::uint64_t>(3 * layout::kPageBytes + 1000), 0u); });
    }
    for (auto& thread : threads) thread.join();
    segments::remove(file_);
  }
}

TEST_F(FaultGuard, PassesOtherFaultsToThePreviousHandler) {
  const auto segment = publish();
  const FileDescriptor file(checkCall(::memfd_create("not ours", MFD_CLOEXEC), "memfd_create"));
  auto* const page = static_cast<volatile char*>(
      ::mmap(nullptr, layout::kPageBytes, PROT_READ, MAP_SHARED, file.get(), 0));
  ASSERT_NE(page, MAP_FAILED);

  EXPECT_EQ(page[0], 0);
  ::raise(SIGBUS);

  ::munmap(const_cast<char*>(page), layout::kPageBytes);
  expectedFaultsOfTheProgram_ = 2;
}

TEST_F(FaultGuard, OverwrittenHintsAreRemovedWhenTheirOwnerIsDead) {
  Child child([&](Child::Self& self) {
    const auto server = makeServer();
    std::fill_n(reinterpret_cast<std::byte*>(&server->hints().header), layout::kHeaderBytes,
                std::byte{0xa5});
    self.stay();
  });
  EXPECT_THAT(backplane_.removeDead(), testing::IsEmpty());

  child.end(SIGKILL);

  EXPECT_EQ(backplane_.removeDead().size(), 3u) << "window, hints, pipe";
}

// A program that installs its handler later calls tryRepair() first.
TEST_F(FaultGuard, ReportsToALaterHandlerWhatItRepaired) {
  const auto segment = publish();
  cut(file_);
  siginfo_t fault{};
  fault.si_code = BUS_ADRERR;

  fault.si_addr = segment.data() + 100;
  EXPECT_TRUE(fault_guard::tryRepair(fault));
  fault.si_addr = &fault;
  EXPECT_FALSE(fault_guard::tryRepair(fault));
  fault.si_addr = segment.data() + segment.bytes();
  EXPECT_FALSE(fault_guard::tryRepair(fault));
}

}  // namespace
}  // namespace mpf::test
