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

bool isValid(mode_t mode) {
  return (mode & ~kAnybodyReadsAndWrites) == 0 &&
         (mode & kOwnerReadsAndWrites) == kOwnerReadsAndWrites;
}

}  // namespace

mode_t parseMode(const std::string& text) {
  const auto mode = tryNumber<mode_t>(text, 8);
  if (mode && isValid(*mode)) return *mode;
  throw std::invalid_argument(
      fmt::format("{}: use an octal number between 0600 and 0666, such as 0660", text));
}

Rights checkServerRights(const Rights& rights) {
  if (!isValid(rights.mode))
    throw std::invalid_argument(fmt::format(
        "mode {:#o} of the rights: use read and write bits of user, group and others (0666), with "
        "at least those of the user (0600); an octal number such as 0660 begins with 0",
        rights.mode));
  if (rights.user != Rights().user)
    throw std::invalid_argument(fmt::format(
        "user {} of the rights: the segments of a server belong to the user of its process; admit "
        "other users by mode and group",
        rights.user));
  return rights;
}

Rights Rights::of(std::string_view mode, std::string_view group) {
  return {.mode = parseMode(std::string(mode)), .group = parseGroup(std::string(group))};
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
