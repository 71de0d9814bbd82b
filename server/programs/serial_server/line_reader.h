// SPDX-License-Identifier: MIT
// LineReader: collects the bytes that a serial port receives into answers, and keeps late bytes out
// of the answers to later requests.
//
//   bytes ─► input, at most bufferBytes ─► end of message, `extra` bytes, or overflow ─► answer
//   lost or damaged bytes ─► a mark in the input ─► the faults of each answer that contains it
//
//   read        (cmd 1)   may begin with what was received before it: the circular buffer; its
//                         retry continues a read that ended with a timeout
//   write-read  (cmd 3)   waitUntilSynchronized() ─► port.writeRead() ─► takeAnswer()
//                         nothing that arrived before its first byte was sent is in its answer
//
// Threads  the port calls byteReceived, readBegins, sendBegins, readEnds and lineFailed; the
//          server's thread calls the rest. A mutex protects the state.
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
  // Called when input that no request had read is dropped, at most once until the next write-read
  // is sent. Runs under the reader's mutex, on either thread: it must not call the reader.
  using SurplusHandler = std::function<void()>;

  //   eom       0 to 2 bytes that end an answer
  //   circular  keep bytes that are received while no request reads
  //   onFault   called after each fault of the line, on the port's thread
  LineReader(std::size_t bufferBytes, std::string eom, bool circular, const LineLimits& limits = {},
             SurplusHandler onSurplus = {}, std::function<void()> onFault = {});

  void setEom(std::string eom);
  void setCircular(bool circular);

  // Prepares the next read.
  //   flush      drop the bytes that were received before
  //   maxBytes   the answer ends after this number of bytes; 0: no limit
  //   mayBeLate  keep an answer that does not arrive in time, for a read after tryContinue()
  void prepareRead(bool flush, std::size_t maxBytes, bool mayBeLate);
  // Prepares the next write-read.
  //   maxBytes   the answer ends after this number of bytes; 0: no limit
  //   mayBeLate  keep an answer that does not arrive in time, for a read after tryContinue()
  void prepareQuestion(std::size_t maxBytes, bool mayBeLate);
  // Makes the next read continue the answer that the last request did not get in time. Returns
  // false when that answer was not kept; that of a write-read is not if its end cannot be
  // recognised.
  //   mayBeLate  keep the answer again
  [[nodiscard]] bool tryContinue(bool mayBeLate);

  enum class Sync {
    synchronized,  // the request may be sent now
    noSilence,  // `until` has passed
    abandoned,  // isAbandoned() returned true
  };
  // Waits until a request may be sent. Before a write-read it drops the input, and the bytes that
  // arrive while it waits.
  Sync waitUntilSynchronized(bool isQuestion, Deadline until,
                             const std::function<bool()>& isAbandoned);
  // A plain write has ended.
  void noteWritten();

  struct Answer {
    std::string bytes;
    bool overflow = false;
    bool wasDisturbed = false;  // input arrived before the question was sent: it was not sent
    // serialFault...: bytes of the answer, or right before it, are missing or damaged
    std::uint8_t faults = 0;
  };
  // Returns the answer of the read that has ended.
  Answer takeAnswer();

  ByteHandlerResult byteReceived(std::uint8_t byte) override;
  ByteHandlerResult readBegins() override;
  void sendBegins() override;
  void readEnds(SerialPortStatus status) override;
  void lineFailed(LineFault fault, std::uint64_t count) override;

 private:
  enum class Phase : std::uint8_t {
    idle,
    syncing,  // a write-read waits for silence: input is dropped
    armed,  // a write-read is about to be sent: input stops it
    reading,  // a request collects its answer
    collectingLate,  // the request has timed out; its late answer is collected for a retry
  };
  // [bytes] Length of the first complete answer in the input; 0 when no answer is complete.
  [[nodiscard]] std::size_t completeBytes() const;
  // Whether the last byte of the input completes an answer, when no answer was complete before.
  [[nodiscard]] bool endsAnswer() const;
  ByteHandlerResult collect(std::uint8_t byte);
  void dropOldestByte();
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
  bool isSurplusReported_ = false;
  std::size_t maxBytes_ = 0;
  std::size_t returnedBytes_ = 0;  // while collecting a late answer: the reply had these
  MarkedInput input_;
  Answer answer_;
};

}  // namespace mpf
