// SPDX-License-Identifier: MIT
// Doorbell: how a window's owner sleeps and how its peers wake it.
//
//   owner   announce (sleeping = 1) ─ fence ─ look again ─ sleep on the bell ─ withdraw (sleeping = 0)
//   peer    publish a message       ─ fence ─ sleeping? ─ change the bell, wake
//
// Of the two fences at least one side sees the other: either the owner finds the message or the
// peer finds the sleeper.
//
// Threads  one owner thread; any number of ringers in any process.
// Crash    a ringer killed between message and wake leaves a message that its death notice makes
//          the owner look for.
// Trust    the bell may be rung for nothing; it cannot be kept from ringing by anyone but the one
//          who rings.
#pragma once

#include <atomic>
#include <string>

#include <mpf/clock.h>
#include <mpf/file_descriptor.h>

#include "shm/layout.h"

namespace mpf::doorbell {

// Orders our stores before it with our loads after it. One half of PAIR(sleep-fence) and
// PAIR(watch-fence).
inline void fence() noexcept {
#ifdef __SANITIZE_THREAD__
  // ThreadSanitizer does not know fences; a locked instruction is one on the hosts that it runs on.
  static std::atomic<std::uint32_t> anywhere{0};
  // PAIR(sleep-fence), PAIR(watch-fence): as the callers say.
  anywhere.fetch_add(1, std::memory_order_seq_cst);
#else
  // PAIR(sleep-fence), PAIR(watch-fence): as the callers say.
  std::atomic_thread_fence(std::memory_order_seq_cst);
#endif
}

// Sleeps while `bell` still has the value `seen`, until rung or until `deadline`. May return early,
// when a signal handler ran that was installed without SA_RESTART for example; a handler that must
// end the sleep rings.
void sleep(const layout::Word32& bell, std::uint32_t seen, Deadline deadline) noexcept;

// Changes the bell and wakes who sleeps on it.
void ring(layout::Word32& bell) noexcept;

// The descriptor form: a FIFO in /dev/shm, readable when it was rung.
FileDescriptor createFifo(const std::string& name, mode_t mode, std::uint32_t group);
FileDescriptor tryOpenFifo(const std::string& name) noexcept;
// False: nobody was rung, for there is no FIFO.
bool tryRingFifo(const FileDescriptor& fifo) noexcept;
void drainFifo(const FileDescriptor& fifo) noexcept;

}  // namespace mpf::doorbell
