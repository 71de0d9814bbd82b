// SPDX-License-Identifier: MIT
// ControlServer: the supervisor's end of the ControlProtocol. It waits for no caller: requests
// arrive, and replies leave, in pieces. When the process has no file descriptor left, a caller gets
// an error.
//
// Threads  one.
// Trust    a caller may send anything, or nothing, or not read its reply: callers and requests are
//          limited.
#pragma once

#include <poll.h>

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "crate/supervisor/control_protocol.h"

namespace mpf::crate {

class ControlServer {
 public:
  // Returns the reply to a request; the text of an exception becomes its error.
  using Answer = std::function<nlohmann::json(const nlohmann::json& request)>;

  explicit ControlServer(Answer answer) : answer_(std::move(answer)) {}
  //   throws  std::system_error
  void listen(const CrateFolder& folder);

  // Adds its descriptors to those for poll().
  void addTo(std::vector<pollfd>& polled) const;
  // Serves the callers whose descriptors, in the order of addTo(), are ready.
  void handle(const std::vector<pollfd>& polled);

 private:
  struct Caller {
    FileDescriptor socket;
    std::string request;
    std::string reply;  // the part that is not sent yet
  };
  void accept();
  void refuseCaller();
  [[nodiscard]] bool serve(Caller& caller);
  [[nodiscard]] bool receive(Caller& caller);
  [[nodiscard]] static bool sendSome(Caller& caller);
  [[nodiscard]] nlohmann::json replyTo(const std::string& request);

  Answer answer_;
  FileDescriptor listening_;
  FileDescriptor spare_;  // closed to refuse a caller when no other descriptor is free
  std::vector<Caller> callers_;
};

}  // namespace mpf::crate
