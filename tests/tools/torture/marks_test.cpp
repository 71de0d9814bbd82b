// SPDX-License-Identifier: MIT
// The steps of this test program.
#include "tools/torture/marks.h"

#include <algorithm>
#include <gtest/gtest.h>

#include "base/step.h"

namespace mpf::torture {
namespace {

[[gnu::noinline]] void passOnce() { MPF_STEP(marks_test_once); }

// Two functions, and so two places with the same step.
template <int number>
[[gnu::noinline]] int passInstance() {
  MPF_STEP(marks_test_instance);
  return number;
}

// A probe of another provider.
[[gnu::noinline]] void passForeign() {
  __asm__ __volatile__(
      "990: nop\n"
      ".pushsection .note.stapsdt,\"?\",\"note\"\n"
      ".balign 4\n"
      ".4byte 992f-991f, 994f-993f, 3\n"
      "991: .asciz \"stapsdt\"\n"
      "992: .balign 4\n"
      "993: .8byte 990b, 0, 0\n"
      ".asciz \"foreign\"\n"
      ".asciz \"marks_test_foreign\"\n"
      ".asciz \"\"\n"
      "994: .balign 4\n"
      ".popsection\n");
}

TEST(Marks, ContainTheStepsOfThisProgramAndOfItsLibraries) {
  passOnce();
  const auto marks = Marks::ofThisProgram();

  EXPECT_TRUE(marks.contains("marks_test_once"));
  EXPECT_TRUE(marks.contains("slot_published")) << "a step of shm/";
  EXPECT_FALSE(marks.contains("marks_test_none"));
}

TEST(Marks, AnAddressIsWhereTheProgramExecutesTheStep) {
  const auto marks = Marks::ofThisProgram();

  const auto& addresses = marks.byName().at("marks_test_once");

  ASSERT_EQ(addresses.size(), 1U);
  const auto function = reinterpret_cast<Marks::Address>(&passOnce);
  EXPECT_GE(addresses.front(), function);
  EXPECT_LT(addresses.front(), function + 64);
#ifdef __x86_64__
  EXPECT_EQ(*reinterpret_cast<const unsigned char*>(addresses.front()), 0x90) << "a nop";
#endif
}

TEST(Marks, AStepInSeveralFunctionsHasSeveralAddresses) {
  EXPECT_NE(passInstance<1>(), passInstance<2>());

  auto addresses = Marks::ofThisProgram().byName().at("marks_test_instance");

  ASSERT_EQ(addresses.size(), 2U);
  EXPECT_NE(addresses[0], addresses[1]);
}

TEST(Marks, FindsTheStepAtAnAddress) {
  const auto marks = Marks::ofThisProgram();

  for (const auto& [name, addresses] : marks.byName()) {
    for (const auto address : addresses) {
      ASSERT_NE(marks.find(address), nullptr) << name;
      EXPECT_EQ(*marks.find(address), name);
    }
  }
  const auto once = marks.byName().at("marks_test_once").front();
  EXPECT_EQ(marks.find(once + 1), nullptr);
  EXPECT_EQ(marks.find(0), nullptr);
}

TEST(Marks, LeaveOutProbesOfOtherProviders) {
  passForeign();

  EXPECT_FALSE(Marks::ofThisProgram().contains("marks_test_foreign"));
}

}  // namespace
}  // namespace mpf::torture
