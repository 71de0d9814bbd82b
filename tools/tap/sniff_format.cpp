// SPDX-License-Identifier: MIT
#include "tools/tap/sniff_format.h"

#include <fmt/format.h>
#include <stdexcept>

#include "schema/text.h"
#include "tools/tap/line_time.h"
#include "tools/text/wrap.h"

namespace mpf::tools {
namespace {

using serial::SniffKind;
using serial::SniffRecord;

// T and R as in the manual; the kinds that the manual does not have use other letters.
char letter(const SniffRecord& record) { return static_cast<char>(record.kind); }

class Manual final : public SniffFormat {
 public:
  std::string add(const SniffRecord& record) override {
    hex_ += fmt::format("{}{:02X} ", letter(record), record.value);
    const bool printable = record.value >= 0x20 && record.value < 0x7f;
    text_ += printable ? static_cast<char>(record.value) : '.';
    return text_.size() == kBytesPerLine ? flush() : std::string();
  }
  std::string missing(std::uint64_t bytes) override {
    return flush() + fmt::format("({} missing)\n", counted(bytes, "byte"));
  }
  std::string flush() override {
    if (text_.empty()) return {};
    auto line = fmt::format("{}{}\n", hex_, text_);
    hex_.clear();
    text_.clear();
    return line;
  }

 private:
  static constexpr std::size_t kBytesPerLine = 10;
  std::string hex_;
  std::string text_;
};

class Lines final : public SniffFormat {
 public:
  explicit Lines(std::int64_t realtimeOffsetNs) : time_(realtimeOffsetNs) {}

  std::string add(const SniffRecord& record) override {
    std::string text;
    if (!bytes_.empty() && (record.kind != kind_ || bytes_.size() >= kMostBytes)) text = flush();
    if (bytes_.empty()) {
      kind_ = record.kind;
      startNs_ = record.atNs;
    }
    bytes_ += static_cast<char>(record.value);
    return record.value == '\n' ? text + flush() : text;
  }
  std::string missing(std::uint64_t bytes) override {
    return flush() + fmt::format("({} missing)\n", counted(bytes, "byte"));
  }
  std::string flush() override {
    if (bytes_.empty()) return {};
    auto line =
        fmt::format("{}  {}  {}\n", time_.of(startNs_), static_cast<char>(kind_), escape(bytes_));
    bytes_.clear();
    return line;
  }

 private:
  static constexpr std::size_t kMostBytes = 80;
  LineTime time_;
  SniffKind kind_{};
  std::int64_t startNs_ = 0;
  std::string bytes_;
};

class Json final : public SniffFormat {
 public:
  std::string add(const SniffRecord& record) override {
    return fmt::format("{{\"at_ns\": {}, \"kind\": \"{}\", \"value\": {}}}\n", record.atNs,
                       letter(record), record.value);
  }
  std::string missing(std::uint64_t bytes) override {
    return fmt::format("{{\"missing\": {}}}\n", bytes);
  }
  std::string flush() override { return {}; }
};

}  // namespace

std::unique_ptr<SniffFormat> SniffFormat::make(const std::string& name,
                                               std::int64_t realtimeOffsetNs) {
  if (name == "lines") return std::make_unique<Lines>(realtimeOffsetNs);
  if (name == "manual") return std::make_unique<Manual>();
  if (name == "json") return std::make_unique<Json>();
  throw std::invalid_argument(
      fmt::format("unknown sniff format \"{}\"; use lines, manual or json", name));
}

}  // namespace mpf::tools
