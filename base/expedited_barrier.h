// SPDX-License-Identifier: MIT
// ExpeditedBarrier: a full memory barrier that one thread executes on behalf of others
// (membarrier(2)). It lets a frequent path do without a barrier, because the rare path pays for
// both.
//
//   frequent   store mine ─ (compiler only) ─ load theirs
//   rare       store theirs ─ barrier in all other threads ─ load mine
//
// At least one of the two loads sees the other side's store.
//
//   across processes   reaches the threads of each process of this host that has called
//                      tryRegister(), and takes 15 us while they run
//   in this process    reaches the other threads of this process
//
// Threads  any.
// Crash    no state is left behind.
// Trust    a process that pretends to be registered loses only its own wake-ups.
#pragma once

namespace mpf::expedited_barrier {

// Lets barriers of other processes reach this process, and returns true when they do and this
// process can execute both kinds. False where the kernel, a container or ThreadSanitizer, which
// does not model such barriers, does not allow it. The first call registers; later calls, also in
// the child of a fork, cost a load.
[[nodiscard]] bool tryRegister() noexcept;

// Call these only after tryRegister() has returned true. A failure, which a seccomp filter that was
// installed later can cause, ends the process: its peers rely on the barrier.
void acrossProcesses() noexcept;
void inThisProcess() noexcept;

// The frequent side: keeps the compiler from moving the load before the store. It has no PAIR line,
// because the barrier of the rare side is a system call.
inline void frequentSide() noexcept { asm volatile("" : : : "memory"); }

}  // namespace mpf::expedited_barrier
