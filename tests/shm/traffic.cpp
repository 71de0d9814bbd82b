// SPDX-License-Identifier: MIT
// The programs that second_reader_test.py reads: a server and a client with known traffic on a
// backplane of their own.
//
//   traffic layout            prints the offset of every field in the code
//   traffic run               prints the expected values, and again for each line "serve" on stdin;
//                             exits at the end of stdin
//   traffic clean BACKPLANE   removes the files of dead processes
#include <iostream>
#include <string>

#include <mpf/message_client.h>
#include <mpf/message_server.h>

#include "shm/histogram.h"
#include "tests/shm/layout_fields.h"

namespace mpf::test {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;

constexpr int kAnswered = 5;
constexpr int kQueueSize = 8;

class Traffic {
 public:
  Traffic() {
    server_.on<Int32>([](Int32&) {});
    server_.on<Char8Array>([](Char8Array&) {});
    client_.bind(server_.getName(), server_.location());
    waiting_.bind("not there", -3);
    while (!client_.isConnected()) turn();
    for (int i = 0; i < kAnswered; ++i) {
      static_cast<void>(client_.send(Int32Message({.value = i})));
      while (replies_ <= i) turn();
    }
    turn();  // each side finds its ring empty, and frees all slots
    fillQueue();
  }
  void serve() {
    while (server_.handleOne()) ++served_;
  }
  [[nodiscard]] json seen() const {
    return {{"backplane", backplane_.name()},
            {"server", server_.getName()},
            {"location", server_.location()},
            {"queueSize", kQueueSize},
            {"label", "traffic's client"},
            {"absentServer", "not there"},
            {"absentLocation", -3},
            {"pid", ::getpid()},
            {"uid", ::getuid()},
            {"program", ::program_invocation_short_name},
            {"sent", kAnswered + kQueueSize},
            {"refused", refused_},
            {"served", kAnswered + served_},
            {"replies", replies_},
            {"requests", served_ == 0 ? requests_ : json::array()},
            {"text", text_}};
  }

 private:
  void turn() {
    server_.handleOne();
    dispatcher_.runOnce(Deadline::after(100us));
  }
  // A long text in a chunk, a text of several slots, numbers; then one message too many.
  void fillQueue() {
    for (int i = 0; i < kQueueSize; ++i) {
      std::uint32_t id = 0;
      const auto deadline = i == 3 ? Deadline::after(1h) : Deadline::never();
      SendResult result{};
      if (i < 2) {
        auto text = client_.alloc<Char8Array>(i == 0 ? text_.size() : 90);
        text_.copy(text.value().data(), text.value().size());
        result = client_.send(std::move(text), deadline, &id);
      } else {
        Int32Message number({.value = 1000 + i});
        number.setClientType(-i);
        number.setClientExtra(100 + i);
        result = client_.send(std::move(number), deadline, &id);
      }
      const auto type = static_cast<int>(i < 2 ? MessageType::char8Array : MessageType::int32);
      requests_.push_back({{"requestId", id},
                           {"type", type},
                           {"clientType", i < 2 ? 0 : -i},
                           {"clientExtra", i < 2 ? 0 : 100 + i},
                           {"deadlineNs", deadline.isNever() ? 0 : deadline.ns()},
                           {"result", static_cast<int>(result)}});
    }
    if (client_.send(Int32Message()) == SendResult::queueFull) ++refused_;
  }

  Backplane backplane_ = Backplane::isolated();
  MessageServer server_{backplane_,
                        "AIM1/1 [0].x",
                        {.location = 7, .queueSize = kQueueSize, .waitMode = WaitMode::block}};
  std::string text_ = [] {
    std::string text;
    for (int i = 0; i < 500; ++i) text += "line " + std::to_string(i) + '\n';
    return text;
  }();
  Dispatcher dispatcher_{backplane_, {.label = "traffic's client"}};
  int replies_ = 0;
  int served_ = 0;
  int refused_ = 0;
  json requests_ = json::array();
  MessageClient client_{dispatcher_, [this](const Message& message) {
                          replies_ += message.getType() == MessageType::int32 ? 1 : 0;
                        }};
  MessageClient waiting_{dispatcher_, [](const Message&) {}};
};

int run() {
  Traffic traffic;
  std::cout << traffic.seen() << std::endl;
  for (std::string line; std::getline(std::cin, line);) {
    if (line == "serve") traffic.serve();
    std::cout << traffic.seen() << std::endl;
  }
  return 0;
}

int printLayout() {
  json ends = json::array();
  for (std::uint32_t i = 0; i < layout::kHistogramBuckets; ++i)
    ends.push_back(HistogramBuckets::endNs(i));
  std::cout << json{{"structs", layoutFields()},
                    {"constants", layoutConstants()},
                    {"kinds", layoutKinds()},
                    {"bucketEnds", ends}}
            << '\n';
  return 0;
}

}  // namespace
}  // namespace mpf::test

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "";
  if (what == "layout") return mpf::test::printLayout();
  if (what == "run") return mpf::test::run();
  if (what == "clean" && argc > 2) {
    for (const auto& removed : mpf::Backplane::attach(argv[2]).removeDead())
      std::cout << removed << '\n';
    return 0;
  }
  std::cerr << "usage: traffic layout | run | clean BACKPLANE\n";
  return 2;
}
