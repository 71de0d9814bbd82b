// SPDX-License-Identifier: MIT
// A server publishes images to readers in other processes, which are stopped and killed.
// MPF_TEST_KILLS sets the number of kills.
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <deque>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>
#include <string>
#include <vector>

#include "base/system_call.h"
#include "shm/segment.h"
#include "shm/segment_name.h"
#include "tests/support/test_backplane.h"
#include "tests/support/victim.h"
#include "tests/support/watchdog.h"
#include "tests/system/fan_out_camera.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

class FanOutTest : public testing::Test {
 protected:
  Victim startActor(const std::string& role, int number) const {
    return {MPF_TEST_FAN_OUT_ACTOR, {role, backplane_.name(), std::to_string(number)}};
  }
  [[nodiscard]] std::vector<std::string> fanOutFiles() const {
    std::vector<std::string> files;
    for (const auto& name : backplane_.segmentNames()) {
      if (SegmentName::tryParse(name)->kind == NameKind::fanOut) files.push_back(name);
    }
    return files;
  }

  Watchdog watchdog_{"fan-out test"};
  TestBackplane backplane_;
};

TEST_F(FanOutTest, AStoppedReaderDelaysNobodyAndIsToldWhatItMissed) {
  Camera camera(backplane_);
  const auto slow = startActor("reader", 1);
  const auto quick = startActor("reader", 2);
  ASSERT_TRUE(camera.tryShow(1, 5));
  ASSERT_TRUE(camera.tryShow(2, 5));
  const auto before = camera.reader(1).dropped;

  slow.stop();
  ASSERT_TRUE(camera.tryShow(2, 200));
  slow.signal(SIGCONT);

  const auto& stopped = camera.reader(1);
  EXPECT_GE(stopped.dropped - before, 200 - kMaxBorrowed);
  EXPECT_EQ(camera.reader(2).missed, camera.reader(2).dropped);
  ASSERT_TRUE(camera.tryShow(1, 1));
  EXPECT_EQ(stopped.missed, stopped.dropped);
  EXPECT_FALSE(camera.wasCopied());
  EXPECT_LE(fanOutFiles().size(), 2u * kMaxBorrowed + 2);
}

TEST_F(FanOutTest, AKilledReaderFreesWhatItHeld) {
  std::mt19937 random(std::random_device{}());
  Camera camera(backplane_);
  const auto steady = startActor("reader", 1);
  ASSERT_TRUE(camera.tryShow(1, 3));
  for (int kill = 0; kill < killsOr(100); ++kill) {
    const int number = 2 + kill;
    auto victim = startActor("reader", number);
    camera.runUntil([&] { return camera.hasReader(number); });
    const auto until = random() % 4;
    for (unsigned shown = 0; shown < until; ++shown) camera.publish();
    ASSERT_TRUE(camera.tryShow(1, 1));
    victim.end(SIGKILL);
    camera.runUntil(
        [&] { return !camera.server().isClientConnected(camera.reader(number).request); });
    camera.forget(number);
  }
  EXPECT_FALSE(camera.wasCopied());
  EXPECT_LE(fanOutFiles().size(), 3u * kMaxBorrowed + 2);
}

// A client of this process. It keeps the last messages that it received.
class Watcher {
 public:
  static constexpr std::size_t kKept = 3;

  explicit Watcher(const Backplane& backplane) : dispatcher_(backplane) { client_.bind("camera"); }

  template <class Condition>
  void runUntil(Condition condition) {
    while (!condition()) dispatcher_.runOnce(Deadline::after(1ms));
  }
  [[nodiscard]] int received() const noexcept { return received_; }
  [[nodiscard]] int disconnects() const noexcept { return disconnects_; }
  [[nodiscard]] const std::deque<Message>& kept() const noexcept { return kept_; }

 private:
  void take(Message&& message) {
    if (const auto* connect = message.tryAs<Connect>()) {
      if (connect->status == ConnectStatus::connectNo) ++disconnects_;
      if (connect->status != ConnectStatus::connectYes) return;
      Int32Message request(
          {.cmd = static_cast<std::int32_t>(FanOutRequest::subscribe), .address = 99});
      EXPECT_EQ(client_.send(std::move(request)), SendResult::sent);
    } else if (message.getType() == MessageType::float64Array) {
      EXPECT_TRUE(isWholeImage(message));
      ++received_;
      kept_.push_back(std::move(message));
      if (kept_.size() > kKept) kept_.pop_front();
    }
  }

  int received_ = 0;
  int disconnects_ = 0;
  std::deque<Message> kept_;
  Dispatcher dispatcher_;
  MessageClient client_{dispatcher_, [this](Message&& message) { take(std::move(message)); }};
};

TEST_F(FanOutTest, AKilledServerLeavesItsReadersTheirMessagesAndNoFiles) {
  std::mt19937 random(std::random_device{}());
  auto reader = startActor("reader", 1);
  Watcher watcher(backplane_);
  for (int kill = 1; kill <= killsOr(100) / 4; ++kill) {
    auto server = startActor("server", 0);
    const auto until = watcher.received() + 1 + static_cast<int>(random() % 20);
    watcher.runUntil([&] { return watcher.received() >= until; });

    server.end(SIGKILL);
    watcher.runUntil([&] { return watcher.disconnects() == kill; });

    EXPECT_THAT(watcher.kept(), testing::Each(testing::Truly(isWholeImage)));
    static_cast<void>(backplane_.removeDead());
    EXPECT_THAT(fanOutFiles(), testing::IsEmpty());
    EXPECT_THAT(watcher.kept(), testing::Each(testing::Truly(isWholeImage)));
  }
  EXPECT_TRUE(WIFSIGNALED(reader.end(SIGKILL))) << "a reader saw an image that was not whole";
}

// What a process that was admitted only as a reader can do to a file, as the errors of the calls.
std::vector<int> attemptsToWrite(const char* path) {
  std::vector<int> errors;
  const auto note = [&](bool hasFailed) { errors.push_back(hasFailed ? errno : 0); };
  note(::open(path, O_RDWR) < 0);
  note(::open(path, O_WRONLY | O_TRUNC) < 0);
  const int file = ::open(path, O_RDONLY);
  note(::mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0) == MAP_FAILED);
  note(::ftruncate(file, 0) != 0);
  note(::truncate(path, 0) != 0);
  note(::chmod(path, 0666) != 0);
  note(::unlink(path) != 0);
  return errors;
}

TEST_F(FanOutTest, AReaderOfAnotherUserCannotWrite) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root runs processes as several users";
  Camera camera(backplane_, {.mode = 0666});
  camera.publish();
  const auto path = segments::path(fanOutFiles().at(0));

  const auto child = checkCall(::fork(), "fork");
  if (child == 0) {
    constexpr uid_t kNobody = 65534;
    const std::vector<int> expected{EACCES, EACCES, EACCES, EINVAL, EACCES, EPERM, EPERM};
    ::_exit(::setuid(kNobody) == 0 && attemptsToWrite(path.c_str()) == expected ? 0 : 1);
  }
  int status = 0;
  checkCall(::waitpid(child, &status, 0), "waitpid");

  EXPECT_EQ(status, 0);
}

}  // namespace
}  // namespace mpf::test
