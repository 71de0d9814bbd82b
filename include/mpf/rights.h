// SPDX-License-Identifier: MIT
// Rights: which users may open the segments that a process creates in shared memory.
//
//   {}                            the user of this process
//   {.mode = 0660, .group = gid}  and all members of the group `gid`
//   {.mode = 0666}                every user of the host
//   Rights::of("0660", "mpf")     all members of the group "mpf", as `--mode 0660 --group mpf`
//
// A peer needs read and write permission. Without it, the peer cannot connect.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string_view>

#include <mpf/detail/cpp20.h>

namespace mpf {

//   mode   permission bits, as for chmod(2): the read and write bits of user, group and others, at
//          least 0600
//   group  number of the group that gets the segments; ~0: the group of the process
//   user   leave it ~0: the user of the process. A server refuses others, because the owner of a
//          file may change who writes it. A client that root runs uses it, to give a link to the
//          user of its server
struct Rights {
  mode_t mode = 0600;
  std::uint32_t group = ~std::uint32_t{0};
  std::uint32_t user = ~std::uint32_t{0};
  // The rights that the options --mode and --group of a server program give.
  //   mode    octal, from "0600" to "0666"
  //   group   its name
  //   throws  std::invalid_argument that names the wrong value
  [[nodiscard]] static Rights of(std::string_view mode, std::string_view group);
  bool operator==(const Rights&) const = default;
};

}  // namespace mpf
