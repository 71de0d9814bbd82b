// SPDX-License-Identifier: MIT
#include "tools/tap/gpib_sniff_format.h"

#include <fmt/format.h>
#include <map>
#include <stdexcept>

#include "schema/text.h"
#include "tools/tap/line_time.h"
#include "tools/text/wrap.h"

namespace mpf::tools {
namespace {

using GpibRecord = gpib::SniffRecord;

char letter(const GpibRecord& record) { return record.has(GpibRecord::kReceived) ? 'R' : 'T'; }

// Begins with a line of received bytes, as the original did.
class ManualLines final : public GpibSniffFormat {
 public:
  std::string add(const GpibRecord& record) override {
    auto text = turnTo(letter(record));
    const bool isPrintable = record.value >= 0x20 && record.value < 0x7f;
    text += isPrintable ? std::string(1, static_cast<char>(record.value))
                        : fmt::format(" {:#04x}", record.value);
    return text;
  }
  std::string missing(std::uint64_t bytes) override {
    auto text =
        fmt::format("{}({} missing)\n", direction_ == '\0' ? "" : "\n", counted(bytes, "byte"));
    direction_ = '\0';
    return text;
  }
  std::string flush() override { return {}; }
  std::string end() override {
    return std::string(isFirst_ ? "R" : "") + (isFirst_ || direction_ != '\0' ? "\n" : "") +
           "gpibSniff done\n";
  }

 private:
  std::string turnTo(char direction) {
    if (direction == direction_) return {};
    std::string text;
    if (isFirst_ && direction == 'T') text = "R\n";
    if (direction_ != '\0') text = "\n";
    isFirst_ = false;
    direction_ = direction;
    return text + direction;
  }
  bool isFirst_ = true;
  char direction_ = '\0';  // of the present line; 0: no line has begun
};

class DecodedLines final : public GpibSniffFormat {
 public:
  explicit DecodedLines(std::int64_t realtimeOffsetNs) : time_(realtimeOffsetNs) {}

  std::string add(const GpibRecord& record) override {
    const bool isCommand = record.has(GpibRecord::kAttention);
    std::string text;
    if (isOpen_ &&
        (isCommand != isCommand_ || letter(record) != direction_ || bytes_.size() >= kMostBytes))
      text = flush();
    if (!isOpen_) begin(record);
    if (isCommand) {
      if (!commands_.empty()) commands_ += ", ";
      commands_ += gpibCommandName(record.value);
    } else {
      bytes_ += static_cast<char>(record.value);
    }
    return record.has(GpibRecord::kEnd) ? text + close(", EOI") : text;
  }
  std::string missing(std::uint64_t bytes) override {
    return flush() + fmt::format("({} missing)\n", counted(bytes, "byte"));
  }
  std::string flush() override { return isOpen_ ? close("") : std::string(); }

 private:
  static constexpr std::size_t kMostBytes = 80;

  void begin(const GpibRecord& record) {
    isOpen_ = true;
    isCommand_ = record.has(GpibRecord::kAttention);
    direction_ = letter(record);
    startNs_ = record.atNs;
    commands_.clear();
    bytes_.clear();
  }
  std::string close(const char* end) {
    isOpen_ = false;
    const auto what = isCommand_ ? commands_ : '"' + escape(bytes_) + '"';
    return fmt::format("{}  {}  {}{}\n", time_.of(startNs_), direction_, what, end);
  }

  LineTime time_;
  bool isOpen_ = false;
  bool isCommand_ = false;
  char direction_ = 'T';
  std::int64_t startNs_ = 0;
  std::string commands_;
  std::string bytes_;
};

class JsonObjects final : public GpibSniffFormat {
 public:
  std::string add(const GpibRecord& record) override {
    return fmt::format(
        "{{\"at_ns\": {}, \"direction\": \"{}\", \"atn\": {}, \"eoi\": {}, \"value\": {}}}\n",
        record.atNs, letter(record), record.has(GpibRecord::kAttention),
        record.has(GpibRecord::kEnd), record.value);
  }
  std::string missing(std::uint64_t bytes) override {
    return fmt::format("{{\"missing\": {}}}\n", bytes);
  }
  std::string flush() override { return {}; }
};

}  // namespace

// Source: IEEE 488.1, "Remote message coding".
std::string gpibCommandName(std::uint8_t command) {
  static const std::map<std::uint8_t, const char*> kNames{
      {0x01, "GTL"}, {0x04, "SDC"}, {0x05, "PPC"}, {0x08, "GET"}, {0x09, "TCT"}, {0x11, "LLO"},
      {0x14, "DCL"}, {0x15, "PPU"}, {0x18, "SPE"}, {0x19, "SPD"}, {0x3f, "UNL"}, {0x5f, "UNT"}};
  const auto byte = static_cast<std::uint8_t>(command & 0x7f);  // DIO8 has no meaning
  if (const auto name = kNames.find(byte); name != kNames.end()) return name->second;
  const int address = byte & 0x1f;
  switch (byte & 0x60) {
    case 0x20:
      return fmt::format("LAG {}", address);
    case 0x40:
      return fmt::format("TAG {}", address);
    case 0x60:
      return fmt::format("SAD {}", address);
    default:
      return fmt::format("{:#04x}", command);
  }
}

std::unique_ptr<GpibSniffFormat> GpibSniffFormat::make(const std::string& name,
                                                       std::int64_t realtimeOffsetNs) {
  if (name == "manual") return std::make_unique<ManualLines>();
  if (name == "decode") return std::make_unique<DecodedLines>(realtimeOffsetNs);
  if (name == "json") return std::make_unique<JsonObjects>();
  throw std::invalid_argument(
      fmt::format("unknown sniff format \"{}\"; use manual, decode or json", name));
}

}  // namespace mpf::tools
