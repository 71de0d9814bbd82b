// SPDX-License-Identifier: MIT
#include "base/print_error.h"

#include <unistd.h>

#include "base/error_queue.h"
#include "base/system_call.h"

namespace mpf {

void writeError(std::string_view bytes) noexcept {
  if (auto* const queue = ErrorQueue::current()) return queue->write(bytes);
  while (!bytes.empty()) {
    const auto written = retryInterrupted(
        [&]() noexcept { return ::write(STDERR_FILENO, bytes.data(), bytes.size()); });
    if (written <= 0) return;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
}

}  // namespace mpf
