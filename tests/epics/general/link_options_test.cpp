// SPDX-License-Identifier: MIT
#include "epics/general/link_options.h"

#include <gmock/gmock.h>
#include <stdexcept>
#include <string>

namespace mpf::test {
namespace {

using Mode = LinkOptions::Mode;
using testing::HasSubstr;
using testing::ThrowsMessage;

LinkOptions input(std::string_view text) {
  return LinkOptions::parse(text, {MessageType::float64, Mode::read});
}
LinkOptions output(std::string_view text) {
  return LinkOptions::parse(text, {MessageType::int32, Mode::write});
}

TEST(LinkOptions, HasTheDefaultsOfTheRecordWithoutParameters) {
  const auto options = input("");

  EXPECT_EQ(options.type, MessageType::float64);
  EXPECT_EQ(options.mode, Mode::read);
  EXPECT_EQ(options.cmd, 0);
  EXPECT_FALSE(options.timeout || options.mask || options.shift || options.readback);
  EXPECT_FALSE(options.selectsBits());
}

TEST(LinkOptions, HasEachKeyOfAnInput) {
  const auto options = input(
      "type=int32Array cmd=-1, address=0x10,extra=0xffffffff value=2.5 timeout=1.5  mode=subscribe "
      "mask=0xffffffff shift=31 range=-10:5.5");

  EXPECT_EQ(options.type, MessageType::int32Array);
  EXPECT_EQ(options.mode, Mode::subscribe);
  EXPECT_EQ(options.cmd, -1);
  EXPECT_EQ(options.address, 16);
  EXPECT_EQ(options.extra, -1);
  EXPECT_EQ(options.value, 2.5);
  EXPECT_EQ(options.timeout, 1.5);
  EXPECT_EQ(options.mask, 0xffffffffU);
  EXPECT_EQ(options.shift, 31);
  ASSERT_TRUE(options.range);
  EXPECT_EQ(options.range->low, -10);
  EXPECT_EQ(options.range->high, 5.5);
}

TEST(LinkOptions, HasTheKeysOfAnOutput) {
  const auto options = output("readback=7 rewrite=yes mode=write");

  EXPECT_EQ(options.readback, 7);
  EXPECT_TRUE(options.rewrite);
}

TEST(LinkOptions, RoundsTheTimeoutOfRequestsUp) {
  EXPECT_EQ(input("timeout=1.5").timeoutField(), 2);
  EXPECT_EQ(input("timeout=0").timeoutField(), 0);
  EXPECT_EQ(input("").timeoutField(), 0);
}

struct Invalid {
  const char* text;
  const char* message;
};

TEST(LinkOptions, ErrorsNameTheKeyAndWhatIsValid) {
  for (const auto& [text, message] : {
           Invalid{"type=string", "type=string: use int32, float64, int32Array, float64Array"},
           Invalid{"cmd=x", "cmd=x: use an integer from -2147483648 to 2147483647"},
           Invalid{"cmd=2147483648", "cmd=2147483648: use an integer"},
           Invalid{"cmd=0x", "cmd=0x: use an integer"},
           Invalid{"address=1.5", "address=1.5: use an integer"},
           Invalid{"extra=", "extra=: use an integer"},
           Invalid{"value=nan", "value=nan: use a number"},
           Invalid{"timeout=-1", "timeout=-1: use seconds from 0 (no limit)"},
           Invalid{"timeout=nan", "timeout=nan: use seconds"},
           Invalid{"mode=write", "mode=write: use read, subscribe"},
           Invalid{"mask=0", "mask=0: use an integer from 1 to 4294967295"},
           Invalid{"shift=32", "shift=32: use an integer from 0 to 31"},
           Invalid{"range=1:1", "range=1:1: use <low>:<high>, two different numbers"},
           Invalid{"type=float64 mask=3", "mask=, shift=: use them with type=int32"},
           Invalid{"range=5", "range=5: use <low>:<high>"},
           Invalid{"cmd", "\"cmd\": use <key>=<value>"},
           Invalid{"cmd=1 cmd=2", "cmd appears twice; write it once"},
           Invalid{"adress=1",
                   "invalid key \"adress\": the keys of an input record are type, cmd, address"},
           Invalid{"rewrite=yes", "invalid key \"rewrite\": the keys of an input record are"},
       })
    EXPECT_THAT([&] { input(text); }, ThrowsMessage<std::invalid_argument>(HasSubstr(message)));
  EXPECT_THAT([] { output("mode=read"); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("mode=read: use write")));
  EXPECT_THAT([] { output("value=1"); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("the keys of an output record are")));
}

}  // namespace
}  // namespace mpf::test
