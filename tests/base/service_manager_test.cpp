// SPDX-License-Identifier: MIT
// ServiceManager: the datagrams that systemd receives.
#include "base/service_manager.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>

#include <mpf/file_descriptor.h>

#include "tests/support/temporary_folder.h"

namespace mpf::test {
namespace {

// A socket to which $NOTIFY_SOCKET points during a test. `name` may begin with '@', the written
// form of an abstract socket.
class NotifySocket {
 public:
  explicit NotifySocket(const std::string& name)
      : socket_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path, name.data(), name.size());
    if (name.front() == '@') address.sun_path[0] = '\0';
    const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size());
    EXPECT_EQ(::bind(socket_.get(), reinterpret_cast<const sockaddr*>(&address), length), 0);
    ::setenv("NOTIFY_SOCKET", name.c_str(), 1);
  }
  ~NotifySocket() { ::unsetenv("NOTIFY_SOCKET"); }
  NotifySocket(const NotifySocket&) = delete;
  NotifySocket& operator=(const NotifySocket&) = delete;

  // Sends datagrams to the socket until none fits.
  void fill() const {
    sockaddr_un address{};
    socklen_t length = sizeof address;
    auto* const generic = reinterpret_cast<sockaddr*>(&address);
    ASSERT_EQ(::getsockname(socket_.get(), generic, &length), 0);
    const FileDescriptor sender(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    while (::sendto(sender.get(), "other", 5, MSG_DONTWAIT, generic, length) > 0) continue;
  }
  std::string receive() {
    std::string text(256, '\0');
    const auto bytes = ::recv(socket_.get(), text.data(), text.size(), MSG_DONTWAIT);
    text.resize(bytes < 0 ? 0 : static_cast<std::size_t>(bytes));
    return text;
  }

 private:
  FileDescriptor socket_;
};

TEST(ServiceManager, ReportsEachState) {
  const TemporaryFolder folder;
  NotifySocket systemd((folder.path() / "notify").string());

  ServiceManager::notifyReady();
  EXPECT_EQ(systemd.receive(), "READY=1");
  ServiceManager::notifyReloading();
  EXPECT_THAT(systemd.receive(), testing::MatchesRegex("RELOADING=1\nMONOTONIC_USEC=[0-9]+"));
  ServiceManager::notifyStopping();
  EXPECT_EQ(systemd.receive(), "STOPPING=1");
  ServiceManager::notifyStatus("2 of 3");
  EXPECT_EQ(systemd.receive(), "STATUS=2 of 3");
  ServiceManager::notifyAlive();
  EXPECT_EQ(systemd.receive(), "WATCHDOG=1");
  ServiceManager::notifyStillStopping();
  EXPECT_EQ(systemd.receive(), "EXTEND_TIMEOUT_USEC=30000000");
}

TEST(ServiceManager, DoesNotWaitForAServiceManagerThatDoesNotRead) {
  const TemporaryFolder folder;
  NotifySocket systemd((folder.path() / "notify").string());
  systemd.fill();

  ServiceManager::notifyReady();  // returns, and is lost

  std::string report;
  while (!(report = systemd.receive()).empty()) EXPECT_EQ(report, "other");
  ServiceManager::notifyAlive();
  EXPECT_EQ(systemd.receive(), "WATCHDOG=1");
}

TEST(ServiceManager, KnowsTheWatchdogOfItsProcess) {
  EXPECT_EQ(ServiceManager::watchdogTime(), std::nullopt);
  ::setenv("WATCHDOG_USEC", "5000000", 1);
  EXPECT_EQ(ServiceManager::watchdogTime(), std::chrono::seconds(5));
  ::setenv("WATCHDOG_PID", std::to_string(::getpid()).c_str(), 1);
  EXPECT_EQ(ServiceManager::watchdogTime(), std::chrono::seconds(5));

  ::setenv("WATCHDOG_PID", "1", 1);  // inherited from another process

  EXPECT_EQ(ServiceManager::watchdogTime(), std::nullopt);
  ::unsetenv("WATCHDOG_PID");
  ::setenv("WATCHDOG_USEC", "99999999999999999999", 1);
  EXPECT_EQ(ServiceManager::watchdogTime(), std::chrono::hours(24));
  ::setenv("WATCHDOG_USEC", "x", 1);
  EXPECT_EQ(ServiceManager::watchdogTime(), std::nullopt);
  ::unsetenv("WATCHDOG_USEC");
}

TEST(ServiceManager, UsesAnAbstractSocket) {
  NotifySocket systemd("@mpf-service-manager-test-" + std::to_string(::getpid()));

  ServiceManager::notifyReady();

  EXPECT_EQ(systemd.receive(), "READY=1");
}

TEST(ServiceManager, DoesNothingWithoutASocket) {
  ServiceManager::notifyReady();

  ::setenv("NOTIFY_SOCKET", std::string(200, 'x').c_str(), 1);  // too long for an address
  ServiceManager::notifyReady();
  ::setenv("NOTIFY_SOCKET", "/absent/socket", 1);
  ServiceManager::notifyReady();
  ::unsetenv("NOTIFY_SOCKET");
}

}  // namespace
}  // namespace mpf::test
