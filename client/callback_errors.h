// SPDX-License-Identifier: MIT
// CallbackErrors: writes to stderr what callbacks throw on a thread on which no caller could catch
// it.
//
//   mpf: the callback of the client of server "dac" at location 0 threw an exception: no such
//   record. The dispatcher continues; catch the exception in the callback. (41 more since the last
//   report)
//
// Threads  one.
#pragma once

#include <cstdint>
#include <string>

namespace mpf {

class CallbackErrors {
 public:
  // The client whose callback threw the exception that is reported next.
  void note(const std::string& server, std::int32_t location) noexcept;
  // Reports the exception that is being handled; not more often than once a second, with the number
  // of those that were left out.
  void report() noexcept;

 private:
  std::string client_;
  std::int64_t reportedNs_ = 0;  // when; 0: never
  std::uint64_t leftOut_ = 0;
};

}  // namespace mpf
