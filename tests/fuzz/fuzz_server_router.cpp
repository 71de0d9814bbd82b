// SPDX-License-Identifier: MIT
// A server router, a server that its peer may use, and a peer that sends random items.
#include <memory>

#include <mpf/message_server.h>

#include "router/incoming/server_router.h"
#include "tests/fuzz/fuzzers.h"
#include "tests/fuzz/router_scene.h"

namespace mpf::test {
namespace {

class ServerRouterPlay {
 public:
  ServerRouterPlay(RouterScene& scene, std::span<const std::uint8_t> input)
      : scene_(scene),
        choices_(input),
        connection_(makeConnection()),
        far_(kj::mv(connection_.ends[1]), items_),
        router_(std::make_unique<router::ServerRouter>(scene.context, kj::mv(connection_.ends[0]),
                                                       "", "fuzz", false)),
        run_(router_->run().then([this] { over_ = true; }).eagerlyEvaluate(nullptr)) {
    openServer();
    scene_.onServers = [this] {
      scene_.monitors.lookAtAll();
      router_->onServers();
    };
  }
  ~ServerRouterPlay() {
    scene_.onServers = [] {};
    run_ = nullptr;
    router_ = nullptr;
    scene_.settle();
  }
  ServerRouterPlay(const ServerRouterPlay&) = delete;
  ServerRouterPlay& operator=(const ServerRouterPlay&) = delete;

  void run() {
    if (!choices_.oneIn(64)) far_.send(frameOf({greeting()}));
    while (!choices_.isOver() && !over_) {
      step();
      scene_.settle();
    }
  }

 private:
  void step() {
    switch (choices_.below(8)) {
      case 0:
        return serve();
      case 1:
        return far_.setReading(choices_.below(2) == 0);
      case 2:
        return choices_.below(4) == 0 ? openServer() : server_.reset();
      case 3:
        return scene_.context.config.serve.empty() || choices_.below(8) != 0 ? serve() : reload();
      default:
        return far_.send();
    }
  }
  void openServer() {
    if (!server_)
      server_ = std::make_unique<MessageServer>(scene_.backplane, "echo",
                                                ServerOptions{.location = 0, .queueSize = 4});
  }
  // Does with each request something that a valid server may do.
  void serve() {
    constexpr int kMost = 16;
    for (int i = 0; server_ && i < kMost; ++i) {
      auto request = server_->receive();
      if (!request) return;
      switch (choices_.below(4)) {
        case 0:
          static_cast<void>(server_->reply(std::move(request)));
          break;
        case 1:
          static_cast<void>(server_->reply(
              server_->allocReplyMessage<Float64Array>(request, choices_.below(4096))));
          static_cast<void>(server_->reply(std::move(request)));
          break;
        case 2:
          server_->refuse(std::move(request));
          break;
        default:
          kept_ = std::move(request);
      }
    }
  }
  void reload() {
    router_->onConfig();
    far_.send();
  }

  RouterScene& scene_;
  Choices choices_;
  RandomItems<Choices> items_{choices_, Side::client};
  kj::TwoWayPipe connection_;
  std::unique_ptr<MessageServer> server_;
  Message kept_;
  FarEnd far_;
  std::unique_ptr<router::ServerRouter> router_;
  bool over_ = false;
  kj::Promise<void> run_;
};

}  // namespace

void playServerRouter(std::span<const std::uint8_t> input) {
  static RouterScene scene;
  ServerRouterPlay(scene, input).run();
}

}  // namespace mpf::test
