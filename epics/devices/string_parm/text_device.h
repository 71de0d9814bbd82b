// SPDX-License-Identifier: MIT
// TextDevice: base of device support that exchanges text with a serial server, or with another
// server that answers Char8Array messages.
//
//   startIO() ─ sendText() ─► server ─► reply ─► takeAnswer(text, status)
#pragma once

#include <algorithm>
#include <chrono>
#include <optional>
#include <string>
#include <string_view>

#include <mpf/epics/dev_mpf.h>
#include <mpf/serial_commands.h>

namespace mpf {

struct TextRequest {
  std::int32_t cmd = 0;                          // of <mpf/serial_commands.h>
  std::string_view text = {};                    // bytes to write
  std::chrono::milliseconds timeout{5000};       // longest wait for the line
  std::int32_t maxBytes = 0;                     // > 0: the answer ends after so many bytes
  std::int32_t address = 0;                      // of the instrument, for a GPIB server
  std::optional<std::string_view> eom = {};      // new end of message of the server
};

// The bytes of a reply, with its status.
struct TextAnswer {
  std::string_view text;
  std::int32_t status = 0;  // serialServerStatus...
};

class TextDevice : public DevMpf {
 public:
  long completeIO(dbCommon* record, Message&& message) final;

 protected:
  using DevMpf::DevMpf;
  // The result and the alarm are those of completeIO().
  virtual long takeAnswer(dbCommon* record, TextAnswer answer) = 0;
  long sendText(const TextRequest& request);
};

// Why the server reports `status`, for AMSG.
const char* reasonOf(std::int32_t status) noexcept;

// takeAnswer() of an output record.
long takeWriteStatus(DevMpf& device, dbCommon* record, std::int32_t status);

// Makes a record undefined, with a UDF alarm, severity INVALID, and AMSG `reason`.
void setUndefined(dbCommon* record, const char* reason);

}  // namespace mpf
