// SPDX-License-Identifier: MIT
// Tables of parameter strings of VME and ISA carriers: what each gives, or how it is refused.
#pragma once

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <string>

#include <mpf/drivers/industry_pack/industry_pack_error.h>

#include "drivers/industry_pack/carrier_parameters.h"

namespace mpf::test {

struct GoodParameters {
  const char* kind;
  const char* text;
  const char* sites;  // as textOf() writes them
};

struct BadParameters {
  const char* kind;
  const char* text;
  IndustryPackStatus status;
  const char* words;  // in the message
};

// "6000 6080 d0000000+8192K 1,2" for each site: I/O address, ID address, memory, interrupt levels.
inline std::string textOf(const CarrierParameters& carrier) {
  std::string text;
  for (const auto& site : carrier.sites) {
    text += fmt::format("{}{:x} {:x}", text.empty() ? "" : "; ", site.io, site.id);
    if (site.memoryBytes != 0)
      text += fmt::format(" {:x}+{}K", site.memory, site.memoryBytes >> 10);
    text += fmt::format(" {},{}", site.interruptLevels[0], site.interruptLevels[1]);
  }
  return text;
}

inline void expectSites(const GoodParameters& good) {
  EXPECT_EQ(textOf(parseCarrierParameters(good.kind, good.text)), good.sites)
      << good.kind << " \"" << good.text << '"';
}

inline void expectRefused(const BadParameters& bad) {
  try {
    static_cast<void>(parseCarrierParameters(bad.kind, bad.text));
    ADD_FAILURE() << bad.kind << " \"" << bad.text << "\": no error";
  } catch (const IndustryPackError& error) {
    EXPECT_EQ(error.status(), bad.status) << toString(error.status()) << ": " << error.what();
    EXPECT_THAT(error.what(), testing::HasSubstr(bad.words));
    EXPECT_THAT(error.what(), testing::HasSubstr(fmt::format("\"{}\"", bad.text)));
  }
}

}  // namespace mpf::test
