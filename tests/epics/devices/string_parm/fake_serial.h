// SPDX-License-Identifier: MIT
// FakeSerial: a server of Char8Array messages whose replies the test chooses, and records that
// exchange text with it.
#pragma once

#include <algorithm>
#include <fmt/format.h>
#include <mutex>
#include <string>

#include <mpf/serial_commands.h>

#include "tests/epics/epics_fixture.h"

namespace mpf::test {

// Answers each request that reads with the same text and status; keeps the requests.
class FakeSerial {
 public:
  struct Request {
    Char8Array fields;
    std::string text;
  };
  FakeSerial(const Backplane& backplane, std::string answer, std::int32_t status = 0)
      : server_(backplane, "a-Serial[0]",
                [this, answer = std::move(answer), status](MessageServer& self, Message&& message) {
                  auto request = *Char8ArrayMessage::tryFrom(std::move(message));
                  keep({*request, {request.value().begin(), request.value().end()}});
                  const bool isRead = (request->cmd & serial::cmdRead) != 0;
                  auto reply =
                      self.allocReplyMessage<Char8Array>(request, isRead ? answer.size() : 0);
                  if (isRead) std::copy(answer.begin(), answer.end(), reply.value().begin());
                  reply->status = status;
                  static_cast<void>(self.reply(std::move(reply)));
                }) {}
  Request last() {
    const std::lock_guard lock(mutex_);
    return last_;
  }
  // A record whose VAL is in the database has no alarm before it processes either.
  void waitForText(const std::string& text) {
    while (last().text != text) std::this_thread::yield();
  }

 private:
  void keep(const Request& request) {
    const std::lock_guard lock(mutex_);
    last_ = request;
  }
  std::mutex mutex_;
  Request last_;
  ThreadServer server_;
};

// Databases with one record, "v".
inline std::string inputRecord(const char* type, const char* dtyp, const char* parameters,
                               const char* more = "") {
  return fmt::format(
      "record({}, \"v\") {{ field(DTYP, \"{}\") field(INP, \"#C0 S0 @a-Serial[0]{}\") "
      "field(PINI, \"YES\") {} }}\n",
      type, dtyp, parameters, more);
}
inline std::string outputRecord(const char* type, const char* dtyp, const char* parameters,
                                const char* more = "") {
  return fmt::format(
      "record({}, \"v\") {{ field(DTYP, \"{}\") field(OUT, \"#C0 S0 @a-Serial[0]{}\") "
      "field(PINI, \"YES\") {} }}\n",
      type, dtyp, parameters, more);
}

}  // namespace mpf::test
