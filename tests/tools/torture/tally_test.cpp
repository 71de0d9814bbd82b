// SPDX-License-Identifier: MIT
#include "tools/torture/tally.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace mpf::torture {
namespace {

using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

const Plan kStopServer{Role::server, Mode::stop, {.mark = "b_step", .hit = 3, .instructions = 17}};

// Two steps, of which "b_step" was reached.
Tally someTally() {
  Tally tally;
  tally.seed = 42;
  tally.seconds = 1.25;
  tally.rounds = 7;
  tally.marks = {{"a_step", {}}, {"b_step", {}}};
  tally.note(kStopServer);
  tally.note(kStopServer);
  tally.note({Role::client, Mode::kill, {.mark = "b_step"}});
  return tally;
}

TEST(Tally, IsIncompleteUntilEachStepWasReached) {
  auto tally = someTally();
  EXPECT_THAT(tally.neverReached(), ElementsAre("a_step"));
  EXPECT_EQ(tally.verdict(), "incomplete");

  tally.note({Role::server, Mode::kill, {.mark = "a_step"}});

  EXPECT_THAT(tally.neverReached(), IsEmpty());
  EXPECT_EQ(tally.verdict(), "held");
}

TEST(Tally, AFailureIsTheVerdictEvenIfStepsWereNotReached) {
  auto tally = someTally();
  tally.failure = Failure{"a request has no end", {}};

  EXPECT_EQ(tally.verdict(), "failed");
  EXPECT_THAT(tally.text(), Not(HasSubstr("never reached")));
}

TEST(Tally, TextHasARowForEachStep) {
  auto tally = someTally();
  tally.holdings = "5 descriptors";

  EXPECT_EQ(tally.text(),
            "STEP    CLIENT KILLED  STOPPED  SERVER KILLED  STOPPED\n"
            "a_step              -        -              -        -\n"
            "b_step              1        -              -        2\n"
            "never reached: a_step\n"
            "5 descriptors\n"
            "incomplete: 7 rounds in 1.2 s, seed 42\n");
}

TEST(Tally, TextOfAFailureEndsWithTheCommandThatRepeatsIt) {
  auto tally = someTally();
  tally.failure = Failure{"a request has no end", kStopServer};

  EXPECT_THAT(tally.text(),
              EndsWith("failed: 7 rounds in 1.2 s, seed 42\na request has no end\nagain: mpf "
                       "torture --role server --mode stop --step b_step --hit 3 --instructions "
                       "17\n"));

  tally.failure->plan.reset();
  EXPECT_THAT(tally.text(), EndsWith("\na request has no end\n"));
}

TEST(Tally, JsonHasTheSameContent) {
  auto tally = someTally();

  const auto json = tally.json();

  EXPECT_EQ(json.at("verdict"), "incomplete");
  EXPECT_EQ(json.at("seed"), 42);
  EXPECT_EQ(json.at("rounds"), 7);
  EXPECT_EQ(json.at("seconds"), 1.25);
  EXPECT_EQ(json.at("never_reached"), nlohmann::json{"a_step"});
  ASSERT_EQ(json.at("steps").size(), 2U);
  EXPECT_EQ(json.at("steps").at(1), (nlohmann::json{{"step", "b_step"},
                                                    {"client", {{"killed", 1}, {"stopped", 0}}},
                                                    {"server", {{"killed", 0}, {"stopped", 2}}}}));
  EXPECT_FALSE(json.contains("failure"));

  tally.failure = Failure{"why", kStopServer};
  EXPECT_EQ(tally.json().at("failure"), (nlohmann::json{{"what", "why"},
                                                        {"role", "server"},
                                                        {"mode", "stop"},
                                                        {"step", "b_step"},
                                                        {"hit", 3},
                                                        {"instructions", 17}}));

  tally.failure->plan.reset();
  EXPECT_EQ(tally.json().at("failure"), (nlohmann::json{{"what", "why"}}));
}

}  // namespace
}  // namespace mpf::torture
