// SPDX-License-Identifier: MIT
#include <mpf/router/kj_text.h>

#include <algorithm>

namespace mpf::router {
namespace {

constexpr std::size_t kMaxText = 200;  // bytes

}  // namespace

std::string forPeople(const std::string& text) {
  const auto isWithin = [](char c) { return (static_cast<unsigned char>(c) & 0xC0u) == 0x80; };  // a character of UTF-8
  auto size = std::min(text.size(), kMaxText);
  while (size != 0 && size < text.size() && isWithin(text[size])) --size;
  auto clean = text.substr(0, size);
  std::ranges::replace_if(clean, [](char c) { return static_cast<unsigned char>(c) < ' ' || c == 127; }, '?');
  return clean;
}

std::string reasonOf(const kj::Exception& error) {
  const auto said = toStd(error.getDescription());
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
