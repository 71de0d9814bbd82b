// SPDX-License-Identifier: MIT
// GpibRequest: a request of include/mpf/gpib_commands.h, checked, and copied from the memory that
// its client can write to.
//
// Threads  a plain value.
// Trust    any field of a request may have any value: an invalid one makes `problem` a sentence.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include <mpf/clock.h>
#include <mpf/drivers/gpib/gpib_types.h>
#include <mpf/message_of.h>

namespace mpf {

// What the server allows to a request.
struct GpibLimits {
  std::size_t bufferBytes = 4096;  // longest read
  std::chrono::milliseconds timeout{3000};  // of requests with timeout 0
  std::chrono::milliseconds maxTimeout{60'000};
  std::chrono::milliseconds maxLease{60'000};
  // Of a poll after a service request; longer than the way to the controller and back.
  std::chrono::milliseconds pollTimeout{100};
};

struct GpibRequest {
  std::int32_t command = 0;  // gpib::cmd..., without options
  bool sendEnd = true;
  std::vector<GpibAddress> addresses{};  // empty: all instruments, or none is concerned
  GpibReadLimits limits{};
  bool isCountRequested = false;  // limits.maxBytes is the client's number, not the buffer's
  std::int32_t extra = 0;
  std::chrono::milliseconds lease{};
  Deadline until = Deadline::never();
  std::vector<std::uint8_t> data{};
  std::string problem{};  // why it is invalid; empty: it is valid

  [[nodiscard]] static GpibRequest from(const Char8ArrayMessage& message, const GpibLimits& limits);
  // For log lines: "write-read of 22".
  [[nodiscard]] std::string text() const;
};

}  // namespace mpf
