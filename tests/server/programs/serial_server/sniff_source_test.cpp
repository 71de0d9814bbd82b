// SPDX-License-Identifier: MIT
#include "server/programs/serial_server/sniff_source.h"

#include <array>
#include <gmock/gmock.h>

#include "tests/server/programs/serial_server/serial_fixture.h"

namespace mpf::test {
namespace {

class SniffSourceTest : public SerialServerTest {};

TEST_F(SniffSourceTest, ShowsARecordForEachByteUntilItsTapIsDestroyed) {
  using serial::SniffKind;
  using serial::SniffRecord;
  const std::array bytes{PeekedByte{1, 'a', ByteDirection::sent, LineFault::none},
                         PeekedByte{2, 'b', ByteDirection::received, LineFault::parity}};
  std::vector<SniffRecord> seen;
  auto tap = sniffSourceOf(port_)([&](std::span<const SniffBytes> records) {
    for (const auto& record : records) seen.push_back(*SniffRecord::tryRead(record));
  });

  port_.taps().show(bytes);
  tap.reset();
  port_.taps().show(bytes);

  EXPECT_THAT(seen, testing::ElementsAre(SniffRecord{1, SniffKind::sent, 'a'},
                                         SniffRecord{2, SniffKind::damaged, 'b'}));
}

}  // namespace
}  // namespace mpf::test
