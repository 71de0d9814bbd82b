// SPDX-License-Identifier: MIT
#include "epics/link_address.h"

#include <gtest/gtest.h>
#include <stdexcept>
#include <string>

namespace mpf::test {
namespace {

LinkAddress vme(short location, short signal, std::string text) {
  DBLINK link{};
  link.type = VME_IO;
  link.value.vmeio.card = location;
  link.value.vmeio.signal = signal;
  link.value.vmeio.parm = text.data();
  return LinkAddress::of(link);
}

LinkAddress instrument(std::string text) {
  DBLINK link{};
  link.type = INST_IO;
  link.value.instio.string = text.data();
  return LinkAddress::of(link);
}

TEST(LinkAddress, HasTheLocationTheSignalAndTheServerOfAVmeLink) {
  const auto address = vme(3, 7, "a-DAC");

  EXPECT_EQ(address.location, 3);
  EXPECT_EQ(address.signal, 7);
  EXPECT_EQ(address.server, "a-DAC");
  EXPECT_EQ(address.parameters, "");
}

TEST(LinkAddress, SeparatesTheParametersByACommaOrABlank) {
  EXPECT_EQ(vme(0, 0, "a-Serial[0],TERM=0d,FMT=%f V").parameters, "TERM=0d,FMT=%f V");
  EXPECT_EQ(vme(0, 0, "a-Serial[0] TO=10000").parameters, "TO=10000");
  EXPECT_EQ(vme(0, 0, "AIM1/1 2").server, "AIM1/1");
}

TEST(LinkAddress, HasTheLocationOfAnInstrumentLink) {
  EXPECT_EQ(instrument("dac:-2 cmd=1").location, -2);
  EXPECT_EQ(instrument("dac:-2 cmd=1").server, "dac");
  EXPECT_EQ(instrument("dac:-2 cmd=1").parameters, "cmd=1");
  EXPECT_EQ(instrument("dac").location, 0);
}

// Base makes an empty link of a text without @.
TEST(LinkAddress, ALinkWithoutAServerMustBeginWithAnAt) {
  try {
    instrument("");
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "no server: the link must begin with @<server>");
  }
}

TEST(LinkAddress, RefusesInvalidLinks) {
  EXPECT_THROW(vme(0, 0, ""), std::invalid_argument);
  EXPECT_THROW(vme(0, 0, std::string(100, 'x')), std::invalid_argument);
  EXPECT_THROW(instrument("dac:three"), std::invalid_argument);
  EXPECT_THROW(instrument("dac:99999999999"), std::invalid_argument);
  EXPECT_THROW(LinkAddress::of(DBLINK{}), std::invalid_argument);
}

}  // namespace
}  // namespace mpf::test
