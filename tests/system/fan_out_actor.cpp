// SPDX-License-Identifier: MIT
// The processes of fan_out_test.cpp:
//
//   fan_out_actor server BACKPLANE 0        publishes images as fast as it can
//   fan_out_actor reader BACKPLANE NUMBER   reports each image to the server
//
// A reader keeps the last images, and checks that they do not change. It exits with 1 when an image
// is not what the server has published.
#include <sys/prctl.h>

#include <csignal>
#include <cstdlib>
#include <deque>
#include <string>

#include "tests/system/fan_out_camera.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kKept = 2;

class Reader {
 public:
  Reader(const Backplane& backplane, std::int32_t number)
      : number_(number), dispatcher_(backplane, {.label = "reader"}) {
    client_.bind("camera");
  }
  int run() {
    while (!hasFailed_) dispatcher_.runOnce(Deadline::after(1s));
    return 1;
  }

 private:
  void take(Message&& message) {
    if (const auto* connect = message.tryAs<Connect>()) {
      if (connect->status == ConnectStatus::connectYes) send(FanOutRequest::subscribe, 0);
      return;
    }
    const auto* image = message.tryAs<Float64Array>();
    if (image == nullptr) return;  // the reply to a report, or a fate
    missed_ += static_cast<std::int32_t>(message.getMissed());
    const auto number = image->extra;
    for (const auto& kept : kept_) check(kept);
    // A program may write to what it received.
    if (number % 3 == 0) message.valueAs<Float64Array>()[0] = imageElement(number);
    check(message);
    kept_.push_back(std::move(message));
    if (kept_.size() > kKept) kept_.pop_front();
    send(FanOutRequest::report, number);
  }
  void check(const Message& message) {
    if (!isWholeImage(message)) hasFailed_ = true;
  }
  void send(FanOutRequest what, std::int32_t value) {
    static_cast<void>(client_.send(Int32Message({.cmd = static_cast<std::int32_t>(what),
                                                 .address = number_,
                                                 .extra = missed_,
                                                 .value = value})));
  }

  std::int32_t number_;
  std::int32_t missed_ = 0;
  bool hasFailed_ = false;
  std::deque<Message> kept_;
  Dispatcher dispatcher_;
  MessageClient client_{dispatcher_, [this](Message&& message) { take(std::move(message)); }};
};

}  // namespace
}  // namespace mpf::test

int main(int, char** argv) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  const auto backplane = mpf::Backplane::attach(argv[2]);
  if (std::string(argv[1]) == "server") mpf::test::Camera(backplane).run();
  return mpf::test::Reader(backplane, std::atoi(argv[3])).run();
}
