// SPDX-License-Identifier: MIT
#include "server/programs/gpib_server/sniff_source.h"

#include <gmock/gmock.h>

#include <mpf/gpib_sniff.h>

#include "tests/drivers/gpib/fake_controller.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;
using gpib::SniffRecord;

TEST(GpibSniffSource, ShowsARecordForEachByteUntilItsTapIsDestroyed) {
  FakeGpib fake;
  GpibBus bus(fake.makeController());
  std::vector<std::pair<int, char>> seen;
  auto tap = sniffSourceOf(bus)([&](std::span<const SniffBytes> records) {
    for (const auto& bytes : records) {
      const auto record = SniffRecord::tryRead(bytes);
      ASSERT_TRUE(record);
      seen.emplace_back(record->flags, static_cast<char>(record->value));
    }
  });

  ASSERT_TRUE(bus.writeRead({22}, bytesOf("ab"), {.maxBytes = 9}, Deadline::after(60s)).ok());
  tap.reset();
  ASSERT_TRUE(bus.write({22}, bytesOf("c"), Deadline::after(60s)).ok());

  constexpr int kReceived = SniffRecord::kReceived;
  constexpr int kEnd = SniffRecord::kEnd;
  EXPECT_THAT(
      seen, testing::ElementsAre(std::pair(0, 'a'), std::pair(kEnd, 'b'), std::pair(kReceived, 'a'),
                                 std::pair(kReceived | kEnd, 'b')));
}

}  // namespace
}  // namespace mpf::test
