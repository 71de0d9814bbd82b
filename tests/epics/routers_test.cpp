// SPDX-License-Identifier: MIT
// Records whose server is on another host: the connection between the routers is cut.
#include "tests/epics/epics_fixture.h"
#include "tests/support/router_pair.h"

namespace mpf::test {
namespace {

class RecordsOverRouters : public EpicsTest {
 protected:
  RecordsOverRouters() {
    ::setenv("MPF_BACKPLANE", routers_.near().name().c_str(), 1);
    routers_.start();
  }
  RouterPair routers_;
};

TEST_F(RecordsOverRouters, ARouterThatIsKilledIsACommAlarmUntilTheNextOneIsThere) {
  std::atomic<bool> isSilent = false;
  std::vector<Message> kept;  // requests without a reply
  const ThreadServer server(routers_.far(), "adc",
                            [&](MessageServer& self, Message&& request) {
                              if (isSilent) kept.push_back(std::move(request));
                              else static_cast<void>(self.reply(std::move(request)));
                            },
                            {.location = RouterPair::kLocation});
  const Ioc ioc(
      "record(longin, \"v\") { field(DTYP, \"MPF\") field(INP, \"@adc:1 value=7\")"
      " field(PINI, \"YES\") }");
  for (const bool isOfFarHost : {true, false}) {
    Ioc::waitFor("v.SEVR", "NO_ALARM");
    isSilent = true;  // the request is outstanding when the router is killed
    ASSERT_EQ(Ioc::put("v.PROC", "1"), 0);
    ASSERT_EQ(Ioc::get("v.PACT"), "1");

    (isOfFarHost ? routers_.farRouter() : routers_.nearRouter()).end(SIGKILL);

    Ioc::waitFor("v.STAT", "COMM");
    EXPECT_EQ(Ioc::get("v.SEVR"), "INVALID");
    EXPECT_EQ(Ioc::get("v.PACT"), "0");
    isSilent = false;
    isOfFarHost ? routers_.startFar() : routers_.startNear();
  }
  Ioc::waitFor("v.SEVR", "NO_ALARM");
}

}  // namespace
}  // namespace mpf::test
