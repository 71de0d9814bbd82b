// SPDX-License-Identifier: MIT
// NotifySocket: reports of this process and of others.
#include "crate/supervisor/notify_socket.h"

#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <gtest/gtest.h>

#include "base/service_manager.h"

namespace mpf::crate::test {
namespace {

TEST(NotifySocket, ReturnsThePidOfAProcessThatIsReady) {
  const NotifySocket socket;
  ::setenv("NOTIFY_SOCKET", socket.name().c_str(), 1);
  EXPECT_EQ(socket.takeReady(), std::nullopt);

  ServiceManager::notifyStatus("starting");
  ServiceManager::notifyReady();

  EXPECT_EQ(socket.takeReady(), ::getpid());
  EXPECT_EQ(socket.takeReady(), std::nullopt);
  const auto child = ::fork();
  if (child == 0) {
    ServiceManager::notifyReady();
    ::_exit(0);
  }
  ::waitpid(child, nullptr, 0);
  EXPECT_EQ(socket.takeReady(), child);
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
