// SPDX-License-Identifier: MIT
#include <mpf/drivers/industry_pack/interrupt.h>

#include <sys/eventfd.h>

#include "base/system_call.h"

namespace mpf {

Interrupt::Interrupt()
    : event_(checkCall(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK), "eventfd", "for an interrupt")) {}

std::uint64_t Interrupt::take() noexcept {
  eventfd_t count = 0;
  return ::eventfd_read(event_.get(), &count) == 0 ? count : 0;
}

void Interrupt::announce() noexcept { ::eventfd_write(event_.get(), 1); }

}  // namespace mpf
