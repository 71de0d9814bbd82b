// SPDX-License-Identifier: MIT
// The program behind Victim. Its roles: an echo server, a server that counts requests, a client
// that sends as fast as it can, many clients, a client that listens to a serial line or to another
// server, a client that sends commands to an instrument, a client that leases a GPIB bus.
#include <signal.h>
#include <sys/inotify.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <fmt/format.h>
#include <grp.h>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <mpf/file_descriptor.h>
#include <mpf/gpib_commands.h>
#include <mpf/message_server.h>
#include <mpf/serial_commands.h>
#include <mpf/serial_sniff.h>
#include <mpf/sync_client.h>

#include "base/system_call.h"
#include "tests/support/request_log.h"

namespace {

using namespace std::chrono_literals;

// Prints a line for which the test waits.
template <class... Values>
void say(fmt::format_string<Values...> format, Values&&... values) {
  fmt::print("{}\n", fmt::format(format, std::forward<Values>(values)...));
  std::fflush(stdout);
}

// Echoes. Keeps every seventh Int32, which drops the one kept before, and answers some arrays with
// new arrays, some of which it publishes.
int serve(const mpf::Backplane& backplane, mpf::ServerOptions options) {
  options.queueSize = 32;
  options.maxBorrowed = 64;
  mpf::MessageServer server(backplane, "echo", options);
  mpf::Message kept;
  int requests = 0;
  server.on<mpf::Int32>([&](mpf::Int32Message&& request) {
    if (++requests % 7 == 0) {
      kept = std::move(request);
    } else {
      static_cast<void>(server.reply(std::move(request)));
    }
  });
  server.on<mpf::Float64Array>([&](mpf::Float64ArrayMessage&& request) {
    if (++requests % 3 != 0) return static_cast<void>(server.reply(std::move(request)));
    if (requests % 2 == 0)
      return static_cast<void>(
          server.publish(server.allocShared<mpf::Float64Array>(3000), request));
    auto reply = server.allocReplyMessage<mpf::Float64Array>(request, 3000);
    static_cast<void>(server.reply(std::move(reply)));
  });
  server.on<mpf::Float64>([](mpf::Float64& request) { request.value += 1; });
  say("open");
  return server.runUntilSignal();
}

// Counts each request in the log, and then echoes it.
int count(const mpf::Backplane& backplane, const std::string& file, mpf::ServerOptions options) {
  mpf::test::RequestLog log(file);
  mpf::MessageServer server(backplane, "echo", options);
  server.on<mpf::Int32>([&](mpf::Int32& request) {
    if (request.cmd == mpf::test::RequestLog::kCounted) log.note(request.value);
  });
  server.on<mpf::Int32Array>([&](mpf::Int32ArrayMessage& request) {
    if (request->cmd == mpf::test::RequestLog::kCounted && !request.value().empty())
      log.note(request.value()[0]);
  });
  server.on<mpf::Float64Array>([](mpf::Float64ArrayMessage&) {});
  server.on<mpf::Float64>([](mpf::Float64& request) { request.value += 1; });
  say("open");
  return server.runUntilSignal();
}

int flood(const mpf::Backplane& backplane) {
  mpf::MessageClient client(backplane, [](const mpf::Message&) {});
  client.bind("echo");
  if (!client.connectWait(60s)) return 1;
  say("connected");
  for (int sent = 0;; ++sent) {
    if (sent % 3 != 0) {
      static_cast<void>(client.send(mpf::Int32Message({.value = sent})));
    } else {
      static_cast<void>(client.send(client.alloc<mpf::Float64Array>(1000)));
    }
  }
}

// One of many clients: sends some requests to each incarnation of the server, a few at a time.
class Visitor {
 public:
  static constexpr int kRequests = 50;
  static constexpr int kAtATime = 4;

  Visitor(mpf::Dispatcher& dispatcher, std::map<std::uint64_t, int>& done, int crowd)
      : done_(done),
        crowd_(crowd),
        client_(dispatcher, [this](const mpf::Message& message) { take(message); }) {
    client_.bind("echo");
  }
  [[nodiscard]] std::string reason() const { return client_.notConnectedBecause(); }

 private:
  void take(const mpf::Message& message) {
    if (const auto* news = message.tryAs<mpf::Connect>()) {
      if (open_ != 0) say("a change of the connection while {} requests have no end", open_);
      if (news->status != mpf::ConnectStatus::connectYes) return;
      life_ = news->incarnation;
      sent_ = answered_ = 0;
      for (int i = 0; i < kAtATime; ++i) send();
    } else if (const auto* reply = message.tryAs<mpf::Float64>()) {
      --open_;
      if (reply->value != message.getClientExtra() + 1) say("a reply to something else");
      if (++answered_ == kRequests && ++done_[life_] == crowd_) say("answered {:x}", life_);
      send();
    } else {
      --open_;
      const auto fate = message.tryAs<mpf::RequestFate>()->fate;
      if (fate != mpf::Fate::neverTaken && fate != mpf::Fate::outcomeUnknown)
        say("a request was {}", mpf::toString(fate));
    }
  }
  void send() {
    if (sent_ == kRequests) return;
    mpf::Float64Message request({.value = sent_ + 0.0});
    request.setClientExtra(sent_);
    const auto result = client_.send(std::move(request));
    if (result == mpf::SendResult::notConnected) return;  // the server has ended; fates follow
    if (result != mpf::SendResult::sent)
      return say("a send was refused: {}", mpf::toString(result));
    ++sent_;
    ++open_;
  }

