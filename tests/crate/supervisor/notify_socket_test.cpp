// SPDX-License-Identifier: MIT
// NotifySocket: reports of this process and of others.
#include "crate/supervisor/notify_socket.h"

#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/service_manager.h"

namespace mpf::crate::test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

TEST(NotifySocket, ReturnsThePidOfAProcessThatIsReady) {
  const NotifySocket socket;
  ::setenv("NOTIFY_SOCKET", socket.name().c_str(), 1);
  EXPECT_THAT(socket.takeReady(), IsEmpty());

  ServiceManager::notifyStatus("starting");
  ServiceManager::notifyReady();

  EXPECT_THAT(socket.takeReady(), ElementsAre(::getpid()));
  EXPECT_THAT(socket.takeReady(), IsEmpty());
  const auto child = ::fork();
  if (child == 0) {
    ServiceManager::notifyReady();
    ::_exit(0);
  }
  ::waitpid(child, nullptr, 0);
  EXPECT_THAT(socket.takeReady(), ElementsAre(child));
  ::unsetenv("NOTIFY_SOCKET");
}

// The supervisor does its other work in between, however many reports wait.
TEST(NotifySocket, TakesALimitedNumberOfReports) {
  const NotifySocket socket;
  ::setenv("NOTIFY_SOCKET", socket.name().c_str(), 1);
  for (std::size_t i = 0; i <= NotifySocket::kMaxReports; ++i) ServiceManager::notifyReady();

  EXPECT_THAT(socket.takeReady(), SizeIs(NotifySocket::kMaxReports));
  EXPECT_THAT(socket.takeReady(), SizeIs(1));
  ::unsetenv("NOTIFY_SOCKET");
}

TEST(NotifySocket, EachHasANameOfItsOwn) {
  const NotifySocket one;
  const NotifySocket two;

  EXPECT_NE(one.name(), two.name());
  EXPECT_EQ(one.name().front(), '@');
}

}  // namespace
}  // namespace mpf::crate::test
