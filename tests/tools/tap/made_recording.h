// SPDX-License-Identifier: MIT
// MadeRecording: a recording whose messages and times the test chooses.
//
//   MadeRecording recording(file);
//   recording.open(1, "dac");                                    // link 1
//   recording.request(1, 7, 0ms, Int32Message({.value = 5}));    // request 7 of that link
//   recording.reply(1, 7, 20ms, Int32Message({.value = 6}));
#pragma once

#include <capnp/message.h>
#include <string>

#include <mpf/clock.h>
#include <mpf/message_of.h>

#include "schema/conversion.h"
#include "tools/tap/recording.h"

namespace mpf::test {

class MadeRecording {
 public:
  static constexpr std::int64_t kBeginNs = 1'700'000'000'000'000'000;

  explicit MadeRecording(const std::string& file) : writer_(file) {}

  void open(std::uint64_t link, const std::string& server) {
    write(link, {}, [&](auto record) { record.initOpened().setServer(server); });
  }
  void missed(std::uint64_t link, std::uint64_t count) {
    write(link, {}, [&](auto record) { record.setMissed(count); });
  }
  void request(std::uint64_t link, std::uint32_t id, Nanoseconds at, const Message& message) {
    add(link, id, at, wire::Direction::REQUEST, message);
  }
  void reply(std::uint64_t link, std::uint32_t id, Nanoseconds at, const Message& message) {
    add(link, id, at, wire::Direction::REPLY, message);
  }

 private:
  template <class Fill>
  void write(std::uint64_t link, Nanoseconds at, Fill fill) {
    capnp::MallocMessageBuilder builder;
    auto record = builder.initRoot<wire::Record>();
    record.setAtNs(kBeginNs + at.count());
    record.setLink(link);
    fill(record);
    writer_.write(builder);
  }
  void add(std::uint64_t link, std::uint32_t id, Nanoseconds at, wire::Direction direction,
           const Message& message) {
    write(link, at, [&](auto record) {
      auto item = record.initMessage();
      item.setDirection(direction);
      item.setRequestId(id);
      ConversionError error;
      if (!tryToWire(message, item.initEnvelope(), {}, error)) throw std::runtime_error(error.text);
    });
  }

  tools::RecordingWriter writer_;
};

}  // namespace mpf::test
