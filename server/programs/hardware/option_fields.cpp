// SPDX-License-Identifier: MIT
#include "server/programs/hardware/option_fields.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fmt/format.h>
#include <utility>

#include "base/number.h"
#include "shm/link.h"

namespace mpf {

OptionFields::OptionFields(std::string option, const std::string& text)
    : option_(std::move(option)), text_(text) {
  for (std::size_t at = 0; at <= text.size();) {
    const auto end = std::min(text.find(',', at), text.size());
    fields_.push_back(text.substr(at, end - at));
    at = end + 1;
  }
}

std::string OptionFields::word(const char* what) {
  if (!hasNext()) complain(fmt::format("{} is missing", what));
  return fields_[next_++];
}

std::string OptionFields::word(const char* what, std::string_view otherwise) {
  if (hasNext()) return word(what);
  ++next_;
  return std::string(otherwise);
}

int OptionFields::number(const char* what) {
  const auto text = word(what);
  const auto value = tryNumber<int>(text);
  if (!value) complain(fmt::format("{} \"{}\" is not a whole number", what, text));
  return *value;
}

int OptionFields::number(const char* what, int otherwise) {
  if (hasNext()) return number(what);
  ++next_;
  return otherwise;
}

char OptionFields::letter(const char* what, char otherwise) {
  const auto text = word(what, std::string_view(&otherwise, 1));
  if (text.size() != 1) complain(fmt::format("{} \"{}\" is not one letter", what, text));
  return text[0];
}

int OptionFields::queueSize() {
  const int size = number("queue size", kDefaultQueueSize);
  constexpr int kMost = LinkGeometry::kMaxQueueSize;
  if (size < 1 || size > kMost) complain(fmt::format("queue size {}: use 1 to {}", size, kMost));
  return size;
}

void OptionFields::end() const {
  if (next_ < fields_.size()) complain(fmt::format("unexpected field \"{}\"", fields_[next_]));
}

void OptionFields::complain(const std::string& why) const {
  throw CLI::ValidationError(option_, fmt::format("{}: {}", text_, why));
}

CLI::Option* addFields(CLI::App& app, const std::string& option, const char* form, const char* help,
                       const std::function<void(OptionFields&)>& take) {
  return app
      .add_option_function<std::vector<std::string>>(
          option,
          [option, take](const std::vector<std::string>& texts) {
            for (const auto& text : texts) {
              OptionFields fields(option, text);
              take(fields);
              fields.end();
            }
          },
          help)
      ->type_name(form)
      ->allow_extra_args(false);
}

}  // namespace mpf
