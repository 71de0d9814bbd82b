// SPDX-License-Identifier: MIT
// Rights: which users may open what a process creates in shared memory.
#pragma once

#include <sys/types.h>

#include <cstdint>

namespace mpf {

// The default is the creator alone. Mode 0660 with a group admits the members of the group.
//
//   mode   as of chmod(2); a peer needs read and write permission
//   group  ~0: the group of the process
//   user   ~0: the user of the process; only root may name another one
struct Rights {
  mode_t mode = 0600;
  std::uint32_t group = ~std::uint32_t{0};
  std::uint32_t user = ~std::uint32_t{0};
  bool operator==(const Rights&) const = default;
};

}  // namespace mpf
