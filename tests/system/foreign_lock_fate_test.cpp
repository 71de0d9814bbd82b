// SPDX-License-Identifier: MIT
// If another process locks the files of a killed server, clients still get the fates of their
// requests and find the next server.
#include <fcntl.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <thread>

#include <mpf/file_descriptor.h>
#include <mpf/message_client.h>

#include "base/system_call.h"
#include "shm/segment.h"
#include "shm/segment_name.h"
#include "tests/support/test_backplane.h"
#include "tests/support/victim.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

// The files to lock, and the kind of lock.
struct Stranger {
  NameKind file;
  int access;
  short type;
};

class ForeignLockFate : public testing::TestWithParam<Stranger> {
 protected:
  // Waits in a thread for a lock on the file, and keeps it. A lock of an open file belongs to no
  // process, so this one counts as that of another process.
  void waitForLock(const std::string& name) {
    file_.reset(checkCall(::open(segments::path(name).c_str(), GetParam().access | O_CLOEXEC),
                          "open", name));
    waiter_ = std::thread([this] {
      struct flock64 lock{};
      lock.l_type = GetParam().type;
      lock.l_whence = SEEK_SET;
      checkCall(::fcntl(file_.get(), F_OFD_SETLKW, &lock), "lock");
    });
  }
  void TearDown() override {
    if (waiter_.joinable()) waiter_.join();
  }
  [[nodiscard]] std::string serversFile() const {
    const auto names = backplane_.segmentNames();
    const auto window = SegmentName::serverWindow(backplane_.name(), 0, "echo");
    if (GetParam().file == NameKind::serverWindow) return window;
    const auto header = segments::tryReadHeader(window, layout::SegmentKind::serverWindow);
    return SegmentName::keyed(backplane_.name(), NameKind::hints, header->incarnation);
  }
  void run(const std::function<bool()>& until) {
    while (!until()) static_cast<void>(dispatcher_.runOnce());
  }

  Watchdog watchdog_{"foreign lock fate test"};
  TestBackplane backplane_;
  FileDescriptor file_;
  std::thread waiter_;
  Dispatcher dispatcher_{backplane_};
};

TEST_P(ForeignLockFate, ArrivesAndTheNextServerUsesTheName) {
  Victim server("serve", backplane_.name());
  ASSERT_EQ(server.line(), "open");
  int fates = 0;
  MessageClient client(dispatcher_, [&](const Message& message) {
    fates += message.getType() == MessageType::requestFate ? 1 : 0;
  });
  client.bind("echo", 0);
  run([&] { return client.isConnected(); });
  waitForLock(serversFile());
  server.stop();
  ASSERT_EQ(client.send(Int32Message({.value = 1})), SendResult::sent);

  server.end(SIGKILL);

  run([&] { return fates == 1; });
  Victim successor("serve", backplane_.name());
  EXPECT_EQ(successor.line(), "open");
  run([&] { return client.isConnected(); });
}

INSTANTIATE_TEST_SUITE_P(OfStrangers, ForeignLockFate,
                         testing::Values(Stranger{NameKind::serverWindow, O_RDONLY, F_RDLCK},
                                         Stranger{NameKind::serverWindow, O_RDWR, F_WRLCK},
                                         Stranger{NameKind::hints, O_RDONLY, F_RDLCK},
                                         Stranger{NameKind::hints, O_RDWR, F_WRLCK}));

}  // namespace
}  // namespace mpf::test
