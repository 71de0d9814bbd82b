// SPDX-License-Identifier: MIT
// Retry::neverTaken: requests that no server has received go to the next server.
#include <sys/resource.h>
#include <unistd.h>

#include <fstream>

#include "tests/client/client_fixture.h"
#include "tests/support/sanitized.h"

namespace mpf::test {
namespace {

// Limits the memory that this process may still map.
class LittleMemory {
 public:
  explicit LittleMemory(std::size_t bytes) {
    ::getrlimit(RLIMIT_AS, &before_);
    std::size_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    const rlimit limit{pages * static_cast<std::size_t>(::getpagesize()) + bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_AS, &limit);
  }
  ~LittleMemory() { ::setrlimit(RLIMIT_AS, &before_); }
  LittleMemory(const LittleMemory&) = delete;
  LittleMemory& operator=(const LittleMemory&) = delete;

 private:
  rlimit before_{};
};

class RetryTest : public ClientTest {
 protected:
  // A server that writes down the values that it receives, and replies with them.
  void startWriter(ServerOptions options = {}) {
    startServer(options).on<Int32>([this](Int32& request) { handled_.push_back(request.value); });
  }
  void send(std::int32_t value, Retry retry = Retry::neverTaken,
            Deadline deadline = Deadline::never()) {
    Int32Message request({.value = value});
    request.setClientExtra(value);
    ASSERT_EQ(client_.send(std::move(request), deadline, &id_, retry), SendResult::sent);
  }
  // The server ends before it receives what was sent.
  void stopServer() {
    server_.reset();
    runUntil([this] { return !client_.isConnected(); });
  }
  void connectAgain(ServerOptions options = {}) {
    startWriter(options);
    serverRuns_ = true;  // accepts the client
    runUntil([this] { return client_.isConnected(); });
    serverRuns_ = false;
  }
  void bindToWriter() {
    startWriter();
    bind();
    serverRuns_ = false;
  }

