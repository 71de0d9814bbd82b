// SPDX-License-Identifier: MIT
#include "drivers/ip330/ip330_faults.h"

namespace mpf {
namespace {

struct FaultText {
  const char* begins;
  const char* ends;
};

constexpr std::array<FaultText, 5> kTexts{{
    {"the board is gone: all bits read as ones, or another module is in its place",
     "the board is present again"},
    {"the board does not scan", "the board scans again"},
    {"the board's interrupts do not come: the board is polled instead",
     "the board's interrupts come again"},
    {"the board interrupts without a reason: its interrupt is masked for a while",
     "the board's interrupt is quiet again"},
    {"calibration fails: the converter gives no codes, implausible codes, or the end of its range",
     "calibration succeeds again"},
}};

}  // namespace

void Ip330Faults::set(Ip330Fault fault, bool isThere) {
  const auto at = static_cast<std::size_t>(fault);
  if (isThere_[at].exchange(isThere, std::memory_order_relaxed) == isThere || !hook_) return;
  hook_(isThere ? kTexts[at].begins : kTexts[at].ends, isThere);
}

std::string Ip330Faults::describe() const {
  for (std::size_t i = 0; i < kTexts.size(); ++i) {
    if (isThere_[i].load(std::memory_order_relaxed)) return kTexts[i].begins;
  }
  return {};
}

}  // namespace mpf
