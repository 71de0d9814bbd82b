// SPDX-License-Identifier: MIT
#include "shm/reserve.h"

#include <fcntl.h>

#include <algorithm>
#include <cerrno>

namespace mpf {

// Older kernels abort and undo a long reservation when a signal arrives. Small pieces complete
// between two ticks of a timer.
int reserve(int file, std::size_t bytes) noexcept {
  constexpr std::size_t kPiece = std::size_t{1} << 20;
  int shortage = ::posix_fallocate(file, 0, static_cast<off_t>(bytes));
  if (shortage != EINTR) return shortage;
  for (std::size_t at = 0; at < bytes;) {
    shortage = ::posix_fallocate(file, static_cast<off_t>(at),
                                 static_cast<off_t>(std::min(kPiece, bytes - at)));
    if (shortage != 0 && shortage != EINTR) return shortage;
    if (shortage == 0) at += kPiece;
  }
  return 0;
}

}  // namespace mpf
