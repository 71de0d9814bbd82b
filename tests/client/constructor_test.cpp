// SPDX-License-Identifier: MIT
// What happens when memory or threads are exhausted. This file replaces system calls with functions
// that fail or wait.
#include <fcntl.h>
#include <pthread.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <dlfcn.h>
#include <functional>
#include <system_error>
#include <thread>

#include "server/connection.h"
#include "tests/client/client_fixture.h"
#include "tests/support/replaced_yield.h"
#include "tests/support/sanitized.h"

namespace {

std::atomic<int> reserving = 0;  // what the kernel answers; 0: it reserves memory
int startingThread = 0;  // likewise
std::atomic<bool> blocks{false};  // the next reservation waits until this is false again
std::atomic<bool> isBlocked{false};

void block() {
  isBlocked = false;
  blocks = true;
}
void unblock() {
  blocks = false;
  blocks.notify_one();
}

}  // namespace

extern "C" int posix_fallocate(int fd, off_t offset, off_t bytes) noexcept(false) {
  if (blocks && !isBlocked.exchange(true)) {
    isBlocked.notify_one();
    blocks.wait(true);
  }
  if (reserving != 0) return reserving;
  return ::fallocate(fd, 0, offset, bytes) == 0 ? 0 : errno;
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
extern "C" int pthread_create(pthread_t* thread, const pthread_attr_t* attributes,
                              void* (*start)(void*), void* argument) noexcept {
  if (startingThread != 0) return startingThread;
  static const auto real =
      reinterpret_cast<decltype(&pthread_create)>(::dlsym(RTLD_NEXT, "pthread_create"));
  return real(thread, attributes, start, argument);
}
#endif

namespace mpf::test {
namespace {

// Returns the code of the std::system_error that `construct` throws; 0 when it throws nothing.
int codeOf(const std::function<void()>& construct) {
  try {
    construct();
  } catch (const std::system_error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("reserve"));
    return error.code().value();
  }
  return 0;
}

TEST(Constructors, ReportThatSharedMemoryIsFull) {
  const TestBackplane backplane;
  reserving = ENOSPC;

  EXPECT_EQ(codeOf([&] { const SyncClient client(backplane, "device"); }), ENOSPC);
  EXPECT_EQ(codeOf([&] { const Dispatcher dispatcher(backplane); }), ENOSPC);
  EXPECT_EQ(codeOf([&] { const MessageClient client(backplane, [](const Message&) {}); }), ENOSPC);
  EXPECT_EQ(codeOf([&] { const MessageServer server(backplane, "device"); }), ENOSPC);

  EXPECT_THAT(backplane.segmentNames(), testing::IsEmpty());
  reserving = 0;
  SyncClient client(backplane, "device");
  EXPECT_FALSE(client.connectWait(1ms));
}

// The constructor does not allocate the memory of a connection: bind() returns and reports the
// reason.
TEST(Constructors, DoNotThrowForMemoryOfAConnection) {
  const TestBackplane backplane;
  MessageServer server(backplane, "device");
  Dispatcher dispatcher(backplane);
  reserving = ENOSPC;

  MessageClient client(dispatcher, [](const Message&) {});
  client.bind("device");

  reserving = 0;
  EXPECT_THAT(client.notConnectedBecause(), testing::HasSubstr("No space left"));
}

TEST(Constructors, ReportThatNoThreadCanBeStarted) {
  if (kIsSanitized) GTEST_SKIP() << "the sanitizer starts threads itself";
  const TestBackplane backplane;
  startingThread = EAGAIN;

  EXPECT_THROW(MessageClient(backplane, [](const Message&) {}), std::system_error);

  startingThread = 0;
  MessageServer server(backplane, "device");
  MessageClient client(backplane, [](const Message&) {});
  client.bind("device");
  while (!client.isConnected()) server.handleOne();
}

// No other thread of the parent exists in the child.
TEST(Constructors, MakeASharedDispatcherInTheChildOfAProcessThatMakesOne) {
  MPF_NEEDS_A_CHILD;
  const Watchdog watchdog("shared dispatcher of a child");
  const TestBackplane backplane;
  block();
  std::thread parents([&] { const MessageClient client(backplane, [](const Message&) {}); });
  isBlocked.wait(false);

  const auto child = inAChild([&] {
    ::alarm(60);
    const MessageClient client(backplane, [](const Message&) {});
  });
  int status = 0;
  ::waitpid(child, &status, 0);
  unblock();
  parents.join();

  EXPECT_EQ(status, 0);
}

// A server forges the reply to a request that its client is about to send, and takes back then,
// because there is no memory for it.
TEST_F(ClientTest, AReplyToARequestThatWasNotSentIsAProtocolError) {
  auto& server = startServer();
  auto held = heldRequest();
  const auto& connection = Connection::of(held.route());
  const auto next = held.route().requestId + 1;
  ASSERT_EQ(server.reply(std::move(held)), ReplyResult::sent);
  EXPECT_NE(this->next().tryAs<Int32>(), nullptr);
  block();
  std::thread sending([&] {
    EXPECT_EQ(client_.send(Float64ArrayMessage::allocValue(kBeyondRings), Deadline::never(),
                           nullptr, Retry::neverTaken),
              SendResult::noMemory);
  });
  isBlocked.wait(false);
  const Envelope forged{.type = static_cast<std::uint16_t>(MessageType::int32),
                        .flags = layout::kSlotFirstReply,
                        .requestId = next};
  const std::array<std::byte, layout::kFirstSlotBodyBytes> body{};
  {
    const BiasedLock::Guard lock(*connection.lock);
    ASSERT_EQ(connection.channel->link().trySend(forged, body, {0, 0}), LinkSend::sent);
  }
  {
    const ReplacedYield whileItWaits([] {
      reserving = ENOSPC;
      unblock();
    });
    while (news_.size() == 1 && messages_.empty()) dispatcher_.runOnce();
  }
  unblock();
  sending.join();
  reserving = 0;

  EXPECT_THAT(messages_, testing::IsEmpty());
  EXPECT_EQ(sumOf(&layout::WindowControl::protocolErrors), 1u);
  messages_.clear();
}

TEST(Constructors, RefuseAnEmptyCallback) {
  const TestBackplane backplane;
  Dispatcher dispatcher(backplane);

  EXPECT_THROW(MessageClient(dispatcher, {}), std::invalid_argument);
  EXPECT_THROW(MessageClient(backplane, {}), std::invalid_argument);
}

}  // namespace
}  // namespace mpf::test
