// SPDX-License-Identifier: MIT
#include "tools/tap/tap_sink.h"

#include <capnp/message.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <limits>

#include "base/printable.h"
#include "schema/conversion.h"
#include "schema/json.h"
#include "schema/text.h"
#include "tools/inspect/dissect.h"
#include "tools/tap/recording.h"
#include "tools/text/json_text.h"
#include "tools/text/show.h"
#include "tools/text/wrap.h"

namespace mpf::tools {
namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;

// The first digits of the number, which each line repeats.
std::string shortLink(const TappedLink& link) {
  return fmt::format("{:<4.4}", hex(link.incarnation));
}
const char* directionText(Direction direction) {
  return direction == Direction::request ? "request" : "reply";
}

class LineSink final : public TapSink {
 public:
  explicit LineSink(std::size_t maxElements) : maxElements_(maxElements) {}

  void opened(std::int64_t atNs, const TappedLink& link) override {
    const auto client = link.client.empty() ? "a client that has ended"
                                            : fmt::format("{}[{}]", link.client, link.clientPid);
    show(fmt::format("{}  --   {} and {}: link {}\n", begin(atNs, link), printable(client),
                     printable(link.server), hex(link.incarnation)));
  }
  // A reply that does not end a request, for example one of a subscription, has a shorter arrow.
  void message(std::int64_t atNs, const TappedLink& link, const TappedMessage& message) override {
    const char* arrow = message.direction == Direction::request ? "->"
                        : message.isFirstReply                  ? "<-"
                                                                : "< ";
    const auto what = message.message ? print(message.message, maxElements_)
                                      : "unreadable: " + printable(message.problem);
    show(fmt::format("{}  {} {:<3} {}{}\n", begin(atNs, link), arrow, message.requestId, what,
                     message.mayHaveChanged ? "  (read late: may have changed)" : ""));
  }
  void missed(std::int64_t atNs, const TappedLink& link, std::uint64_t messages) override {
    show(fmt::format("{}  --   {} missed so far: they arrived too fast\n", begin(atNs, link),
                     counted(messages, "message")));
  }
  void closed(std::int64_t atNs, const TappedLink& link) override {
    show(fmt::format("{}  --   closed\n", begin(atNs, link)));
  }

 private:
  static std::string begin(std::int64_t atNs, const TappedLink& link) {
    return fmt::format("{:%H:%M:%S}.{:06}  {}",
                       fmt::localtime(static_cast<std::time_t>(atNs / kNsPerSecond)),
                       atNs % kNsPerSecond / 1000, shortLink(link));
  }
  std::size_t maxElements_;
};

class JsonSink final : public TapSink {
 public:
  void opened(std::int64_t atNs, const TappedLink& link) override {
    add(atNs, link,
        {{"opened",
          {{"server", link.server},
           {"location", link.location},
           {"client", link.client},
           {"pid", link.clientPid}}}});
  }
  void message(std::int64_t atNs, const TappedLink& link, const TappedMessage& message) override {
    nlohmann::json json{{"direction", directionText(message.direction)},
                        {"requestId", message.requestId},
                        {"firstReply", message.isFirstReply},
                        {"mayHaveChanged", message.mayHaveChanged}};
    if (message.message) json["message"] = toJson(message.message);
    else json["problem"] = message.problem;
    add(atNs, link, std::move(json));
  }
  void missed(std::int64_t atNs, const TappedLink& link, std::uint64_t messages) override {
    add(atNs, link, {{"missed", messages}});
  }
  void closed(std::int64_t atNs, const TappedLink& link) override {
    add(atNs, link, {{"closed", true}});
  }

 private:
  static void add(std::int64_t atNs, const TappedLink& link, nlohmann::json event) {
    event["at_ns"] = atNs;
    event["link"] = hex(link.incarnation);
    show(jsonText(event, -1) + "\n");
  }
};

class FileSink final : public TapSink {
 public:
  explicit FileSink(const std::string& path) : writer_(path) {}

  void opened(std::int64_t atNs, const TappedLink& link) override {
    add(atNs, link, [&](wire::Record::Builder record) {
      auto opened = record.initOpened();
      opened.setServer(link.server);
      opened.setLocation(link.location);
      opened.setClient(link.client);
      opened.setClientPid(link.clientPid);
    });
  }
  void message(std::int64_t atNs, const TappedLink& link, const TappedMessage& message) override {
    ConversionError error{.text = message.problem};
    capnp::MallocMessageBuilder builder;
    auto record = begin(builder, atNs, link).initMessage();
    if (message.message && tryToWire(message.message, record.initEnvelope(), kNoLimit, error)) {
      record.setDirection(wireOf(message.direction));
      record.setRequestId(message.requestId);
      record.setIsFirstReply(message.isFirstReply);
      record.setMayHaveChanged(message.mayHaveChanged);
      return writer_.write(builder);
    }
    add(atNs, link, [&](wire::Record::Builder other) {
      auto unreadable = other.initUnreadable();
      unreadable.setDirection(wireOf(message.direction));
      unreadable.setRequestId(message.requestId);
      unreadable.setProblem(error.text);
    });
  }
  void missed(std::int64_t atNs, const TappedLink& link, std::uint64_t messages) override {
    add(atNs, link, [&](wire::Record::Builder record) { record.setMissed(messages); });
  }
  void closed(std::int64_t atNs, const TappedLink& link) override {
    add(atNs, link, [](wire::Record::Builder record) { record.setClosed(); });
  }
  void finish() override { writer_.close(); }

 private:
  static constexpr ConversionLimits kNoLimit{.maxValueBytes =
                                                 std::numeric_limits<std::size_t>::max()};

  static wire::Direction wireOf(Direction direction) {
    return direction == Direction::request ? wire::Direction::REQUEST : wire::Direction::REPLY;
  }
  static wire::Record::Builder begin(capnp::MessageBuilder& builder, std::int64_t atNs,
                                     const TappedLink& link) {
    auto record = builder.initRoot<wire::Record>();
    record.setAtNs(atNs);
    record.setLink(link.incarnation);
    return record;
  }
  template <class Fill>
  void add(std::int64_t atNs, const TappedLink& link, Fill fill) {
    capnp::MallocMessageBuilder builder;
    fill(begin(builder, atNs, link));
    writer_.write(builder);
  }

  RecordingWriter writer_;
};

}  // namespace

std::unique_ptr<TapSink> TapSink::lines(std::size_t maxElements) {
  return std::make_unique<LineSink>(maxElements);
}
std::unique_ptr<TapSink> TapSink::json() { return std::make_unique<JsonSink>(); }
std::unique_ptr<TapSink> TapSink::file(const std::string& path) {
  return std::make_unique<FileSink>(path);
}

}  // namespace mpf::tools
