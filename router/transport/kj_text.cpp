// SPDX-License-Identifier: MIT
#include "router/transport/kj_text.h"

#include "base/printable.h"

namespace mpf::router {
namespace {

constexpr std::size_t kMaxText = 200;  // bytes

// Cuts a text to kMaxText, between two characters of UTF-8.
std::string shortened(std::string text) {
  const auto isContinuation = [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0u) == 0x80;
  };
  auto size = kMaxText;
  while (size < text.size() && size != 0 && isContinuation(text[size])) --size;
  if (size < text.size()) text.resize(size);
  return text;
}

}  // namespace

// A peer may send megabytes: the text is cut before it is converted, and once more because escape
// sequences make it longer.
std::string displayText(const std::string& text) { return shortened(printable(shortened(text))); }

std::string reasonOf(const kj::Exception& error) {
  auto said = toStd(error.getDescription());
  if (said.starts_with("operation timed out")) return std::string(kTimeout);
  for (const std::string_view mark : {"gai_strerror(status) = ", "): "}) {
    const auto at = said.find(mark);
    if (at == std::string::npos) continue;
    const auto begin = at + mark.size();
    return said.substr(begin, said.find("; ", begin) - begin);
  }
  return said;
}

}  // namespace mpf::router
