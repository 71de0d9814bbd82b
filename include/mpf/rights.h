// SPDX-License-Identifier: MIT
// Rights: which users may open the segments that a process creates in shared memory.
//
//   {}                            the user of this process
//   {.mode = 0660, .group = gid}  and all members of the group `gid`
//   {.mode = 0666}                every user of the host
//
// A peer needs read and write permission. Without it, the peer cannot connect.
#pragma once

#include <sys/types.h>

#include <cstdint>

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
  bool operator==(const Rights&) const = default;
};

}  // namespace mpf