  std::vector<std::int32_t> handled_;
  std::uint32_t id_ = 0;
};

TEST_F(RetryTest, TheNextServerReceivesWhatTheLastOneDidNotReceiveInItsOrder) {
  bindToWriter();
  for (int value = 1; value <= 5; ++value) send(value);
  stopServer();
  EXPECT_THAT(messages_, testing::IsEmpty());

  connectAgain();
  serverRuns_ = true;

  for (int value = 1; value <= 5; ++value) {
    const auto reply = next();
    ASSERT_NE(reply.tryAs<Int32>(), nullptr);
    EXPECT_EQ(reply.tryAs<Int32>()->value, value);
    EXPECT_EQ(reply.getClientExtra(), value);
  }
  EXPECT_THAT(handled_, testing::ElementsAre(1, 2, 3, 4, 5));
}

TEST_F(RetryTest, OnlyRequestsWithRetryAreRepeated) {
  bindToWriter();
  send(1, Retry::never);
  send(2);

  stopServer();
  EXPECT_EQ(fateOf(next()), Fate::neverTaken);
  connectAgain();
  serverRuns_ = true;

  EXPECT_EQ(next().tryAs<Int32>()->value, 2);
}

TEST_F(RetryTest, ARequestThatWasTakenIsNotRepeated) {
  startServer();
  const auto held = [this] {
    const auto request = std::make_shared<Message>();
    server_->on<Int32>([request](Int32Message&& taken) { *request = std::move(taken); });
    return request;
  }();
  bind();
  send(1);
  runUntil([&] { return static_cast<bool>(*held); });

  server_.reset();

  EXPECT_EQ(fateOf(next()), Fate::outcomeUnknown);
}

TEST_F(RetryTest, ARepeatedRequestKeepsItsNumber) {
  bindToWriter();
  send(1);
  stopServer();
  connectAgain();
  serverRuns_ = true;

  EXPECT_EQ(next().route().requestId, id_);
}

TEST_F(RetryTest, RequestsExpireWhileNoServerIsThere) {
  bindToWriter();
  send(7, Retry::neverTaken, Deadline::after(20ms));
  stopServer();

  const auto end = next();

  EXPECT_EQ(fateOf(end), Fate::expired);
  EXPECT_EQ(end.tryAs<RequestFate>()->requestId, id_);
  EXPECT_EQ(end.getClientExtra(), 7);
}

TEST_F(RetryTest, RequestsCanBeCancelledWhileNoServerIsThere) {
  bindToWriter();
  send(1);
  send(2);
  stopServer();

  client_.cancel(id_);

  EXPECT_EQ(fateOf(next()), Fate::cancelled);
  connectAgain();
  serverRuns_ = true;
  EXPECT_EQ(next().tryAs<Int32>()->value, 1);
}

// New requests must not overtake those that wait.
TEST_F(RetryTest, NewRequestsAreRefusedUntilAllHaveBeenRepeated) {
  bindToWriter();
  for (int value = 1; value <= 5; ++value) send(value);
  stopServer();
  connectAgain({.queueSize = 2});

  EXPECT_EQ(client_.send(Int32Message({.value = 6})), SendResult::queueFull);
  serverRuns_ = true;
  for (int value = 1; value <= 5; ++value) EXPECT_EQ(next().tryAs<Int32>()->value, value);

  send(6);
  EXPECT_EQ(next().tryAs<Int32>()->value, 6);
  EXPECT_THAT(handled_, testing::ElementsAre(1, 2, 3, 4, 5, 6));
}

TEST_F(RetryTest, ARequestThatIsTooLargeForTheNextServerEnds) {
  for (const ServerOptions& smaller :
       {ServerOptions{.maxMessageBytes = 1000}, ServerOptions{.maxPoolBytes = 5000}}) {
    startServer().on<Char8Array>([](Char8ArrayMessage&&) {});
    if (id_ == 0) bind();
    runUntil([this] { return client_.isConnected(); });
    serverRuns_ = false;
    ASSERT_EQ(client_.send(client_.alloc<Char8Array>(5000), Deadline::never(), nullptr,
                           Retry::neverTaken),
              SendResult::sent);
    send(1);
    stopServer();
    connectAgain(smaller);
    serverRuns_ = true;

    EXPECT_EQ(fateOf(next()), Fate::neverTaken);
    EXPECT_EQ(next().tryAs<Int32>()->value, 1);
    stopServer();
  }
}

TEST_F(RetryTest, RequestsSurviveSeveralServersThatTakeNothing) {
  bindToWriter();
  for (int value = 1; value <= 3; ++value) send(value);
  for (int server = 0; server < 10; ++server) {
    stopServer();
    connectAgain();
  }
  serverRuns_ = true;

  for (int value = 1; value <= 3; ++value) EXPECT_EQ(next().tryAs<Int32>()->value, value);
  EXPECT_THAT(handled_, testing::ElementsAre(1, 2, 3));
}

// Sending a request again needs memory for a copy.
TEST_F(RetryTest, ARequestIsRepeatedWhenThereIsMemoryForIt) {
  if (kIsSanitized) GTEST_SKIP() << "the sanitizer reserves the address space";
  constexpr std::size_t kBytes = 48 << 20;
  startServer().on<Char8Array>([](Char8ArrayMessage&) {});
  bind();
  serverRuns_ = false;
  ASSERT_EQ(client_.send(client_.alloc<Char8Array>(kBytes), Deadline::never(), nullptr,
                         Retry::neverTaken),
            SendResult::sent);
  stopServer();
  startServer().on<Char8Array>([](Char8ArrayMessage&) {});
  {
    const LittleMemory little(kBytes / 2);
    serverRuns_ = true;
    runUntil([this] { return client_.isConnected(); });
    for (int i = 0; i < 3; ++i) dispatcher_.runOnce(Deadline::after(5ms));
  }

  EXPECT_EQ(next().arrayLength(), kBytes);
}

// What the relay of a router reports about the server behind it.
TEST_F(RetryTest, ARequestThatAServerReportsAsNeverTakenIsRepeated) {
  int handled = 0;
  startServer().on<Int32>([&](Int32Message&& request) {
    if (++handled > 3) return static_cast<void>(server_->reply(std::move(request)));
    RequestFateMessage fate({.fate = Fate::neverTaken, .requestId = request.route().requestId});
    fate.setRoute(request.route());
    EXPECT_EQ(server_->reply(std::move(fate)), ReplyResult::sent);
  });
  bind();
  send(5);

  EXPECT_EQ(next().tryAs<Int32>()->value, 5);
  EXPECT_EQ(handled, 4);
}

}  // namespace
}  // namespace mpf::test
