// SPDX-License-Identifier: MIT
// LineReader: collects what a serial port receives into answers, and keeps questions apart from the
// answers of others.
//
//   bytes ─► input, at most bufferBytes ─► first end of message, `extra` bytes, or overflow ─► answer
//   lost or damaged bytes ─► a mark in the input ─► the faults of each answer that spans it
//
//   read        (cmd 1)   may begin with what was received before it: the circular buffer
//   write-read  (cmd 3)   tryGetInStep() ─► port.writeRead() ─► takeAnswer()
//                         nothing that arrived before its first byte was sent is in its answer
//
// Threads  the port calls byteReceived, readBegins, sendBegins and readEnds; the server's thread
//          everything else. A mutex joins them.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>

#include <mpf/clock.h>
#include <mpf/drivers/serial/serial_port.h>

#include "server/programs/serial_server/line_sync.h"
#include "server/programs/serial_server/marked_input.h"

namespace mpf {

class LineReader final : public ByteHandler {
 public:
  // Called when input is thrown away that no request had read, once until the next write-read is
  // sent. Runs under the reader's mutex, on either thread: it must not call the reader.
  using SurplusHandler = std::function<void()>;

  // `eom`: 0 to 2 bytes that end an answer. `circular`: keep what is received while nobody reads.
  // `onFault`: called after each fault of the line, on the port's thread.
  LineReader(std::size_t bufferBytes, std::string eom, bool circular, const LineLimits& limits = {},
             SurplusHandler onSurplus = {}, std::function<void()> onFault = {});

  void setEom(std::string eom);
  void setCircular(bool circular);

  // For the next read: drop what is there first; end after so many bytes, 0 for no such limit.
  void prepareRead(bool flush, std::size_t maxBytes);
  // For the next write-read: its answer ends after so many bytes, 0 for no such limit. With
  // `mayBeLate` an answer that does not come in time stays here, for a read after tryContinue().
  void prepareQuestion(std::size_t maxBytes, bool mayBeLate);
  // The next read goes on with the answer that the last write-read did not get in time. False: its
  // end could not be told, or it was not kept.
  [[nodiscard]] bool tryContinue();

  enum class Sync {
    inStep,  // the request may be sent now
    noSilence,  // `until` has passed
    abandoned,  // isAbandoned() returned true
  };
  // Waits until a request may be sent. Before a question the input is thrown away, and what arrives
  // during the wait.
  Sync getInStep(bool isQuestion, Deadline until, const std::function<bool()>& isAbandoned);
  // A plain write has ended.
  void noteWritten();

  struct Answer {
    std::string bytes;
    bool overflow = false;
    bool wasDisturbed = false;  // input arrived before the question was sent: it was not sent
    // bits of serial_server.h: bytes are missing or were damaged within it or right before it
    std::uint8_t faults = 0;
  };
  // Of the read that has ended.
  Answer takeAnswer();

  ByteHandlerResult byteReceived(std::uint8_t byte) override;
  ByteHandlerResult readBegins() override;
  void sendBegins() override;
  void readEnds(SerialPortStatus status) override;
  void lineFailed(LineFault fault, std::uint64_t count) override;

 private:
  enum class Phase : std::uint8_t {
    idle,
    syncing,  // a question waits for silence: input is thrown away
    armed,  // it is about to be sent: input would disturb it
    reading,
    collectingLate,  // the request has timed out; its late answer is collected for a retry
  };
  // Length of the first complete answer in the input; 0 when there is none.
  [[nodiscard]] std::size_t completeBytes() const;
  ByteHandlerResult collect(std::uint8_t byte);
  void noteSurplus();
  void dropLateAnswer();

  const std::function<void()> onFault_;
  std::mutex mutex_;
  std::condition_variable answerSeen_;
  std::size_t bufferBytes_;
  std::string eom_;
  bool circular_;
  const SurplusHandler onSurplus_;
  LineSync sync_;
  Phase phase_ = Phase::idle;
  bool isQuestion_ = false;  // the next read, or the one that is outstanding, is a write-read's
  bool mayBeLate_ = false;
  bool continues_ = false;
  bool flush_ = false;
  bool isSurplusTold_ = false;
  std::size_t maxBytes_ = 0;
  MarkedInput input_;
  Answer answer_;
};

}  // namespace mpf
