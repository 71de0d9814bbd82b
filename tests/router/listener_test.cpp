// SPDX-License-Identifier: MIT
// Who calls a listening address, and who only holds a place there.
#include <mpf/router/listener.h>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <gtest/gtest.h>

#include <mpf/base/file_descriptor.h>
#include <mpf/base/system_call.h>
#include <mpf/tests/router/certificates.h>
#include <mpf/tests/support/temporary_folder.h>
#include <mpf/tests/support/test_backplane.h>
#include <mpf/tests/support/watchdog.h>

namespace mpf::router::test {
namespace {

FileDescriptor callAt(std::uint16_t port) {
  FileDescriptor caller(checkCall(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0), "socket"));
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(port);
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  checkCall(::connect(caller.get(), reinterpret_cast<sockaddr*>(&to), sizeof to), "connect");
  return caller;
}

TEST(Listener, WhoIdlesInItsHandshakeMakesRoomForOthers) {
  constexpr int kIdlers = 300;
  const mpf::test::Watchdog watchdog("listener test");
  const mpf::test::TemporaryFolder folder;
  const mpf::test::TestBackplane backplane;
  const Certificates ours(folder, "ours");
  auto io = kj::setupAsyncIo();
  const Log log([](Log::Level, const std::string&) {});
  Statistics statistics(backplane, "test");
  Presences presences(backplane, io.unixEventPort, [] {});
  Surroundings here{.port = io.unixEventPort,
                    .network = io.provider->getNetwork(),
                    .timer = io.provider->getTimer(),
                    .backplane = backplane,
                    .log = log,
                    .statistics = statistics,
                    .presences = presences,
                    .config = {},
                    .tls = std::make_shared<Tls>(ours.files("server"), io.provider->getTimer())};
  auto called = kj::newPromiseAndFulfiller<std::string>();
  const Listen listen{.address = parseAddress("127.0.0.1:0"), .security = Security::tls};
  Listener listener(here, listen, [&](const Listener::Caller& caller) { called.fulfiller->fulfill(std::string(caller.name)); });
  listener.start().wait(io.waitScope);
  const auto port = listener.address().port;

  std::vector<FileDescriptor> idlers;
  for (int i = 0; i < kIdlers; ++i) idlers.push_back(callAt(port));
  Tls honest(ours.files("honest"), io.provider->getTimer());
  auto stream = io.provider->getNetwork().parseAddress("127.0.0.1", port).wait(io.waitScope)->connect().wait(io.waitScope);
  const auto connected = honest.connect({kj::mv(stream), kj::UnknownPeerIdentity::newInstance()}, "server").wait(io.waitScope);

  EXPECT_EQ(called.promise.wait(io.waitScope), "honest");
  char byte = 0;
  EXPECT_EQ(::recv(idlers.front().get(), &byte, 1, 0), 0) << "the oldest one was closed";
  EXPECT_EQ(::recv(idlers.back().get(), &byte, 1, MSG_DONTWAIT), -1) << "the youngest one was not";
}

}  // namespace
}  // namespace mpf::router::test
