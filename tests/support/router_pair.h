// SPDX-License-Identifier: MIT
// RouterPair: two backplanes with a router on each, as on two hosts. Clients on the near backplane
// reach servers on the far one.
//
//   near: client ─► mpf-router ══ TCP ══ mpf-router ─► server :far
//
//   RouterPair routers;
//   routers.start();                            // or startFar() and startNear(), in any order
//   MessageServer server(routers.far(), "echo", {.location = RouterPair::kLocation});
//   MessageClient client(routers.near(), ...);
//   client.bind("echo", RouterPair::kLocation);
//   routers.expectGoodEnd();                    // after servers and clients are destroyed
//
// Link mpf_test_routers. The routers die with the test.
//
// Threads  one.
#pragma once

#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <mpf/backplane.h>
#include <mpf/file_descriptor.h>

#include "base/system_call.h"
#include "tests/support/router_process.h"
#include "tests/support/test_backplane.h"

namespace mpf::test {

// A free TCP port of this host. No other program gets it while the object exists; routers may
// listen on it, one after the other.
class FreePort {
 public:
  FreePort() : socket_(checkCall(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0), "socket")) {
    const int on = 1;  // with this option, as routers set it, a router can bind the same port
    checkCall(::setsockopt(socket_.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on),
              "SO_REUSEADDR");
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t length = sizeof address;
    checkCall(::bind(socket_.get(), reinterpret_cast<sockaddr*>(&address), length), "bind");
    checkCall(::getsockname(socket_.get(), reinterpret_cast<sockaddr*>(&address), &length),
              "getsockname");
    address_ = "127.0.0.1:" + std::to_string(ntohs(address.sin_port));
  }
  // "127.0.0.1:54321"
  [[nodiscard]] const std::string& address() const noexcept { return address_; }

 private:
  FileDescriptor socket_;
  std::string address_;
};

// Network namespaces and address of the routers, if they do not run in those of the test.
struct RouterPlace {
  std::string address;  // address of the far router, HOST:PORT; empty: a free port of this host
  RouterProcess::Enter enterNear{};
  RouterProcess::Enter enterFar{};
};

class RouterPair {
 public:
  // Location of the servers on the far backplane, and of the same servers as seen from the near
  // one.
  static constexpr std::int32_t kLocation = 1;
  using Options = std::vector<std::string>;

  explicit RouterPair(RouterPlace place = {}) : place_(std::move(place)) {}

  [[nodiscard]] const Backplane& near() const noexcept { return near_; }
  [[nodiscard]] const Backplane& far() const noexcept { return far_; }
  // Address at which the far router listens and to which the near router connects.
  [[nodiscard]] const std::string& address() const noexcept {
    return place_.address.empty() ? port_.address() : place_.address;
  }

  void start(const Options& more = {}) {
    startFar(more);
    startNear(more);
  }
  // Starts the far router; kills a running one first. `more` are further options.
  void startFar(const Options& more = {}) {
    farRouter_.reset();
    farRouter_ = started({"--backplane", far_.name(), "--serve", std::to_string(kLocation),
                          "--listen", address(), "--plain"},
                         more, place_.enterFar);
  }
  void startNear(const Options& more = {}) {
    nearRouter_.reset();
    nearRouter_ = started({"--backplane", near_.name(), "--remote",
                           std::to_string(kLocation) + "=" + address(), "--plain"},
                          more, place_.enterNear);
  }
  // Only after the start.
  [[nodiscard]] RouterProcess& nearRouter() { return *nearRouter_; }
  [[nodiscard]] RouterProcess& farRouter() { return *farRouter_; }

  // Stops both routers as a service manager does, with SIGTERM, and checks their exit statuses.
  void expectGoodEnd() {
    for (auto* router : {&nearRouter_, &farRouter_}) {
      if (!*router) continue;
      EXPECT_EQ((*router)->end(SIGTERM), 0) << (*router)->said();
      router->reset();
    }
  }

 private:
  static std::unique_ptr<RouterProcess> started(Options options, const Options& more,
                                                const RouterProcess::Enter& enter) {
    options.insert(options.end(), more.begin(), more.end());
    return std::make_unique<RouterProcess>(options, enter);
  }
  TestBackplane near_;
  TestBackplane far_;
  FreePort port_;
  RouterPlace place_;
  std::unique_ptr<RouterProcess> nearRouter_;
  std::unique_ptr<RouterProcess> farRouter_;
};

}  // namespace mpf::test
