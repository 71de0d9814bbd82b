// SPDX-License-Identifier: MIT
// An output of a DAC128V, with the messages of its server.
#include "tests/epics/epics_fixture.h"

namespace mpf::test {
namespace {

using Dac128vRecordTest = EpicsTest;

TEST_F(Dac128vRecordTest, WritesTheCodeOfItsChannel) {
  std::atomic<std::int32_t> address = -1;
  std::atomic<std::int32_t> code = -1;
  const ThreadServer server(backplane_, "b-DAC", [&](MessageServer& self, Message&& request) {
    auto* fields = request.tryAs<Int32>();
    address = fields->address;
    code = fields->value;
    fields->status = fields->value > 4095 ? -1 : 0;
    static_cast<void>(self.reply(std::move(request)));
  });
  const Ioc ioc(R"(record(ao, "o") {
    field(DTYP, "dac128V") field(OUT, "#C0 S5 @b-DAC") field(LINR, "LINEAR")
    field(EGUL, "-10") field(EGUF, "10") field(VAL, "5") field(PINI, "YES")
  })");

  while (code == -1) std::this_thread::yield();

  EXPECT_EQ(address, 5);
  EXPECT_EQ(code, 3071);
  EXPECT_EQ(Ioc::get("o"), "5") << "the value of the database is kept";

  ASSERT_EQ(Ioc::put("o", "10.5"), 0);
  Ioc::waitFor("o.STAT", "WRITE");
  EXPECT_EQ(Ioc::get("o.SEVR"), "INVALID");
  EXPECT_EQ(Ioc::get("o.AMSG"), "the server refused the value");
}

}  // namespace
}  // namespace mpf::test