  // clients by the incarnation of the server that answered them
  std::map<std::uint64_t, int>& done_;
  int crowd_;
  std::uint64_t life_ = 0;
  int sent_ = 0;
  int answered_ = 0;
  int open_ = 0;
  mpf::MessageClient client_;
};

// Prints "waiting: <reason>" unless the server is running; then "answered <incarnation>" for each
// incarnation of the server that has answered every client. Any other line is an error.
int crowd(const mpf::Backplane& backplane, int clients) {
  mpf::Dispatcher dispatcher(backplane);
  std::map<std::uint64_t, int> done;
  std::vector<std::unique_ptr<Visitor>> visitors;
  for (int i = 0; i < clients; ++i)
    visitors.push_back(std::make_unique<Visitor>(dispatcher, done, clients));
  say("waiting: {}", visitors.back()->reason());
  dispatcher.run();
  return 0;
}

// Changes the user of the process permanently.
void become(const std::string& user, const std::string& group) {
  mpf::checkCall(::setgroups(0, nullptr), "setgroups");
  mpf::checkCall(::setgid(static_cast<gid_t>(std::stoul(group))), "setgid", group);
  mpf::checkCall(::setuid(static_cast<uid_t>(std::stoul(user))), "setuid", user);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // a change of the user resets this
}

// Uses all inotify instances of this user, so that MPF gets no notification of new names.
std::vector<mpf::FileDescriptor> takeAllInotify() {
  std::vector<mpf::FileDescriptor> taken;
  do taken.emplace_back(::inotify_init1(IN_CLOEXEC));
  while (taken.back());
  return taken;
}

int listen(const mpf::Backplane& backplane, const std::string& server, std::int32_t cmd) {
  mpf::SyncClient client(backplane, server);
  if (!client.call(mpf::Int32Message({.cmd = cmd}), 60s)) return 1;
  for (;;) static_cast<void>(client.receive(24h));
}

// Sends a command to an instrument that may not answer, and waits as long as a client can specify.
int ask(const mpf::Backplane& backplane, const std::string& server, const std::string& text) {
  mpf::SyncClient client(backplane, server);
  auto message = mpf::Char8ArrayMessage::allocValue(text.size());
  *message = {.timeout = INT32_MAX, .cmd = mpf::serial::cmdWriteRead, .numberRetrys = INT32_MAX};
  message.setSize(text.size());
  std::copy(text.begin(), text.end(), message.value().begin());
  return client.call(std::move(message), 24h) ? 0 : 1;
}

// Leases the bus for a day, and tells when it has it.
int lease(const mpf::Backplane& backplane, const std::string& server) {
  mpf::SyncClient client(backplane, server);
  auto message = mpf::Char8ArrayMessage::allocValue(0);
  *message = {.cmd = mpf::gpib::cmdLease, .extra = 86'400'000};
  if (!client.call(std::move(message), 60s)) return 1;
  say("leased");
  for (;;) static_cast<void>(client.receive(24h));
}

// Arguments: role, backplane, arguments of the role; then "as USER GROUP", "without-inotify".
int play(const std::vector<std::string>& arguments) {
  const auto argument = [&](std::size_t index) {
    return index < arguments.size() ? arguments[index] : std::string();
  };
  std::vector<mpf::FileDescriptor> taken;
  for (std::size_t at = 3; at < arguments.size(); ++at) {
    if (argument(at) == "as") become(argument(at + 1), argument(at + 2));
    if (argument(at) == "without-inotify") taken = takeAllInotify();
  }
  const auto role = argument(1);
  const auto backplane = mpf::Backplane::attach(argument(2));
  if (role == "serve") return serve(backplane, {});
  if (role == "serve-block") return serve(backplane, {.waitMode = mpf::WaitMode::block});
  if (role == "count") return count(backplane, argument(3), {});
  if (role == "flood") return flood(backplane);
  if (role == "listen" && argument(3).empty())
    return listen(backplane, "serial[0].sniff", mpf::serial::cmdSniffStart);
  if (role == "listen") return listen(backplane, argument(3), std::stoi(argument(4)));
  if (role == "ask") return ask(backplane, argument(3), argument(4));
  if (role == "lease") return lease(backplane, argument(3));
  if (role == "crowd") return crowd(backplane, std::stoi(argument(3)));
  std::fprintf(stderr,
               "role \"%s\": use serve, serve-block, count, flood, listen, ask, "
               "lease or crowd\n",
               role.c_str());
  return 2;
}

}  // namespace

int main(int argc, char** argv) try {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  return play({argv, argv + argc});
} catch (const std::exception& error) {
  say("error: {}", error.what());
  return 1;
}
