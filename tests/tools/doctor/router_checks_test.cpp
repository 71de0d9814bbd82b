// SPDX-License-Identifier: MIT
// The check of connections to other hosts, on a host of the test.
#include <mpf/clock.h>

#include "tests/support/test_backplane.h"
#include "tests/tools/doctor/doctor_fixture.h"
#include "tests/tools/report/router_rows.h"

namespace mpf::tools {
namespace {

class RouterChecks : public test::DoctorHostTest {};

TEST_F(RouterChecks, ARemoteThatIsUnreachableForLongIsAWarning) {
  const test::TestBackplane backplane;
  router::Statistics statistics(backplane, "lab1");
  expect(checkRouters(host_), Health::ok, "none");

  const auto remote = test::connectedRemote(statistics, {1});
  const auto caller = test::connectedCaller(statistics);
  const auto lost = test::lostRemote(statistics);
  auto router = copyAlive(backplane.segmentNames().at(0));
  expect(checkRouters(host_), Health::ok, "2 remotes, 1 caller");

  constexpr std::uint64_t kFiveMinutesNs = 300'000'000'000;
  test::set((*lost)->sinceNs, static_cast<std::uint64_t>(Clock::nowNs()) - kFiveMinutesNs);
  router.reset();
  router = copyAlive(backplane.segmentNames().at(0));
  expect(
      checkRouters(host_), Health::warning,
      "1 of 2 remotes cannot be reached: 10.0.0.8:9900, for 5 min: connect(): Connection refused",
      "mpf-router runs there");

  router.reset();
  expect(checkRouters(host_), Health::ok, "none");
}

}  // namespace
}  // namespace mpf::tools
