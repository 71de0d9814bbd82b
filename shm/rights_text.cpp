// SPDX-License-Identifier: MIT
#include "shm/rights_text.h"

#include <cerrno>
#include <fmt/format.h>
#include <grp.h>
#include <stdexcept>
#include <vector>

#include "base/number.h"

namespace mpf {
namespace {

constexpr mode_t kAnybodyReadsAndWrites = 0666;
constexpr mode_t kOwnerReadsAndWrites = 0600;

}  // namespace

mode_t parseMode(const std::string& text) {
  const auto mode = tryNumber<mode_t>(text, 8);
  if (mode && (*mode & ~kAnybodyReadsAndWrites) == 0 &&
      (*mode & kOwnerReadsAndWrites) == kOwnerReadsAndWrites) {
    return *mode;
  }
  throw std::invalid_argument(
      fmt::format("{}: use an octal number between 0600 and 0666, such as 0660", text));
}

std::uint32_t parseGroup(const std::string& name) {
  group entry{};
  group* found = nullptr;
  std::vector<char> room(1024);
  while (::getgrnam_r(name.c_str(), &entry, room.data(), room.size(), &found) == ERANGE)
    room.resize(2 * room.size());
  if (found == nullptr)
    throw std::invalid_argument(fmt::format("{}: there is no group of this name", name));
  return found->gr_gid;
}

}  // namespace mpf
